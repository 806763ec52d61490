"""Ends a run when the robot has arrived, or has stopped because the goal is unreachable."""

import math

import numpy as np
from pydrake.common.value import Value
from pydrake.systems.framework import Context, DiscreteValues, EventStatus, LeafSystem

from drake_starnav.planning import PlannerStatus
from drake_starnav.utils.timing import checked_period

STANDING = 0.01
"""A robot slower than this counts as standing, m/s or rad/s."""


class ArrivalMonitor(LeafSystem):
    """Terminates the simulation when the robot is at the goal, or has stopped after the planner gave up.

    ```
               ┌────────────────┐
    state ────>│                │
    goal ─────>│ ArrivalMonitor │
    reached ──>│                │
    status ───>│                │
               └────────────────┘
    ```

    Ports:
        state: vector (x, y, yaw, v, omega) of the robot in the world frame W.
        goal: vector (x, y) in W, m; to be connected only without `goals`.
        reached: vector of a `GoalSequence`, all of whose goals are to be reached; only with `goals`.
        status: abstract, `PlannerStatus`; may be left unconnected.

    The simulator stops with status "reached termination" and the message "reached" or "unreachable".
    """

    def __init__(self, *, tolerance: float, period: float, goals: int = 0) -> None:
        """
        Args:
            tolerance: distance from the goal within which it counts as reached, m.
            period: of the checks, s.
            goals: number of those of a `GoalSequence`, which knows when they are reached; 0 for one goal.
        """
        super().__init__()
        self._tolerance = tolerance
        self._state = self.DeclareVectorInputPort("state", 5)
        self._reached = self.DeclareVectorInputPort("reached", goals) if goals else None
        self._goal = self.DeclareVectorInputPort("goal", 2)
        self._status = self.DeclareAbstractInputPort("status", Value(PlannerStatus.WAITING))
        self.DeclarePeriodicDiscreteUpdateEvent(checked_period(self, period=period), 0.0, self._check)

    def _check(self, context: Context, values: DiscreteValues) -> EventStatus:
        x, y, _, v, omega = self._state.Eval(context).tolist()
        if self._reached is None:
            arrived = math.dist((x, y), self._goal.Eval(context).tolist()) < self._tolerance
        else:
            arrived = bool(np.isfinite(self._reached.Eval(context)).all())
        if arrived:
            return EventStatus.ReachedTermination(self, "reached")
        stands = abs(v) < STANDING and abs(omega) < STANDING
        if stands and self._status.HasValue(context) and self._status.Eval(context) is PlannerStatus.UNREACHABLE:
            return EventStatus.ReachedTermination(self, "unreachable")
        return EventStatus.DidNothing()
