"""Goals that a robot visits one after the other."""

import math
from collections.abc import Sequence
from typing import NamedTuple

import numpy as np
from pydrake.systems.framework import Context, DiscreteValues, EventStatus, LeafSystem

from drake_starnav.geometry.footprint import Footprint, disc, find_top_speed
from drake_starnav.geometry.trajectory import STANDING
from drake_starnav.manoeuvres.pose_search import NEAR_GOAL, REACH
from drake_starnav.robot import BASES, Base
from drake_starnav.utils.timing import check_period

HEADING_TOLERANCE = 0.05
"""A robot has turned to a heading when it differs by less than this, rad."""


class Arrival(NamedTuple):
    """How far a robot has come to a goal.

    Attributes:
        reached: whether it is there, and has turned to the heading, if any.
        heading: to which it is to turn now, rad; NaN while there is none.
    """

    reached: bool
    heading: float

    @staticmethod
    def at(goal: Sequence[float], state: np.ndarray, room: "TurningRoom", turning: bool) -> "Arrival":
        """How a robot with this state (x, y, yaw, v, omega) stands to a goal (x, y) or (x, y, yaw), W, m and rad.

        It arrives within the room's tolerance; while it is `turning`, it may leave the place again.
        """
        (goal_x, goal_y, *turn), (x, y, yaw, *speeds) = goal, state[:5].tolist()
        goal_distance = math.hypot(x - goal_x, y - goal_y)
        is_standing = find_top_speed(*speeds, room.radius) <= STANDING
        has_turned = all(
            abs(math.remainder(wanted_heading - yaw, 2.0 * math.pi)) < HEADING_TOLERANCE for wanted_heading in turn
        )
        must_turn = turn and goal_distance < (
            room.turning if turning else room.standing if is_standing else room.tolerance
        )
        return Arrival(goal_distance < room.tolerance and has_turned, turn[0] if must_turn else math.nan)


class TurningRoom(NamedTuple):
    """How far from its goal a robot of a radius begins to turn to a heading there, m.

    Attributes:
        radius: of the robot.
        tolerance: of the goal.
        standing: how far from the goal a robot that stands begins to turn: it may have no way there but with the
            heading, m.
        turning: largest distance from the goal while it turns, m.
    """

    radius: float
    tolerance: float
    standing: float
    turning: float

    @staticmethod
    def of(base: Base, shape: Footprint, tolerance: float) -> "TurningRoom":
        """The room of a robot with this footprint; `tolerance` in m."""
        arrival_distance = max(NEAR_GOAL * shape.lever, tolerance)
        stays = base.turns_on_the_spot and shape.is_disc
        return TurningRoom(
            shape.radius,
            tolerance,
            arrival_distance,
            arrival_distance if stays else max(REACH * shape.radius, arrival_distance),
        )


class GoalSequence(LeafSystem):
    """Outputs the first of several goals that the robot has not reached; the last one when it has reached all.

    ```
              ┌──────────────┐
              │              ├──> goal
    state ───>│ GoalSequence ├──> heading
              │              ├──> reached
              └──────────────┘
    ```

    Ports:
        state: vector (x, y, yaw, v, omega) of the robot in the world frame W.
        goal: vector (x, y) in W, m.
        heading: vector of size 1: yaw in W to which a robot at its goal is to turn, rad; NaN while there is none.
        reached: vector, when each goal was reached, s; NaN for those that were not.

    A goal (x, y) is reached within `tolerance`; one with a yaw when the robot has then turned to it, too, within
    HEADING_TOLERANCE, and no point of its footprint is faster than STANDING. All outputs are discrete state.
    """

    def __init__(
        self,
        goals: Sequence[Sequence[float]],
        *,
        tolerance: float,
        period: float,
        footprint: Footprint | None = None,
        base: Base = BASES["differential"],
    ) -> None:
        """
        Args:
            goals: (x, y) or (x, y, yaw) of each, W, m and rad; at least one.
            tolerance: distance from a goal within which the robot is there, m.
            period: of the checks, s.
            footprint: of the robot; None: whether it turns does not matter.
            base: how it moves.
        """
        super().__init__()
        self._goals = [tuple(map(float, goal)) for goal in goals]
        self._room = TurningRoom.of(base, footprint or disc(0.0), tolerance)
        self._state = self.DeclareVectorInputPort("state", 5)
        state_names = "goal", "heading", "reached"
        initial_values = self._goals[0][:2], (math.nan,), np.full(len(goals), math.nan)
        self._indices = [self.DeclareDiscreteState(np.array(value)) for value in initial_values]
        for name, index in zip(state_names, self._indices, strict=True):
            self.DeclareStateOutputPort(name, index)
        self.DeclarePeriodicDiscreteUpdateEvent(check_period(self, period=period), 0.0, self._check)

    def _check(self, context: Context, values: DiscreteValues) -> EventStatus:
        goal, heading, reached_times = self._indices
        times = context.get_discrete_state(reached_times).value().copy()
        k = int(np.isfinite(times).sum())
        if k == len(times):
            return EventStatus.DidNothing()
        state, turning = self._state.Eval(context), math.isfinite(context.get_discrete_state(heading).value()[0])
        arrival = Arrival.at(self._goals[k], state, self._room, turning)
        wanted_heading = arrival.heading
        if arrival.reached and (len(self._goals[k]) == 2 or find_top_speed(*state[3:], self._room.radius) <= STANDING):
            times[k] = context.get_time()
            values.set_value(reached_times, times)
            values.set_value(goal, self._goals[min(k + 1, len(times) - 1)][:2])
            wanted_heading = wanted_heading if k + 1 == len(times) else math.nan
        values.set_value(heading, [wanted_heading])
        return EventStatus.Succeeded()
