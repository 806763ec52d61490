"""What ends a trial, watches it, and logs it."""

import math
from collections.abc import Callable, Sequence

import numpy as np
from pydrake.common.value import Value
from pydrake.systems.analysis import Simulator
from pydrake.systems.framework import Context, DiagramBuilder, DiscreteValues, EventStatus, LeafSystem, TriggerType
from pydrake.systems.primitives import LogVectorOutput, VectorLogSink

from drake_starnav.geometry.footprint import Footprint, disc, find_top_speed
from drake_starnav.geometry.trajectory import STANDING
from drake_starnav.navigation import Navigation
from drake_starnav.planning import PlannerStatus
from drake_starnav.station.monitors import CollisionMonitor, check_drive
from drake_starnav.station.navigation_station import simulated
from drake_starnav.station.plant import evaluate_port
from drake_starnav.systems.connecting import connect_inputs
from drake_starnav.systems.goal_sequence import GoalSequence
from drake_starnav.utils.timing import check_period


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

    def __init__(self, *, tolerance: float, period: float, goals: int = 0, footprint: Footprint | None = None) -> None:
        """
        Args:
            tolerance: distance from the goal within which it counts as reached, m.
            period: of the checks, s.
            goals: number of those of a `GoalSequence`, which knows when they are reached; 0 for one goal.
            footprint: of the robot, which stands when no point of it moves; None: whether it turns does not matter.
        """
        super().__init__()
        self._tolerance, self._radius = tolerance, (footprint or disc(0.0)).radius
        self._state = self.DeclareVectorInputPort("state", 5)
        self._reached = self.DeclareVectorInputPort("reached", goals) if goals else None
        self._goal = self.DeclareVectorInputPort("goal", 2)
        self._status = self.DeclareAbstractInputPort("status", Value(PlannerStatus.WAITING))
        self.DeclarePeriodicDiscreteUpdateEvent(check_period(self, period=period), 0.0, self._check)

    @staticmethod
    def AddToBuilder(
        builder: DiagramBuilder, navigation: Navigation, *, tolerance: float | None = None, period: float | None = None
    ) -> "ArrivalMonitor":
        """Add a monitor named `arrival_monitor` of a navigation in the builder, and connect it.

        `tolerance`, m, and `period`, s, are those of the construction; None for the goal tolerance of the scenario, and
        for a check with each command.
        """
        scenario, sources = navigation.station.scenario, {"state": navigation.localization("state")}
        if isinstance(navigation.goal, GoalSequence):
            sources["reached"] = navigation.goal.GetOutputPort("reached")
        else:
            sources["goal"] = navigation.goal_position
        if (status := navigation.planned("status", PlannerStatus)) is not None:
            sources["status"] = status
        monitor = ArrivalMonitor(
            tolerance=scenario.simulation.goal_tolerance if tolerance is None else tolerance,
            period=1.0 / scenario.controller.rate if period is None else period,
            goals=sources["reached"].size() if "reached" in sources else 0,
            footprint=scenario.robot.shape,
        )
        builder.AddNamedSystem("arrival_monitor", monitor)
        connect_inputs(builder, monitor, sources, "arrival_monitor")
        return monitor

    def _check(self, context: Context, values: DiscreteValues) -> EventStatus:
        x, y, _, v, omega = self._state.Eval(context).tolist()
        if self._reached is None:
            has_arrived = math.dist((x, y), self._goal.Eval(context).tolist()) < self._tolerance
        else:
            has_arrived = bool(np.isfinite(self._reached.Eval(context)).all())
        if has_arrived:
            return EventStatus.ReachedTermination(self, "reached")
        is_standing = find_top_speed(v, omega, self._radius) < 0.5 * STANDING
        if is_standing and self._status.HasValue(context) and self._status.Eval(context) is PlannerStatus.UNREACHABLE:
            return EventStatus.ReachedTermination(self, "unreachable")
        return EventStatus.DidNothing()


def add_monitors(builder: DiagramBuilder, navigation: Navigation) -> list[VectorLogSink]:
    """Add what ends a trial, and the logs of the robot's states and of its commands, which cause no steps."""
    CollisionMonitor.AddToBuilder(builder, simulated(navigation.station))
    ArrivalMonitor.AddToBuilder(builder, navigation)
    state = navigation.station.GetOutputPort("cheat.robot_state")
    return [LogVectorOutput(port, builder, {TriggerType.kPerStep}) for port in (state, navigation.twist_command)]


def make_watcher(
    simulator: Simulator, navigation: Navigation, logs: Sequence[VectorLogSink], reports: list[tuple[float, str]]
) -> Callable[[float, float], None]:
    """Report a robot that does not follow its commands, and, in `reports`, one that stands still and why."""

    def watch(current_time: float, limit: float) -> None:
        context = simulator.get_context()
        states, commands = (log.FindLog(context) for log in logs)
        check_drive(simulated(navigation.station), states.sample_times(), states.data().T, commands.data().T)
        reason = read_blocking_reason(navigation, context)
        if reason != (reports[-1][1] if reports else ""):
            reports.append((current_time, reason))

    return watch


def read_blocking_reason(navigation: Navigation, context: Context) -> str:
    """What its planner, if it says so, calls the reason why a robot stands, or has no way; empty without one."""
    port = navigation.planned("blocked_by")
    return "" if port is None else evaluate_port(port, context)


def read_arrival_times(navigation: Navigation, context: Context) -> np.ndarray:
    """When a robot reached each of several goals, shape (n,), s; NaN for those that it did not; (0,) of one goal."""
    if not isinstance(navigation.goal, GoalSequence):
        return np.zeros(0)
    return evaluate_port(navigation.goal.GetOutputPort("reached"), context)
