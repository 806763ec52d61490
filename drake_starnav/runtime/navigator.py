"""The navigation of a robot whose loop is not ours: scans, odometry and goal in, a twist out."""

import dataclasses
import math
from collections.abc import Iterable, Sequence
from typing import Any, NamedTuple

import numpy as np
from pydrake.common.value import Value
from pydrake.systems.analysis import InitializeParams, Simulator
from pydrake.systems.framework import Context, DiagramBuilder, OutputPort

from drake_starnav.errors import StarnavError, check_kind
from drake_starnav.lidar.faulty_beams import FaultyBeams
from drake_starnav.lidar.mounts import Mount
from drake_starnav.localization.odometry_check import OdometryCheck
from drake_starnav.navigation import Parts, add_navigation
from drake_starnav.navigation.parts import AS_DECLARED
from drake_starnav.navigation.robot import robot_mounts
from drake_starnav.planning import PlannerStatus
from drake_starnav.robot.motion import Actuation
from drake_starnav.runtime import intake as take
from drake_starnav.runtime.execution import (
    REST_TIME,
    STANDING_SPEED,
    CommandedVelocity,
    Execution,
    acknowledge_withdrawal,
    add_command,
    add_scan,
    is_carried,
    judge_execution,
)
from drake_starnav.runtime.intake import Declared, Intake, PosedScan
from drake_starnav.runtime.station import AskedGoal, DriverStation, make_empty_scan
from drake_starnav.safety.shield import make_braking_twist, ramp_twist
from drake_starnav.scenario.schema import Scenario
from drake_starnav.surroundings.margins import SCAN_PATIENCE
from drake_starnav.systems.connecting import find_output_port
from drake_starnav.systems.goal_sequence import Arrival, TurningRoom
from drake_starnav.systems.star_perception import lidar_names
from drake_starnav.systems.twist_shield import Unshielded

GAP = 0.1
"""After this long without a step or odometry, s, the next twist is ramped from the measured one."""
LEAST_ADVANCE = 0.02
"""The clock stands if it advances by less than this share of a period from call to call, for GAP."""
RESET_ASKED = "a reset is asked"
"""Why a navigator forgets what it has seen, unless a beam was found to err."""


class Command(NamedTuple):
    """What a robot is to do until the next command.

    Attributes:
        twist: finite, within the robot's limits; as many numbers as the base has, see `robot.base`.
        certified: whether the certificates accept the motion; otherwise it brakes.
        status: driving or reached; or, for the reason in `why`, unreachable, blocked, braking or standing.
        why: the reason; empty while it drives or has reached its goal.
    """

    twist: np.ndarray
    certified: bool
    status: str
    why: str


class Navigator:
    """Drives a robot by its scans and its odometry; nothing of it knows a plant or a world.

    The diagram is that of `add_navigation`, about a `DriverStation`. Its updates keep their raster, whatever the jitter
    of the calls: a call within a period repeats the last command, but not longer than GAP if the clock stands; a call
    after more than GAP begins at the measured twist. A goal that changes resets nothing of what is supervised. The
    diagram exports the inputs of station and goal, and the outputs `twist_command` and, if it has them, `planner.*`:
    add it to a builder of your own, and do not call `step` then.

    Attributes:
        scenario: without a world.
        mounts: of the lidars.
        navigation: the systems.
        diagram: of them.
        intake: what came in and is not used up, and what was dropped.
        actuation: what a command does to the robot; it holds the period of the commands.
    """

    def __init__(
        self,
        scenario: Scenario,
        parts: Parts = AS_DECLARED,
        *,
        mounts: Sequence[Mount] | None = None,
        warm: bool = True,
    ) -> None:
        """
        Args:
            scenario: of which the robot, its lidars, faults and methods count; not its world, nor its goals.
            parts: of your own; no station and no goal.
            mounts: of the lidars; None: as the robot's model has them.
            warm: whether everything is compiled before the first step, by a drive among made-up obstacles.

        Raises:
            StarnavError: as of `add_navigation`, or parts hold a station or a goal.
        """
        check_kind(scenario, Scenario, "scenario", "as from load_scenario")
        if parts.station is not None or parts.goal is not None:
            raise StarnavError("parts has a station or a goal; allowed: none, as they come in by step")
        self.scenario = dataclasses.replace(scenario, world=None, goals=())
        mounts = robot_mounts(scenario) if mounts is None else tuple(mounts)
        builder = DiagramBuilder()
        self._station = builder.AddNamedSystem("station", DriverStation(self.scenario, mounts))
        self._goal_system = AskedGoal()
        parts = dataclasses.replace(parts, station=self._station, goal=self._goal_system)
        self.navigation = add_navigation(builder, self.scenario, parts)
        self._names = lidar_names("scan", len(mounts))
        for name in (*self._names, "scan_pose", "state"):
            builder.ExportInput(self._station.GetInputPort(name), name)
        for name in ("goal", "heading"):
            builder.ExportInput(self._goal_system.GetInputPort(name), name)
        shield, twist_size = self.navigation.shield, self.navigation.twist_size
        self._twist_port = find_output_port(shield, "twist_command", twist_size, "shield")
        builder.ExportOutput(self._twist_port, "twist_command")
        for name in ("guidance", "planner_state", "status", "blocked_by"):
            if (port := self.navigation.planned(name)) is not None:
                builder.ExportOutput(port, f"planner.{name}")
        self.diagram = builder.Build()
        self.diagram.set_name(scenario.name)
        robot, controller = scenario.robot, scenario.controller
        self.mounts = tuple(mounts)
        self._declared = Declared.of(self.scenario, self.mounts)
        self.actuation = Actuation(robot.limits, robot.shape, 1.0 / controller.rate, controller.delay, robot.drive)
        self._expiry = scenario.lidar.delay + SCAN_PATIENCE / min(lidar.rate for lidar in scenario.all_lidars)
        self._simulator = Simulator(self.diagram)
        self.reset()
        if warm:
            from drake_starnav.runtime.warm import warm_up  # late: it drives a navigator

            warm_up(self)
            self.reset()

    def reset(self) -> None:
        """Forget everything, as if nothing had come in yet."""
        size = len(self.actuation.base.components)
        self.intake = Intake.empty(len(self._declared.lidars))
        self._now, self._origin, self._tick = math.nan, 0.0, 0
        self._latest, self._stalled = -math.inf, 0
        self._dropped_goal, self._carried, self._forget_reason = "", -math.inf, ""
        self._beams = [FaultyBeams.none()] * len(self._names)
        self._command = Command(np.zeros(size), False, "standing", "nothing has come in")
        self._execution = Execution()
        self._goal: tuple[float, ...] | None = None
        self._reached, self._turning, self._blind, self._no_goal = False, False, True, "no goal"
        self._begin()

    def _begin(self) -> None:
        """Another run of the diagram, in which nothing has been seen."""
        self._simulator.reset_context(self.diagram.CreateDefaultContext())
        for name, lidar in zip(self._names, self._declared.lidars, strict=True):
            self._fix(name, Value(make_empty_scan(lidar)))
        for name, size in (("scan_pose", 3), ("state", 5), ("goal", 2)):
            self._fix(name, np.zeros(size))
        self._fix("heading", np.array([math.nan]))
        self._seen, self._forgotten = [-math.inf] * len(self._names), self.intake.jump_time
        self._broken, self._begun, self._fixed, self._forget_reason = True, False, False, ""
        self._execution = dataclasses.replace(self._execution, check=OdometryCheck())

    def step(
        self,
        now: float,
        scans: Iterable[Any] = (),
        odometry: Iterable[Any] = (),
        goal: Sequence[float] | None = None,
        reset: bool = False,
    ) -> Command:
        """The command for the next period; to be called once a control period.

        It does not raise: what is wrong brakes the robot, lets it stand, and is said in `why`.

        Args:
            now: s, on the clock of all stamps.
            scans: that came since the last call, `LaserScan`s; of a robot with several lidars pairs of the lidar's
                number, from 0, and the scan.
            odometry: that came since then, `Odometry`.
            goal: (x, y) or (x, y, yaw) in the odometry's frame, m and rad; None: to stand. What
                `why` says to last until the goal is given anew ends when none is given while the robot stands. After a
                jump of the odometry the goal is dropped until none, or one of another place, is given.
            reset: whether to brake, forget what was seen and what went wrong, and then to try the goal again.
        """
        try:
            command = self._try_step(now, scans, odometry, goal, reset)
        except Exception as error:  # whatever it is: a robot that moves must be braked
            self._broken = True
            command = self._make_braking_command(f"the step failed: {type(error).__name__}: {error}")
        if not np.isfinite(command.twist).all():
            command = self._make_braking_command("the twist is not finite")
        self._drive(command)
        return command

    def brake(self, why: str) -> Command:
        """A command of the ramp to zero, whatever came in; `why` is what it will say."""
        command = self._make_braking_command(why)
        self._drive(command)
        return command

    def _try_step(self, time: float, scans: Iterable[Any], odometry: Iterable[Any], goal: Any, reset: bool) -> Command:
        if not math.isfinite(time):
            return self._make_braking_command(f"now is {time}; allowed: finite, s")
        self._note_clock(time)
        elapsed_time = time - self._now
        self._take_inputs(time, scans, odometry, reset)
        if not self._begin_period(time, elapsed_time):
            stands = self._stalled > max(round(GAP / self.actuation.hold), 2)
            return self._make_braking_command(f"the clock stands at {time:.3f} s") if stands else self._command
        goal_fault = self._take_goal(goal)
        state = take.estimate_state(self.intake.rows, time)
        self._note_gap(state, elapsed_time)
        reason = self._find_reason_to_brake(time, state, goal_fault)
        if state is None:
            return self._make_braking_command(reason)
        if (self.intake.jump_time > self._forgotten or self._forget_reason) and not self._command.twist.any():
            self.intake = take.reset_beliefs(self.intake)
            self._begin()  # what was seen before lies elsewhere now
        self._feed(time, state)
        command = self._advance_diagram()
        if reason := reason or self._describe_missing_scan(time):
            return self._make_braking_command(reason)
        return self._make_braking_command("")._replace(status="reached") if self._reached else command

    def _note_clock(self, time: float) -> None:
        """Note whether the clock stands, and begin anew where it began again."""
        has_advanced = time > self._latest + LEAST_ADVANCE * self.actuation.hold
        self._stalled = 0 if has_advanced else self._stalled + 1
        self._latest = max(time, self._latest)
        if time < self._now - take.CLOCK:
            self.intake, self._now, self._latest = take.restart_clock(self.intake, time), math.nan, time
            self._begin()

    def _take_inputs(self, time: float, scans: Iterable[Any], odometry: Iterable[Any], reset: bool) -> None:
        """Take what came in; a reset forgets what went wrong, and a jump of the odometry the goal."""
        last_jump = self.intake.jump_time
        self.intake = take.take_messages(self.intake, time, scans, odometry, self._declared)
        if reset:
            self._execution, self._dropped_goal, self._forget_reason = Execution(), "", RESET_ASKED
        if self.intake.jump_time > last_jump and self._goal is not None:
            self._dropped_goal = "the goal is dropped, as the odometry began anew; until another one is given"

    def _begin_period(self, time: float, elapsed_time: float) -> bool:
        """Begin the period of a time, and return whether it is another one than the last."""
        period = self.actuation.hold
        if math.isnan(elapsed_time):
            self._origin = time - (self._tick + 0.5) * period
        due_tick = math.floor((time - self._origin) / period) + 1
        if due_tick <= self._tick:
            return False
        self._broken |= due_tick > self._tick + 1 and not math.isnan(elapsed_time)
        self._now, self._tick = time, due_tick
        return True

    def _note_gap(self, state: np.ndarray | None, elapsed_time: float) -> None:
        """Go on from the measured twist where it is not known what was done since the last step."""
        if state is not None and (self._blind or not elapsed_time < GAP):
            self._execution = dataclasses.replace(self._execution, velocities=())
            self._command = self._command._replace(twist=self._measure_twist())
        self._blind = state is None

    def _take_goal(self, asked_goal: Any) -> str:
        """Take what is asked: another goal of the same place, and a stream of such, resets nothing.

        Returns what is wrong with it, as with none that can be read; empty: nothing.
        """
        try:
            goal = take.read_goal(asked_goal)
        except StarnavError as error:
            self._goal = None
            return str(error)
        if goal == self._goal:
            return ""
        previous_goal, self._goal, self._no_goal = self._goal, goal, "the goal is withdrawn"
        self._reached, self._turning = False, False
        if goal is None and not self._command.twist.any():
            if self._execution.is_lost:
                self._forget_reason = self._forget_reason or RESET_ASKED
            self._execution = acknowledge_withdrawal(self._execution)
        if (
            goal is None
            or previous_goal is None
            or math.dist(goal[:2], previous_goal[:2]) > self.scenario.simulation.goal_tolerance
        ):
            self._dropped_goal = ""
        return ""

    def _describe_missing_scan(self, time: float) -> str:
        """What the lidars lack to drive by; empty: nothing."""
        oldest_lidar = int(np.argmin(self._seen))
        scan_age, time_since_scan = time - self._seen[oldest_lidar], time - self.intake.arrival_times[oldest_lidar]
        if scan_age <= self._expiry:
            return ""
        lidar_text = f" of lidar {oldest_lidar}" if len(self._seen) > 1 else ""
        if self.intake.bad_scans[oldest_lidar]:
            return self.intake.bad_scans[oldest_lidar] + (f" ({lidar_text.strip()})" if lidar_text else "")
        if math.isinf(time_since_scan):
            return f"no scan{lidar_text} yet"
        if time_since_scan <= self._expiry and math.isinf(scan_age):
            return f"the next scan{lidar_text} is awaited, as what was seen is forgotten"
        if time_since_scan <= self._expiry:
            return f"scans{lidar_text} are late: the newest is {scan_age:.2f} s old; allowed: {self._expiry:.2f} s"
        return f"no scan{lidar_text} for {time_since_scan:.2f} s"

    def _find_reason_to_brake(self, time: float, state: np.ndarray | None, wrong: str) -> str:
        """The first reason for which the robot must not drive; empty: none."""
        rows = self.intake.rows
        if state is None:
            stale_text = f"no odometry for {time - rows[-1].time:.2f} s" if rows else "no odometry"
            return self.intake.bad_odometry or stale_text
        if self.intake.jump_time > self._forgotten:
            return " and ".join(filter(None, (self.intake.bad_odometry or "the pose has jumped", self._dropped_goal)))
        if self._forget_reason:
            return self._forget_reason
        if is_carried(self._execution):
            self._carried = time
            self._execution = dataclasses.replace(self._execution, scans=self._execution.scans[-1:])
            self._begin()
        was_lost = self._execution.is_lost
        self._execution = judge_execution(self._execution, time, rows, self.scenario)
        if was_lost and not self._execution.is_lost:  # and the robot stands
            self._begin()
        if why := self._execution.fault_text or wrong or self._dropped_goal:
            return why
        if time < self._carried + REST_TIME:
            return "scans and odometry disagree: the robot was carried, or what it sees has moved; the map is made anew"
        return self._no_goal if self._goal is None else ""

    def _feed(self, time: float, state: np.ndarray) -> None:
        """Put goal and state into the diagram, and let it process all scans that have a pose, one after the other."""
        context = self._simulator.get_mutable_context()
        if self._broken:
            context.SetTime(self._tick * self.actuation.hold)
            self._set_twist(context, self._command.twist)
            self._simulator.Initialize(InitializeParams(suppress_initialization_events=self._begun))
            self._broken, self._begun = False, True
        self._fix("state", state)
        self._feed_goal(state)
        while True:
            self.intake, posed_scan = take.find_next_scan(self.intake, time)
            if posed_scan is None:
                break
            self._process(context, posed_scan)

    def _feed_goal(self, state: np.ndarray) -> None:
        """Put the goal and the heading to turn to into the diagram, and note whether the goal is reached."""
        goal, tolerance = self._goal or tuple(state[:2]), self.scenario.simulation.goal_tolerance
        room = TurningRoom.of(self.scenario.robot.drive, self.scenario.robot.shape, tolerance)
        arrival = Arrival.at(goal, state, room, self._turning)
        self._reached = self._reached or (arrival.reached and self._goal is not None)
        self._turning = math.isfinite(arrival.heading)
        self._fix("heading", np.array([arrival.heading]))
        if self._goal is not None or not self._fixed:  # without a goal the last one stays: nothing drives there
            self._fix("goal", np.array(goal[:2]))
            self._fixed = True

    def _process(self, context: Context, posed_scan: PosedScan) -> None:
        posed_scan = self._drop_faulty_beams(posed_scan)
        scan = dataclasses.replace(posed_scan.scan, time=posed_scan.scan.time - self._origin)
        self._fix(self._names[posed_scan.lidar], Value(scan))
        self._fix("scan_pose", posed_scan.pose)
        self._seen[posed_scan.lidar] = posed_scan.scan.time
        if posed_scan.lidar == 0:
            self._execution = add_scan(self._execution, posed_scan, self.mounts[0], self.scenario)
        next_context = context.Clone()
        self.diagram.CalcForcedUnrestrictedUpdate(context, next_context.get_mutable_state())
        context.SetTimeStateAndParametersFrom(next_context)

    def _drop_faulty_beams(self, posed_scan: PosedScan) -> PosedScan:
        """The scan without what faulty beams alone hit; once a beam is found to be one, what was seen is forgotten."""
        k, previous_beams = posed_scan.lidar, self._beams[posed_scan.lidar]
        self._beams[k], scan = previous_beams.after(posed_scan.scan, posed_scan.pose, self.mounts[k])
        for beam in np.setdiff1d(np.flatnonzero(self._beams[k].faulty), np.flatnonzero(previous_beams.faulty)):
            beam_text = f"beam {beam}" + (f" of lidar {k}" if len(self._beams) > 1 else "")
            self.intake = self.intake.count_drop(f"hits of {beam_text} alone, wherever the robot turned")
            self._forget_reason = (
                f"{beam_text} errs: it alone hits something near, wherever the robot turns; the map is made anew"
            )
        return posed_scan._replace(scan=scan)

    def _advance_diagram(self) -> Command:
        """What the shield commands after the updates of this instant."""
        context = self._simulator.get_mutable_context()
        self._simulator.AdvancePendingEvents()
        twist = self.value(self._twist_port).copy()
        certificate = self.navigation.certificate
        is_certified = certificate is not None and self.value(certificate).certified
        status = self._read_planned("status", PlannerStatus.EXPLORING)
        blocking_reason = self._read_planned("blocked_by", "")
        self._simulator.AdvanceTo(max((self._tick + 1) * self.actuation.hold, context.get_time()))
        if status is PlannerStatus.UNREACHABLE:
            return Command(twist, is_certified, "unreachable", "no way to the goal is left")
        status_text = "blocked" if status is PlannerStatus.BLOCKED else "driving"
        return Command(twist, is_certified, status_text, blocking_reason)

    def _read_planned(self, name: str, default: Any) -> Any:
        """What a port of the planner holds, or the default where the planner has none of that name."""
        port = self.navigation.planned(name)
        return default if port is None else self.value(port)

    def _make_braking_command(self, why: str) -> Command:
        """The ramp to zero that the last certified motion ends with."""
        twist = self._command.twist
        braking_twist = make_braking_twist(twist, np.zeros(len(twist)), self.actuation.limits, False)
        next_twist = ramp_twist(twist, braking_twist, self.actuation)
        is_standing = not next_twist[:-1].any() and (self.actuation.limits.steers > 0.0 or not next_twist[-1])
        if is_standing:
            return Command(np.zeros(len(next_twist)), False, "standing", why)
        return Command(next_twist, False, "braking", why)

    def _drive(self, command: Command) -> None:
        """Keep what is driven: it is what the next command is ramped from, and what the base is held to."""
        self._command = command
        if math.isfinite(self._now):
            told_command = CommandedVelocity.of(self._now, command.twist, self.actuation.limits)
            self._execution = add_command(self._execution, told_command, self.scenario.drive.delay)
        self._set_twist(self._simulator.get_mutable_context(), command.twist)

    def _set_twist(self, context: Context, twist: np.ndarray) -> None:
        shield = self.navigation.shield
        if isinstance(shield, Unshielded):
            shield.GetMyMutableContextFromRoot(context).SetDiscreteState(0, twist)

    def _measure_twist(self) -> np.ndarray:
        """The base's twist by its odometry, within its limits."""
        last, limits = self.intake.rows[-1], self.actuation.limits
        twist = np.array((last.v, last.aside, last.omega) if len(self._command.twist) == 3 else (last.v, last.omega))
        if limits.steers > 0.0:
            twist[1] = last.omega / last.v if abs(last.v) > STANDING_SPEED else self._command.twist[1]
        return self.actuation.base.saturate(twist, limits)

    def _fix(self, name: str, value: Any) -> None:
        self.diagram.GetInputPort(name).FixValue(self._simulator.get_mutable_context(), value)

    def value(self, port: OutputPort) -> Any:
        """What an output port of the diagram holds."""
        return port.Eval(port.get_system().GetMyContextFromRoot(self.context))

    @property
    def context(self) -> Context:
        """The diagram's context, now."""
        return self._simulator.get_context()
