"""The planner's input, state and status: immutable snapshots."""

import math
from collections.abc import Callable
from enum import Enum
from functools import cached_property
from typing import NamedTuple

import numpy as np

from drake_starnav.geometry.footprint import Footprint
from drake_starnav.geometry.polyline import simplify_polyline
from drake_starnav.planning.frontiers import find_frontiers
from drake_starnav.planning.guidance import Guidance
from drake_starnav.planning.parameters import PlannerParameters
from drake_starnav.planning.roadmap import NOTHING_CLOSED, ClosedPlaces, StarRoadmap
from drake_starnav.planning.string_pulling import find_farthest_in_sight
from drake_starnav.robot import Base, Limits
from drake_starnav.surroundings.margins import Margins
from drake_starnav.surroundings.observation import Observation
from drake_starnav.surroundings.surroundings import Surroundings
from drake_starnav.utils.snapshot import replace_fields, snapshot

UNSET_POSITION = np.full(2, np.inf)
"""A position infinitely far from every place, m."""
EMPTY_PATH, NO_POSES = np.zeros((0, 2)), np.zeros((0, 4))
STRAIGHT = 0.08
"""Frontiers are shown as lines that are off by up to this, in radii of the robot."""


class PlannerStatus(Enum):
    """The planner's current activity.

    While a robot that is neither at its goal nor without a way stands still, its planner is BLOCKED: it waits for what
    is in the way to leave.
    """

    WAITING = "waiting"
    EXPLORING = "exploring"
    APPROACHING = "approaching"
    UNREACHABLE = "unreachable"
    BLOCKED = "blocked"


class Route(NamedTuple):
    """The path to the goal, or to the exit.

    Attributes:
        path: shape (k, 2), way points ahead, inside the regions, W, m; the first is the short-term goal.
        exit: viewpoint and probe of the frontier at which the optimistic path leaves the regions, shape (2, 2), W, m;
            None: the path leads to the goal, or there is none.
        beyond: shape (m, 2), the optimistic path from the probe to the goal, W, m.
        start: where the robot was when the route was planned, shape (2,), W, m.
    """

    path: np.ndarray = EMPTY_PATH
    exit: np.ndarray | None = None
    beyond: np.ndarray = EMPTY_PATH
    start: np.ndarray = UNSET_POSITION


class DeadEnd(NamedTuple):
    """No way is left to the goal.

    Attributes:
        since: when that began, s.
        distance: from the robot to its goal then, m.
        cause: what leaves no way, for good; empty: something that may leave, or what the scans show.
    """

    since: float
    distance: float
    cause: str = ""


class Progress(NamedTuple):
    """How the drive to the goal goes.

    Attributes:
        position: where the last progress was made, shape (2,), W, m.
        time: when it was made, s.
        node_position: where a node was last added, or last omitted because its scan showed nothing new, shape (2,).
        plan_count: number of paths planned.
        began_with_map: whether the roadmap already had nodes when the goal was set.
        dead_end: the last one on the way to this goal; None: there was none.
        standing_since: since when a robot of limited view has stood, or faced its path, without progress, s.
        looking_heading: yaw in W to which a robot of limited view turns on the spot for now, rad; NaN: none.
    """

    position: np.ndarray = UNSET_POSITION
    time: float = 0.0
    node_position: np.ndarray = UNSET_POSITION
    plan_count: int = 0
    began_with_map: bool = False
    dead_end: DeadEnd | None = None
    standing_since: float = 0.0
    looking_heading: float = math.nan


class ManoeuvreContext(NamedTuple):
    """A robot that is no disc.

    Attributes:
        footprint: of the robot.
        surroundings: what its certificate knows.
        margin: that the certificate keeps, m.
        motion_primitives: of its manoeuvres, see `Base.motion_primitives`.
        limits: of its drive.
        base: how it moves.
    """

    footprint: Footprint
    surroundings: Surroundings
    margin: float
    motion_primitives: np.ndarray
    limits: Limits
    base: Base


class ManoeuvreState(NamedTuple):
    """What the planner knows of the robot's manoeuvres.

    Attributes:
        poses: shape (k, 4), still ahead: x, y, yaw in W, and the gear: 0 turns on the spot, 1 drives forwards, -1
            backwards.
        since: when one of them was last reached, s.
        pose: where the robot last moved to, shape (3,).
        standing_since: since when it has been there, s.
        least_path_left: the least length of its path that was left so far, m.
        turned_angle: by how much it has turned since that was left, to the left, rad.
        end: x, y of the path's end, W, m, and the robot's heading at the last scan, rad.
        attempts: shape (n, 2), where the last ones began, or were searched in vain, since the way was last given up,
            W, m.
        has_given_up: whether no more is tried on this way.
    """

    poses: np.ndarray = NO_POSES
    since: float = 0.0
    pose: np.ndarray = np.full(3, np.inf)
    standing_since: float = 0.0
    least_path_left: float = math.inf
    turned_angle: float = 0.0
    end: tuple[float, float, float] = (math.inf, math.inf, 0.0)
    attempts: np.ndarray = EMPTY_PATH
    has_given_up: bool = False


@snapshot
class PlannerState:
    """The planner's state. Immutable.

    Attributes:
        roadmap: the latest snapshot.
        status: its current activity.
        route: which the robot follows; without a path it stops.
        progress: of the drive to the goal.
        is_retrying: whether all routes have failed once. From then on only a stall or averaged scans close a route.
        manoeuvre: of a robot that is no disc.
        recent_observations: the latest ones, oldest first.
    """

    roadmap: StarRoadmap
    status: PlannerStatus = PlannerStatus.WAITING
    route: Route = Route()
    progress: Progress = Progress()
    is_retrying: bool = False
    manoeuvre: ManoeuvreState = ManoeuvreState()
    recent_observations: tuple[Observation, ...] = ()

    @staticmethod
    def initial(
        parameters: PlannerParameters,
        cover_radius: float,
        outer_radius: float = 0.0,
        closures: ClosedPlaces = NOTHING_CLOSED,
    ) -> "PlannerState":
        """Return the state before the first scan; arguments as for `StarRoadmap.empty`."""
        return PlannerState(StarRoadmap.empty(parameters, cover_radius, outer_radius, closures))

    def with_new_goal(self) -> "PlannerState":
        """Return the state after a change of the goal: map and closures are kept, the plan is reset."""
        progress = self.progress._replace(
            position=UNSET_POSITION,
            began_with_map=len(self.roadmap) > 0,
            dead_end=None,
            looking_heading=math.nan,
        )
        return replace_fields(
            self,
            status=PlannerStatus.WAITING,
            route=Route(),
            progress=progress,
            is_retrying=False,
            manoeuvre=ManoeuvreState(),
            recent_observations=(),
        )

    def frontiers(self, cover_radius: float) -> np.ndarray:
        """Return the frontiers as line segments, shape (n, 2, 2), W, m, for a robot of this radius, m."""
        frontiers = find_frontiers(self.roadmap, cover_radius)
        lines = [simplify_polyline(each.boundary, STRAIGHT * cover_radius) for each in frontiers]
        return np.concatenate([np.zeros((0, 2, 2)), *(np.stack((each[:-1], each[1:]), axis=1) for each in lines)])

    @cached_property
    def guidance(self) -> Guidance:
        """The plan as the controller receives it: manoeuvres first, then turns to unseen space, then the path."""
        path, regions = self.route.path, self.roadmap.union
        if not len(path):
            return Guidance.none()
        arrives = self.status is PlannerStatus.APPROACHING
        if len(self.manoeuvre.poses):
            return Guidance(path, arrives, regions, self.manoeuvre.poses)
        if math.isfinite(self.progress.looking_heading):
            position = self.recent_observations[-1].pose[:2]
            return Guidance(path, False, regions, np.array(((*position, self.progress.looking_heading, 0.0),)))
        return look_ahead(self) or Guidance(path, arrives, regions)


def look_ahead(state: PlannerState) -> Guidance | None:
    """Return guidance to the farthest point of the optimistic path beyond the exit that the latest scan shows free.

    None on the way to another way point or to the goal, and while nothing of that path is in sight.
    """
    route = state.route
    if state.status is not PlannerStatus.EXPLORING or len(route.path) != 1 or not state.recent_observations:
        return None
    latest = state.recent_observations[-1]
    assert latest.region is not None
    current_region = state.roadmap.closures.open_part(latest.region)
    x, y = latest.pose[:2].tolist()
    last = find_farthest_in_sight(route.beyond, x, y, tuple(current_region.as_union), current_region.radius)
    return None if last < 0 else Guidance(route.beyond[last : last + 1], False, current_region.as_union)


class PlannerInput(NamedTuple):
    """Inputs of one update of the planner, beside its state.

    Attributes:
        observation: the latest observation.
        position: of the robot then, shape (2,), W, m.
        goal: shape (2,), W, m.
        time: then, s.
        parameters: of the roadmap.
        margins: of its regions.
        cover_radius: of the robot's footprint: its radius if it is a disc, else that of the narrowest discs that cover
            it, m.
        goal_tolerance: a robot this near to the goal has reached it, m.
        interval: time since the update before, s.
        manoeuvre_context: what the manoeuvres of a robot need that is no disc.
        heading: to which a robot at its goal is to turn, W, rad; NaN: none.
    """

    observation: Observation
    position: np.ndarray
    goal: np.ndarray
    time: float
    parameters: PlannerParameters
    margins: Margins
    cover_radius: float
    goal_tolerance: float = 0.0
    interval: float = 0.0
    manoeuvre_context: ManoeuvreContext | None = None
    heading: float = math.nan

    @property
    def outer_radius(self) -> float:
        """Radius of the disc that the robot covers when it turns, m."""
        return self.cover_radius if self.manoeuvre_context is None else self.manoeuvre_context.footprint.radius

    @property
    def has_limited_view(self) -> bool:
        """Whether there is no lidar on the robot's axis that sees all around."""
        scan = self.observation.scan
        return scan.merged or not scan.full_circle


PlanStep = Callable[[PlannerState, PlannerInput], PlannerState]
"""One update of a planner as a pure function, as `plan_step`."""
