"""The star roadmap as a Drake system."""

import numpy as np
from pydrake.common.value import AbstractValue, Value
from pydrake.systems.framework import Context, EventStatus, LeafSystem, State

from drake_starnav.errors import StarnavError
from drake_starnav.planning import PlannerInput, PlannerParameters, PlannerState, PlanStep, plan_step
from drake_starnav.planning.guidance import Guidance
from drake_starnav.regions import Observation
from drake_starnav.robot import RobotParameters
from drake_starnav.systems.release import weakly
from drake_starnav.utils.stopwatch import Stopwatch
from drake_starnav.utils.timing import EARLY, begins_run, checked_period


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

    One periodic update, which does nothing while nothing changes. The roadmap is an immutable snapshot in abstract
    state; the short-term goal, and goal and time of the last change, are discrete state. When the goal has moved the
    next update searches the roadmap anew, even after having given up. A goal that is not finite raises a
    `StarnavError`.
    """

    def __init__(
        self,
        robot: RobotParameters,
        planner: PlannerParameters,
        *,
        goal_tolerance: float = 0.0,
        offset: float,
        step: PlanStep = plan_step,
        stopwatch: Stopwatch | None = None,
    ) -> None:
        """
        Args:
            robot: its radius.
            planner: parameters.
            goal_tolerance: a robot this near to the goal has reached it, m.
            offset: of the first update, s; at least one step of the plant after the lidar's.
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
        self._plan = self.DeclareAbstractState(Value(initial))
        goal_state = self.DeclareDiscreteState(2)
        self._changed = self.DeclareDiscreteState(np.full(3, np.nan))  # the goal of the last change, and its time
        depends = {self.abstract_state_ticket(self._plan)}
        self.DeclareAbstractOutputPort("guidance", lambda: Value(Guidance.none()), weakly(self._calc_guidance), depends)
        self.DeclareStateOutputPort("short_term_goal", goal_state)
        self.DeclareAbstractOutputPort("roadmap", lambda: Value(initial), weakly(self._calc_roadmap), depends)
        self.DeclareAbstractOutputPort("status", lambda: Value(initial.status), weakly(self._calc_status), depends)
        self.DeclareInitializationUnrestrictedUpdateEvent(self._initialize)
        period = checked_period(self, rate=planner.rate, offset=offset)
        self.DeclarePeriodicUnrestrictedUpdateEvent(period, offset, self._update)

    def _initialize(self, context: Context, state: State) -> EventStatus:
        if not begins_run(context.get_time(), context.get_discrete_state(self._changed)[2]):
            return EventStatus.DidNothing()
        pose = self._pose.Eval(context)
        state.get_mutable_discrete_state(0).set_value(pose[:2])
        state.get_mutable_discrete_state(self._changed).set_value((np.nan, np.nan, context.get_time()))
        return EventStatus.Succeeded()

    def _update(self, context: Context, state: State) -> EventStatus:
        seen, time = self._star.Eval(context), context.get_time()
        if seen.region is None or seen.scan.time > time + EARLY:  # of the run before time was set back
            return EventStatus.DidNothing()
        position = self._pose.Eval(context)[:2].copy()
        goal = self._goal.Eval(context).copy()
        before = context.get_abstract_state(self._plan).get_value()
        if time < before.progress_time:  # time was set back: another run begins
            before = PlannerState.initial(self._planner, self._robot.radius)
        moved = goal.tolist() != context.get_discrete_state(self._changed).value()[:2].tolist()
        if moved:
            if not np.isfinite(goal).all():
                raise StarnavError(f"the planner's goal is {goal.tolist()}; allowed: finite x and y, m")
            before = before.with_new_goal()
        with self._stopwatch.measure("update"):
            now = PlannerInput(seen, position, goal, time, self._planner, self._robot.radius, self._goal_tolerance)
            after = self._step(before, now)
        if after.plans > before.plans:
            self._stopwatch.seconds["plan"].append(self._stopwatch.seconds["update"][-1])
        if after is before and len(after.path):
            return EventStatus.DidNothing()
        state.get_mutable_abstract_state(self._plan).set_value(after)
        state.get_mutable_discrete_state(self._changed).set_value((*goal, time))
        path = after.guidance.path
        state.get_mutable_discrete_state(0).set_value(path[0] if len(path) else position)
        return EventStatus.Succeeded()

    def _calc_guidance(self, context: Context, output: AbstractValue) -> None:
        output.set_value(context.get_abstract_state(self._plan).get_value().guidance)

    def _calc_roadmap(self, context: Context, output: AbstractValue) -> None:
        output.set_value(context.get_abstract_state(self._plan).get_value())

    def _calc_status(self, context: Context, output: AbstractValue) -> None:
        output.set_value(context.get_abstract_state(self._plan).get_value().status)
