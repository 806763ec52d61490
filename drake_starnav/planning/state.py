"""The planner's input, state and status: immutable snapshots."""

import dataclasses
import math
from collections.abc import Callable
from dataclasses import field
from enum import Enum
from functools import cached_property
from typing import NamedTuple

import numpy as np

from drake_starnav.geometry.polyline import simplified
from drake_starnav.planning.closed_places import NOTHING_CLOSED, Closures
from drake_starnav.planning.frontiers import all_gaps
from drake_starnav.planning.guidance import Guidance
from drake_starnav.planning.manoeuvre import Body, Manoeuvring
from drake_starnav.planning.parameters import PlannerParameters
from drake_starnav.planning.roadmap import StarRoadmap
from drake_starnav.surroundings.margins import Margins
from drake_starnav.surroundings.observation import Observation
from drake_starnav.utils.snapshot import snapshot

UNSET_POSITION = np.full(2, np.inf)
"""A position infinitely far from every place, m."""
EMPTY_PATH = np.zeros((0, 2))
STRAIGHT = 0.08
"""Frontiers are shown as lines that are off by up to this, in radii of the robot."""


class Wait(NamedTuple):
    """A robot waits as no way is left but past what may leave.

    Attributes:
        since: when that began, s.
        distance: from the robot to its goal then, m.
    """

    since: float
    distance: float


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


@snapshot
class PlannerState:
    """The planner's state. Immutable.

    Attributes:
        roadmap: the latest snapshot.
        status: its current activity.
        path: shape (k, 2), waypoints ahead, W, m.
        target: viewpoint and probe of the target frontier, where the optimistic path leaves the regions, shape (2, 2);
            None when the target is the goal or nothing.
        node_position: where a node was last added, or last omitted because its scan showed nothing new, shape (2,).
        progress_position: where the last progress was made, shape (2,).
        progress_time: when it was made, s.
        plans: number of paths planned.
        began_with_map: whether the roadmap already had nodes when the goal was set.
        plan_position: position of the robot when the latest path was planned, shape (2,).
        optimistic_path: shape (m, 2), the optimistic path from the target frontier's probe to the goal, W, m.
        doubting: whether no way was left once. Then only standing still, or enough scans, speak against a way.
        recent: the latest observations, oldest first.
        manoeuvring: of a robot that is no disc.
        aside: guidance that precedes the path, to turn to what is to be seen or to what the latest scan shows; or None.
        facing_time: since when the robot has stood, or faced its path, without progress, s.
        wait: for what may leave, until a way is found nearer to the goal; None: there was none.
        barred_by: the causes of closures but for which there might be a way, once none is left; empty: there are none.
    """

    roadmap: StarRoadmap
    status: PlannerStatus
    path: np.ndarray
    target: np.ndarray | None
    node_position: np.ndarray
    progress_position: np.ndarray
    progress_time: float
    plans: int
    began_with_map: bool = False
    plan_position: np.ndarray = field(default_factory=lambda: UNSET_POSITION)
    optimistic_path: np.ndarray = field(default_factory=lambda: EMPTY_PATH)
    doubting: bool = False
    recent: tuple[Observation, ...] = ()
    manoeuvring: Manoeuvring = Manoeuvring()
    aside: Guidance | None = None
    facing_time: float = 0.0
    wait: Wait | None = None
    barred_by: str = ""

    @staticmethod
    def initial(
        parameters: PlannerParameters, robot_radius: float, swept_radius: float = 0.0, walls: Closures = NOTHING_CLOSED
    ) -> "PlannerState":
        """The state before the first scan; arguments as for `StarRoadmap.empty`."""
        return PlannerState(
            roadmap=StarRoadmap.empty(parameters, robot_radius, swept_radius, walls),
            status=PlannerStatus.WAITING,
            path=EMPTY_PATH,
            target=None,
            node_position=UNSET_POSITION,
            progress_position=UNSET_POSITION,
            progress_time=0.0,
            plans=0,
        )

    def with_new_goal(self) -> "PlannerState":
        """The state after a change of the goal, even from UNREACHABLE: map and closures are kept, the plan is reset."""
        return dataclasses.replace(
            self,
            status=PlannerStatus.WAITING,
            path=EMPTY_PATH,
            target=None,
            progress_position=UNSET_POSITION,
            doubting=False,
            recent=(),
            aside=None,
            wait=None,
            began_with_map=len(self.roadmap) > 0,
        )

    def frontiers(self, robot_radius: float) -> np.ndarray:
        """The frontiers as line segments, shape (n, 2, 2), W, m, for a robot of this radius, m."""
        gaps = all_gaps(self.roadmap, robot_radius)
        lines = [simplified(gap.line, STRAIGHT * robot_radius) for gap in gaps]
        return np.concatenate([np.zeros((0, 2, 2)), *(np.stack((each[:-1], each[1:]), axis=1) for each in lines)])

    @cached_property
    def guidance(self) -> Guidance:
        """The plan as the controller receives it."""
        if not len(self.path):
            return Guidance.none()
        if self.aside is not None and not len(self.manoeuvring.poses):
            return self.aside
        arrives = self.status is PlannerStatus.APPROACHING
        return Guidance(self.path, arrives, self.roadmap.union, self.manoeuvring.poses)


class PlannerInput(NamedTuple):
    """Inputs of one update of the planner, beside its state.

    Attributes:
        observation: the latest observation.
        position: of the robot then, shape (2,), W, m.
        goal: shape (2,), W, m.
        time: then, s.
        parameters: of the roadmap.
        margins: of its regions.
        robot_radius: of the robot, or of the narrowest disc that covers a part of it, m.
        goal_tolerance: a robot this near to the goal has reached it, m.
        interval: time since the update before, s.
        body: the robot, if it is no disc.
        heading: to which a robot at its goal is to turn, W, rad; NaN: none.
    """

    observation: Observation
    position: np.ndarray
    goal: np.ndarray
    time: float
    parameters: PlannerParameters
    margins: Margins
    robot_radius: float
    goal_tolerance: float = 0.0
    interval: float = 0.0
    body: Body | None = None
    heading: float = math.nan

    @property
    def swept_radius(self) -> float:
        """Radius of the disc that the robot covers when it turns, m."""
        return self.robot_radius if self.body is None else self.body.footprint.radius


PlanStep = Callable[[PlannerState, PlannerInput], PlannerState]
"""One update of a planner as a pure function, as `plan_step`."""
