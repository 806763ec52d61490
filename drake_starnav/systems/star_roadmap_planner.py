"""The star roadmap as a Drake system."""

import dataclasses
import math
from collections.abc import Sequence
from dataclasses import field
from time import perf_counter

import numpy as np
from pydrake.common.value import Value
from pydrake.systems.framework import Context, LeafSystem

from drake_starnav.errors import StarnavError
from drake_starnav.geometry.se2 import transform_points
from drake_starnav.manoeuvres import plan_with_manoeuvres
from drake_starnav.planning import PlannerInput, PlannerParameters, PlannerState, plan_step
from drake_starnav.planning.guidance import Guidance
from drake_starnav.planning.monitoring import distance_to
from drake_starnav.planning.planner import PROGRESS_DISTANCE
from drake_starnav.planning.roadmap import NOTHING_CLOSED, ClosedPlaces
from drake_starnav.planning.state import ManoeuvreContext, PlannerStatus, PlanStep
from drake_starnav.robot import RobotParameters
from drake_starnav.robot.limits import compute_time_from_rest
from drake_starnav.safety import KeepOut
from drake_starnav.surroundings import Observation
from drake_starnav.surroundings.margins import Margins
from drake_starnav.surroundings.surroundings import Surroundings
from drake_starnav.systems.obstruction import SHORTEST_WAY, describe_nearest, describe_obstruction
from drake_starnav.systems.release import declare_value, declare_vector
from drake_starnav.systems.scan_state import ScanState
from drake_starnav.utils.snapshot import snapshot
from drake_starnav.utils.stopwatch import Stopwatch
from drake_starnav.utils.timing import EARLY

STANDSTILL, STAND = 4.0, 0.2
"""A robot stands still if it moves no farther than the second, in its cover radii, in the first, s."""
HALF_TURNS = 1.5
"""Or in the time for this many half turns, if that is longer."""
NO_WAY = "no way is left but through"


@snapshot
class _Plan:
    """The planner's state and what it follows from. Immutable.

    Attributes:
        state: the planner's.
        goal: with which it was planned last, W, m.
        time: of the last scan, s.
        stand: where the robot last moved to, or was given its goal, W, m.
        since: when, s.
    """

    state: PlannerState
    goal: np.ndarray = field(default_factory=lambda: np.full(2, np.nan))
    time: float = 0.0
    stand: np.ndarray = field(default_factory=lambda: np.full(2, np.nan))
    since: float = 0.0


class StarRoadmapPlanner(LeafSystem):
    """Grows a roadmap of star-shaped regions and chooses a short-term goal in it.

    ```
                        ┌────────────────────┐
    observation ───────>│                    ├──> guidance
    pose ──────────────>│                    ├──> short_term_goal
    goal ──────────────>│ StarRoadmapPlanner ├──> planner_state
    heading ───────────>│                    ├──> status
    surroundings ──────>│                    ├──> blocked_by
                        └────────────────────┘
    ```

    Ports:
        observation: abstract, `Observation` of the latest scan.
        pose: vector (x, y, yaw) of the robot in the world frame W, m and rad.
        goal: vector (x, y) in W, m.
        heading: vector of size 1, yaw in W to which the guidance turns the robot, on the spot if it can, rad; NaN, or
            not connected: it leads to the goal.
        surroundings: abstract, `Surroundings` in W, for manoeuvres of a robot that is no disc, and to say what
            blocks a robot; need not be connected.
        guidance: abstract, `Guidance` for the controller.
        short_term_goal: vector (x, y) in W, m; the robot's own position while there is none.
        planner_state: abstract, `PlannerState`: the roadmap and what the planner is about to do.
        status: abstract, `PlannerStatus`; BLOCKED while a robot that has not given up stands, as `blocked_by` says.
        blocked_by: abstract, `str`: why the robot has stood still for STANDSTILL seconds or HALF_TURNS half turns away
            from its goal, or which closed area left no way; empty while it moves.

    Discrete update: x[n+1] = f(x[n], u[n]) with each scan n, where x is the planner's state, u the observation of the
    scan and the goal, and f the pure function `step`. The state is abstract, an immutable snapshot; Drake's event for
    abstract state is the unrestricted update, with discrete-time semantics. Outputs are functions of f(x, u): they show
    the latest scan at the instant at which it comes, and the state follows before the next; see `ScanState`. A new
    goal is planned for at once, even after having given up. A goal that is not finite raises a `StarnavError`.
    """

    def __init__(
        self,
        robot: RobotParameters,
        planner: PlannerParameters,
        margins: Margins,
        *,
        goal_tolerance: float = 0.0,
        step: PlanStep | None = None,
        keep_outs: Sequence[KeepOut] = (),
        stopwatch: Stopwatch | None = None,
    ) -> None:
        """
        Args:
            goal_tolerance: a robot this near to the goal has reached it, m.
            step: one update as a pure function; None: `plan_step`, with manoeuvres of a robot that is no disc.
            keep_outs: that the robot must stay out of, though nothing is to be seen there.
            stopwatch: notes `plan` times, of updates in which the roadmap was searched, if given.
        """
        super().__init__()
        time_to_progress = compute_time_from_rest(
            PROGRESS_DISTANCE * robot.shape.cover_radius, robot.max_speed, robot.max_acceleration
        )
        planner = dataclasses.replace(planner, progress_timeout=max(planner.progress_timeout, 1.5 * time_to_progress))
        self._planner, self._goal_tolerance = planner, goal_tolerance
        self._step = step or (plan_step if robot.shape.is_disc else plan_with_manoeuvres)
        self._robot, self._margins = robot, margins
        self._stopwatch = stopwatch or Stopwatch()
        self._observation = self.DeclareAbstractInputPort("observation", Value(Observation.none()))
        self._pose = self.DeclareVectorInputPort("pose", 3)
        self._goal = self.DeclareVectorInputPort("goal", 2)
        self._heading = self.DeclareVectorInputPort("heading", 1)
        self._surroundings = self.DeclareAbstractInputPort("surroundings", Value(Surroundings.unknown()))
        walls = self._place_keep_outs(keep_outs)
        initial = PlannerState.initial(planner, robot.shape.cover_radius, robot.radius, walls)
        inputs = self._observation, self._goal, self._heading
        self._plans = ScanState(self, _Plan(initial), self._step_state, inputs, stamp=self._stamp)
        own, depends = StarRoadmapPlanner, {self._plans.ticket}
        heading_depends, pose_depends = depends | {self._heading.ticket()}, depends | {self._pose.ticket()}
        declare_value(self, "guidance", Guidance.none(), own._guidance, heading_depends)
        declare_vector(self, "short_term_goal", 2, own._short_term_goal, pose_depends)
        declare_value(self, "planner_state", initial, own._state, depends)
        depends = pose_depends | {self._surroundings.ticket(), self.time_ticket()}
        declare_value(self, "status", initial.status, own._status, depends)
        declare_value(self, "blocked_by", "", own._blocked_by, depends)

    def _stamp(self, context: Context) -> float:
        return self._observation.Eval(context).time

    def _step_state(self, context: Context, previous_plan: _Plan) -> _Plan:
        observation, goal = self._observation.Eval(context), self._goal.Eval(context)
        time, has_new_goal = observation.time, goal.tolist() != previous_plan.goal.tolist()
        if time == previous_plan.time and not has_new_goal:
            return previous_plan
        state, interval = previous_plan.state, time - previous_plan.time
        if has_new_goal:
            if not np.isfinite(goal).all():
                raise StarnavError(f"the planner's goal is {goal.tolist()}; allowed: finite x and y, m")
            state = state.with_new_goal()
        planner_input = PlannerInput(
            observation,
            observation.pose[:2],
            goal.copy(),
            time,
            self._planner,
            self._margins,
            self._robot.shape.cover_radius,
            self._goal_tolerance,
            interval,
            self._manoeuvre_context(context),
            self._wanted_heading(context),
        )
        begin = perf_counter()
        next_state = self._step(state, planner_input)
        if next_state.progress.plan_count > state.progress.plan_count:
            self._stopwatch.note("plan", begin)
        standing_place, standing_since = previous_plan.stand, previous_plan.since
        if (
            has_new_goal
            or not distance_to(planner_input.position, standing_place) <= STAND * planner_input.cover_radius
        ):
            standing_place, standing_since = planner_input.position.copy(), time
        return _Plan(next_state, planner_input.goal, time, standing_place, standing_since)

    def _place_keep_outs(self, keep_outs: Sequence[KeepOut]) -> ClosedPlaces:
        """Return keep-outs as points, so far outside that regions with the least margin keep each one's own margin."""
        walls = NOTHING_CLOSED
        for each in keep_outs:
            distance, name = each.margin - self._margins.least, each.name or "a KeepOut"
            walls = walls.add_keep_out(each.corners, distance, name, self._robot.shape.cover_radius)
        return walls

    def _manoeuvre_context(self, context: Context) -> ManoeuvreContext | None:
        """Return the robot, unless it is a disc or `surroundings` is not connected."""
        robot = self._robot
        if robot.shape.is_disc or not self._surroundings.HasValue(context):
            return None
        surroundings = self._surroundings.Eval(context)
        return ManoeuvreContext(
            robot.shape, surroundings, self._margins.safety, robot.motion_primitives, robot.limits, robot.drive
        )

    def _state(self, context: Context) -> PlannerState:
        return self._plans.Eval(context).state

    def _guidance(self, context: Context) -> Guidance:
        guidance, heading = self._state(context).guidance, self._wanted_heading(context)
        if not math.isfinite(heading) or len(guidance.poses):
            return guidance
        if not self._robot.drive.turns_on_the_spot:
            return Guidance.none()
        return dataclasses.replace(guidance, poses=np.array([(*self._goal.Eval(context), heading, 0.0)]))

    def _wanted_heading(self, context: Context) -> float:
        """Return the heading to which the robot is to turn at its goal, rad; NaN: none."""
        return float(self._heading.Eval(context)[0]) if self._heading.HasValue(context) else math.nan

    def _short_term_goal(self, context: Context) -> np.ndarray:
        path = self._state(context).guidance.path
        return path[0] if len(path) else self._pose.Eval(context)[:2]

    def _status(self, context: Context) -> PlannerStatus:
        status = self._state(context).status
        is_blocked = status is not PlannerStatus.UNREACHABLE and self._blocked_by(context)
        return PlannerStatus.BLOCKED if is_blocked else status

    def _blocked_by(self, context: Context) -> str:
        plan, time = self._plans.Eval(context), context.get_time()
        dead_end = plan.state.progress.dead_end
        if plan.state.status is PlannerStatus.UNREACHABLE:
            return f"{NO_WAY} {dead_end.cause}" if dead_end is not None and dead_end.cause else ""
        patience = max(STANDSTILL, HALF_TURNS * math.pi / self._robot.max_yaw_rate) - EARLY
        if time - plan.since < patience:
            return ""
        if time - plan.time > patience:
            return f"blind: no scan that measures anything has arrived for {time - plan.time:.1f} s"
        position = self._pose.Eval(context)[:2]
        has_moved = distance_to(position, plan.stand) > STAND * self._robot.shape.cover_radius
        if has_moved or distance_to(position, self._goal.Eval(context)) <= self._goal_tolerance:
            return ""
        scan = self._observation.Eval(context).scan
        if plan.state.status is PlannerStatus.WAITING and dead_end is not None and scan.may_leave.any():
            where = describe_nearest(scan, scan.may_leave)
            return f"waits for an obstacle that may leave, {where}: no other way is left"
        return self._describe_obstruction(context, plan.state)

    def _describe_obstruction(self, context: Context, state: PlannerState) -> str:
        """Return why a robot stands that does not wait."""
        pose, shape, margin = self._pose.Eval(context), self._robot.shape, self._margins.least
        path, knows = state.guidance.path, self._surroundings.HasValue(context)
        if knows:
            to_x, to_y = (path[0] if len(path) else self._goal.Eval(context)) - pose[:2]
            bearing, scan = math.atan2(to_y, to_x) - float(pose[2]), self._observation.Eval(context).scan
            reason = describe_obstruction(self._surroundings.Eval(context), scan, bearing, shape, pose)
            if reason:
                return reason
        reach = shape.cover_radius + margin + SHORTEST_WAY * shape.cover_radius
        zone = state.roadmap.closures.find_cause_near(transform_points(pose, shape.cover), reach)
        if zone:
            return f"too near: {zone}, which the robot keeps out of"
        if not len(path):
            return f"no way is seen that keeps {margin:.3g} m beyond robot.radius"
        known_text = "the certificate knows" if knows else "is seen"
        return f"nothing that {known_text}: the robot does not follow its guidance"
