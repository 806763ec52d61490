"""The star roadmap as a Drake system."""

from dataclasses import field

import numpy as np
from pydrake.common.value import AbstractValue, Value
from pydrake.systems.framework import BasicVector, Context, LeafSystem

from drake_starnav.errors import StarnavError
from drake_starnav.lidar.sensor_model import LidarParameters
from drake_starnav.planning import PlannerInput, PlannerParameters, PlannerState, PlanStep, plan_step
from drake_starnav.planning.guidance import Guidance
from drake_starnav.regions import Observation
from drake_starnav.robot import RobotParameters
from drake_starnav.systems.release import weakly
from drake_starnav.systems.scan_state import ScanState
from drake_starnav.utils.snapshot import snapshot
from drake_starnav.utils.stopwatch import Stopwatch


@snapshot
class _Plan:
    """The planner's state, and what it was planned with last: the goal, W, m, and the time of the scan, s."""

    state: PlannerState
    goal: np.ndarray = field(default_factory=lambda: np.full(2, np.nan))
    time: float = 0.0


class StarRoadmapPlanner(LeafSystem):
    """Grows a roadmap of star-shaped regions and chooses a short-term goal in it.

    ```
             ┌────────────────────┐
    star ───>│                    ├──> guidance
    pose ───>│ StarRoadmapPlanner ├──> short_term_goal
    goal ───>│                    ├──> roadmap
             │                    ├──> status
             └────────────────────┘
    ```

    Ports:
        star: abstract, `Observation` of the latest scan.
        pose: vector (x, y, yaw) of the robot in the world frame W, m and rad.
        goal: vector (x, y) in W, m.
        guidance: abstract, `Guidance` for the controller.
        short_term_goal: vector (x, y) in W, m; the robot's own position while there is none.
        roadmap: abstract, `PlannerState`: the roadmap and what the planner is about to do.
        status: abstract, `PlannerStatus`.

    Each scan, and each new goal, is planned with at once, see `ScanState`; what is known is an immutable snapshot. When
    the goal has moved the roadmap is searched anew, even after having given up. A goal that is not finite raises a
    `StarnavError`.
    """

    def __init__(
        self,
        robot: RobotParameters,
        planner: PlannerParameters,
        lidar: LidarParameters,
        *,
        goal_tolerance: float = 0.0,
        step: PlanStep = plan_step,
        stopwatch: Stopwatch | None = None,
    ) -> None:
        """
        Args:
            robot: its radius.
            planner: parameters.
            lidar: its rate.
            goal_tolerance: a robot this near to the goal has reached it, m.
            step: one update as a pure function.
            stopwatch: where to note `plan` times (updates in which the roadmap was searched), if anywhere.
        """
        super().__init__()
        self._robot, self._planner, self._goal_tolerance, self._step = robot, planner, goal_tolerance, step
        self._stopwatch = stopwatch or Stopwatch()
        self._star = self.DeclareAbstractInputPort("star", Value(Observation.none()))
        self._pose = self.DeclareVectorInputPort("pose", 3)
        self._goal = self.DeclareVectorInputPort("goal", 2)
        initial = PlannerState.initial(planner, robot.radius)
        inputs = self._star, self._goal
        self._plans = ScanState(self, _Plan(initial), self._after, inputs, rate=lidar.rate)
        depends = {self._plans.ticket}
        self.DeclareAbstractOutputPort("guidance", lambda: Value(Guidance.none()), weakly(self._calc_guidance), depends)
        self.DeclareVectorOutputPort(
            "short_term_goal", 2, weakly(self._calc_short_term_goal), depends | {self._pose.ticket()}
        )
        self.DeclareAbstractOutputPort("roadmap", lambda: Value(initial), weakly(self._calc_roadmap), depends)
        self.DeclareAbstractOutputPort("status", lambda: Value(initial.status), weakly(self._calc_status), depends)

    def _after(self, context: Context, before: _Plan) -> _Plan:
        seen, goal = self._star.Eval(context), self._goal.Eval(context)
        if seen.region is None:
            return before
        time = seen.scan.time
        moved = goal.tolist() != before.goal.tolist()
        if time == before.time and not moved:
            return before
        state, interval = before.state, time - before.time
        if interval < 0.0:  # time was set back: another run begins
            state, interval, moved = PlannerState.initial(self._planner, self._robot.radius), 0.0, True
        if moved:
            if not np.isfinite(goal).all():
                raise StarnavError(f"the planner's goal is {goal.tolist()}; allowed: finite x and y, m")
            state = state.with_new_goal()
        now = PlannerInput(
            seen, seen.pose[:2], goal.copy(), time, self._planner, self._robot.radius, self._goal_tolerance, interval
        )
        with self._stopwatch.measure("update"):
            after = self._step(state, now)
        if after.plans > state.plans:
            self._stopwatch.seconds["plan"].append(self._stopwatch.seconds["update"][-1])
        return _Plan(after, now.goal, time)

    def _state(self, context: Context) -> PlannerState:
        return self._plans.Eval(context).state

    def _calc_guidance(self, context: Context, output: AbstractValue) -> None:
        output.set_value(self._state(context).guidance)

    def _calc_short_term_goal(self, context: Context, output: BasicVector) -> None:
        path = self._state(context).guidance.path
        output.SetFromVector(path[0] if len(path) else self._pose.Eval(context)[:2])

    def _calc_roadmap(self, context: Context, output: AbstractValue) -> None:
        output.set_value(self._state(context))

    def _calc_status(self, context: Context, output: AbstractValue) -> None:
        output.set_value(self._state(context).status)
