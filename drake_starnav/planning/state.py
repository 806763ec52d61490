"""What the planner sees, remembers and tells: immutable snapshots."""

import dataclasses
from dataclasses import field
from enum import Enum
from typing import NamedTuple

import numpy as np

from drake_starnav.planning.fastest_path import Headway
from drake_starnav.planning.guidance import Guidance
from drake_starnav.planning.parameters import PlannerParameters
from drake_starnav.planning.roadmap import StarRoadmap
from drake_starnav.regions.observation import Observation
from drake_starnav.utils.snapshot import snapshot

NOWHERE = np.full(2, np.inf)
"""Infinitely far from every place, m."""
NO_PATH = np.zeros((0, 2))
NO_RETRIES = np.zeros((0, 3))


class PlannerStatus(Enum):
    """What the planner is doing."""

    WAITING = "waiting"
    EXPLORING = "exploring"
    APPROACHING = "approaching"
    UNREACHABLE = "unreachable"


@snapshot
class PlannerState:
    """Everything the planner remembers. Immutable.

    Attributes:
        roadmap: the latest snapshot.
        status: what the planner is doing.
        path: shape (k, 2), way points still ahead, W, m.
        target: stand and probe of the target frontier, shape (2, 2); None when the target is the goal or nothing.
        node_position: where a node was last added, or nothing new was seen for one, shape (2,).
        progress_position: where progress was last made, shape (2,).
        progress_time: when, s.
        retries: shape (k, 3), where and at which scan's time the roadmap was rebuilt to try again what was tried in
            vain, (x, y) in W and s.
        plans: how often a path was planned.
        headway: the watch over a robot on the fastest path.
        began_with_map: whether the goal was set when the roadmap had nodes already.
        plan_position: of the robot when the latest path was planned, shape (2,).
        way_on: shape (m, 2), the optimistic path from the target frontier's probe to the goal, W, m.
        next_on: shape (n, 2), the part of it to which the robot may turn.
        anticipated: what to follow in place of the path, where the latest scan shows part of `next_on`; or None.
    """

    roadmap: StarRoadmap
    status: PlannerStatus
    path: np.ndarray
    target: np.ndarray | None
    node_position: np.ndarray
    progress_position: np.ndarray
    progress_time: float
    retries: np.ndarray
    plans: int
    headway: Headway = field(default_factory=Headway)
    began_with_map: bool = False
    plan_position: np.ndarray = field(default_factory=lambda: NOWHERE)
    way_on: np.ndarray = field(default_factory=lambda: NO_PATH)
    next_on: np.ndarray = field(default_factory=lambda: NO_PATH)
    anticipated: Guidance | None = None

    @staticmethod
    def initial(parameters: PlannerParameters, robot_radius: float) -> "PlannerState":
        """Before the first scan."""
        return PlannerState(
            roadmap=StarRoadmap.empty(parameters, robot_radius),
            status=PlannerStatus.WAITING,
            path=NO_PATH,
            target=None,
            node_position=NOWHERE,
            progress_position=NOWHERE,
            progress_time=0.0,
            retries=NO_RETRIES,
            plans=0,
        )

    def with_new_goal(self) -> "PlannerState":
        """The state once the goal has moved, even after having given up: the map stays, all else begins anew."""
        return dataclasses.replace(
            self,
            status=PlannerStatus.WAITING,
            path=NO_PATH,
            target=None,
            progress_position=NOWHERE,
            retries=NO_RETRIES,
            headway=Headway(),
            anticipated=None,
            began_with_map=len(self.roadmap) > 0,
        )

    @property
    def guidance(self) -> Guidance:
        """The part of the plan that the controller needs."""
        if self.anticipated is not None:
            return self.anticipated
        if not len(self.path):
            return Guidance.none()
        return Guidance(self.path, self.status is PlannerStatus.APPROACHING, self.roadmap.stack)


class PlannerInput(NamedTuple):
    """What one update of the planner is given, beside its state.

    Attributes:
        seen: the latest scan.
        position: of the robot now, shape (2,), W, m.
        goal: shape (2,), W, m.
        time: s.
        parameters: of the roadmap.
        robot_radius: m.
        goal_tolerance: a robot this near to the goal has reached it, m.
    """

    seen: Observation
    position: np.ndarray
    goal: np.ndarray
    time: float
    parameters: PlannerParameters
    robot_radius: float
    goal_tolerance: float = 0.0
