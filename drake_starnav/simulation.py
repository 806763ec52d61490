"""One scenario and one seed -> one trial: its outcome, its metrics and, on request, its recording."""

import dataclasses
import hashlib
import math
import time
from collections.abc import Callable, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any, Protocol, TypedDict, Unpack

import numpy as np
from pydrake.systems.analysis import Simulator, SimulatorStatus
from pydrake.systems.framework import Diagram, DiagramBuilder, System, TriggerType
from pydrake.systems.primitives import LogVectorOutput, VectorLogSink

from drake_starnav.control.certificates import Certificate
from drake_starnav.errors import StarnavError, check_kind
from drake_starnav.geometry.polyline import simplified
from drake_starnav.geometry.trajectory import Motion, evenly_sampled
from drake_starnav.geometry.trajectory_metrics import motion_metrics
from drake_starnav.navigation import Navigation, add_navigation
from drake_starnav.scenario import Scenario
from drake_starnav.scenario.schema import check_method
from drake_starnav.station.arrival_monitor import ArrivalMonitor
from drake_starnav.station.collision_monitor import COLLISION, CollisionMonitor, contact_in
from drake_starnav.station.drake_configs import scenario_simulator_config
from drake_starnav.station.drive_check import check_drive
from drake_starnav.station.model_world import make_world_with_footprints
from drake_starnav.station.navigation_station import Station, add_station
from drake_starnav.station.planar_localization import planar_states
from drake_starnav.station.plant import advance, make_simulator
from drake_starnav.systems.connecting import outputs
from drake_starnav.systems.release import release
from drake_starnav.systems.star_roadmap_planner import STANDSTILL, StarRoadmapPlanner
from drake_starnav.utils.files import check_outputs, write_text
from drake_starnav.utils.stopwatch import STEPS, Stopwatch
from drake_starnav.worlds.clearance import clearance
from drake_starnav.worlds.difficulty import tightest_gap
from drake_starnav.worlds.moving_obstacles import moving_obstacle_clearance
from drake_starnav.worlds.shortest_path import shortest_path
from drake_starnav.worlds.world import World

INTERRUPTED = "interrupted"
"""The outcome of a trial that was ended by Ctrl-C, as its files have it."""
TIMEOUT = "timeout"
NEVER_MOVED = 0.05
"""A robot that has driven less than this, m, in more than STANDSTILL s has never moved: it turned, or was pushed."""
METRICS_PERIOD = 0.01
"""Metrics of the motion are of states at equal steps of this length, s, interpolated between the logged ones."""
PROGRESS_PERIOD = 1.0
"""Simulated time between two reports of progress, with a look at whether the robot drives as it is told, s."""
SHORTEST_PATH_SLACK = 0.005
"""The omniscient shortest path keeps this clearance beyond the robot's radius, m."""
FINE, COARSE, CELLS = 0.02, 0.05, 5e6
"""Grid step for that path, m: the first, or up to the second in a world of more cells."""
PATH_TOLERANCE = 0.02
"""Largest deviation of the path in a trial's record from the driven one, m."""


@dataclass(frozen=True)
class Trial:
    """The result of one run; the field names are those of its JSON form.

    Attributes:
        outcome: reached, collision, struck (by a moving obstacle, while the robot stood), unreachable, blocked (out of
            time while the robot stood still, or had never moved), timeout or, instead of these three, occupied (in the
            end a moving obstacle covered all places within the goal's tolerance).
        contact: the bodies that touched, the robot's first: `base_link with crate`; None without a contact.
        blocked_s: when the planner first reported that the robot stood still, to a second; None if it never did.
        blocked_by: why, as its port `blocked_by` said then.
        time_s: simulated time until the outcome.
        path_length_m: driven by the robot's centre.
        shortest_path_m: shortest path of the same radius given the full map, among the static obstacles; None if there
            is none, or a model file's obstacles move.
        straight_line_m: from the start to the goal.
        tightest_gap_m: least width of the free space along the shortest path; None where nothing narrows it.
        score: of the benchmark that the world is from, 0 to 0.5; None for other worlds. See `benchmark_score`.
        min_clearance_m: least distance of the hull to an obstacle, but to none of a model file that moves; negative in
            a collision.
        mean_speed_mps: path length over time.
        mean_clearance_m, jerk_mps3, yaw_rate_change_radps2, twist_energy_m2ps, stops, stuck_s: see `MotionMetrics`.
        nodes: in the roadmap at the end; 0 without one.
        wall_s: wall-clock time of the simulation.
        state_hash: SHA-256 of the logged plant state.
        command, scan, plan: `count, mean_s, p50_s, p99_s` of the wall-clock time of each step.
        path: corners (x, y) of the path that the robot's centre drove, simplified by up to `PATH_TOLERANCE`, m, W.
    """

    scenario: str
    method: str
    seed: int
    outcome: str
    contact: str | None
    blocked_s: float | None
    blocked_by: str | None
    time_s: float
    path_length_m: float
    shortest_path_m: float | None
    straight_line_m: float
    tightest_gap_m: float | None
    score: float | None
    min_clearance_m: float
    mean_speed_mps: float
    mean_clearance_m: float
    jerk_mps3: float
    yaw_rate_change_radps2: float
    twist_energy_m2ps: float
    stops: int
    stuck_s: float
    nodes: int
    wall_s: float
    state_hash: str
    command: dict[str, float]
    scan: dict[str, float]
    plan: dict[str, float]
    path: list[list[float]]


class Observer(Protocol):
    """Follows a trial from the construction of its diagram to its end."""

    def add_to(self, builder: DiagramBuilder, navigation: Navigation, scenario: Scenario) -> None:
        """Add systems to the diagram."""

    def start(self) -> None:
        """The simulator is about to be initialized."""

    def finish(self, lines: tuple[str, ...], motion: Motion) -> None:
        """The run has ended; `lines` describe how, and `motion` is the robot's."""


class OwnSystems(TypedDict, total=False):
    """Systems of the user's in the place of the scenario's, as `add_navigation` takes them."""

    goal: System
    planner: System
    controller: System
    shield: System
    certificates: tuple[Certificate, ...]


def run_trial(
    scenario: Scenario,
    *,
    method: str = "star",
    seed: int = 0,
    world: World | None = None,
    html: str | Path | None = None,
    csv: str | Path | None = None,
    observer: Observer | None = None,
    progress: Callable[[float, float], None] | None = None,
    **own: Unpack[OwnSystems],
) -> Trial:
    """Simulate one trial.

    Args:
        scenario: the parameters; those of the method are already in them.
        method: its name, for the record: the one that the scenario was loaded with.
        seed: of the world and of the sensor's noise.
        world: in which to drive, instead of the scenario's.
        html: file for a recording, if any.
        csv: file for the robot's states at each step of the plant, if any.
        observer: follows the run, if any; it must not change it.
        progress: called regularly with the simulated time and the time limit, s.
        own: goal, planner, controller, shield and certificates of your own, as for `add_navigation`. Systems serve for
            one trial, and are not to be used after it.

    Raises:
        UnsupportedError: the method cannot be tried in this world.
        StarnavError: the scenario is not one of the method; the world cannot be made (e.g. the start is inside an
            obstacle), a file not written, a system of yours not wired, or the robot does not follow its commands.
        KeyboardInterrupt: Ctrl-C; what was driven until then is in the files.
    """
    check_method(scenario, method)
    scenario_simulator_config(scenario.simulator_config)  # refused before the run
    check_outputs([None if path is None else Path(path) for path in (html, csv)])
    if world is None:
        world = make_world_with_footprints(scenario.world, seed, scenario.robot.radius)
    check_kind(world, World, "world", "as from make_world")
    shortest = omniscient_path(world, scenario.robot.radius)  # first: a world too large for it is refused at once
    observers: list[Observer] = [] if observer is None else [observer]
    if html is not None:
        from drake_starnav.visualization.recorder import Recorder  # Meshcat is only started when it is wanted

        observers.append(Recorder(html))
    stopwatch = Stopwatch()
    builder = DiagramBuilder()
    made: Diagram | DiagramBuilder = builder
    try:
        station = scenario_station(builder, scenario, world, seed)
        navigation = add_navigation(
            builder, scenario, seed=seed, world=world, station=station, stopwatch=stopwatch, **own
        )
        logs = _add_monitors(builder, navigation, scenario)
        for each in observers:
            each.add_to(builder, navigation, scenario)
        made = diagram = builder.Build()
        for each in observers:
            each.start()
        simulator = make_simulator(diagram, settings=scenario.simulator_config)
        reports: list[tuple[float, str]] = []
        watch = _watch(simulator, navigation, logs, scenario.drive.slip, reports, progress)
        run = _simulated(simulator, navigation, logs[0], scenario.simulation.timeout or world.timeout, watch)
        run = dataclasses.replace(run, blocked=tuple(reports))
        steps: dict[str, Any] = {name: stopwatch.summary(name) for name in STEPS}
        figures = _figures(scenario, world, shortest, run)
        by = type(own["controller"]).__name__ if own.get("controller") else method
        trial = Trial(scenario=scenario.name, method=by, seed=seed, **figures, **steps)
        if csv is not None:
            rows = np.column_stack((run.times, run.driven))
            lines = ["t,x,y,yaw,v,omega", *(",".join(f"{value:.6g}" for value in row) for row in rows)]
            write_text(Path(csv), "\n".join(lines) + "\n")
        for each in observers:
            each.finish(caption_lines(trial), Motion(run.times, run.driven[:, :3]))
        if trial.outcome == INTERRUPTED:
            kept = ", ".join(str(path) for path in (html, csv) if path is not None)
            raise KeyboardInterrupt(f"{run.elapsed:.1f} s were driven{f', in {kept}' if kept else ''}")
        return trial
    finally:
        release(made)


def scenario_station(builder: DiagramBuilder, scenario: Scenario, world: World, seed: int) -> Station:
    """What trials drive in: `add_station` with the parameters of a scenario, for `make_simulator`."""
    return add_station(
        builder,
        world,
        scenario.robot,
        scenario.lidar,
        localization=scenario.localization,
        drive=scenario.drive,
        time_step=scenario.simulation.time_step,
        continuous=True,
        settings=scenario.plant_config,
        seed=seed,
    )


@dataclass(frozen=True)
class _Run:
    """What a simulation leaves.

    Attributes:
        message: why it ended.
        blocked: from when on, s, which reason was reported for a robot that stood still; an empty one when it moved on.
        elapsed: when it ended, s.
        times: of the states, shape (n,), s: the ends of the simulator's steps.
        driven: shape (n, 5): x, y, yaw, v, omega at these times.
        state_hash: of the logged plant states.
        nodes: in the roadmap.
        wall: wall-clock time, s.
    """

    message: str
    elapsed: float
    times: np.ndarray
    driven: np.ndarray
    state_hash: str
    nodes: int
    wall: float
    blocked: tuple[tuple[float, str], ...] = ()


def _add_monitors(builder: DiagramBuilder, navigation: Navigation, scenario: Scenario) -> list[VectorLogSink]:
    """Add what ends a trial, and the logs of the robot's states and of its commands, which cause no steps."""
    # both look when the controller does: this causes no steps either, and its state is calculated once
    period = 1.0 / scenario.controller.rate
    add_collision_monitor(builder, navigation, period=period)
    tolerance = scenario.simulation.goal_tolerance
    _add_arrival_monitor(builder, navigation, ArrivalMonitor(tolerance=tolerance, period=period))
    state = navigation.station.GetOutputPort("cheat.robot_state")
    return [LogVectorOutput(port, builder, {TriggerType.kPerStep}) for port in (state, navigation.twist_command)]


def _watch(
    simulator: Simulator,
    navigation: Navigation,
    logs: Sequence[VectorLogSink],
    slip: float,
    reports: list[tuple[float, str]],
    progress: Callable[[float, float], None] | None,
) -> Callable[[float, float], None]:
    """Report progress, a robot that does not follow its commands, and, in `reports`, one that stands still and why."""
    planner = navigation.planner
    port = None if planner is None else outputs(planner).get("blocked_by")

    def watch(now: float, limit: float) -> None:
        if progress is not None:
            progress(now, limit)
        context = simulator.get_context()
        states, commands = (log.FindLog(context) for log in logs)
        check_drive(navigation.station, states.sample_times(), states.data().T, commands.data().T, slip=slip)
        reason = "" if port is None else port.Eval(planner.GetMyContextFromRoot(context))
        if reason != (reports[-1][1] if reports else ""):
            reports.append((now, reason))

    return watch


def _simulated(
    simulator: Simulator,
    navigation: Navigation,
    log: VectorLogSink,
    timeout: float,
    progress: Callable[[float, float], None],
) -> _Run:
    """Simulate until something ends the trial; `timeout` in s."""
    start = time.perf_counter()
    message = _advance(simulator, timeout, progress)
    wall = time.perf_counter() - start
    context = simulator.get_context()
    record, station = log.FindLog(context), navigation.station
    times, states = record.sample_times(), record.data()
    if times[-1] < context.get_time():
        port = station.GetOutputPort("cheat.robot_state")
        end = port.Eval(port.get_system().GetMyContextFromRoot(context))
        times, states = np.append(times, context.get_time()), np.column_stack((states, end))
    nodes = 0
    if isinstance(navigation.planner, StarRoadmapPlanner):
        roadmap = navigation.planner.GetOutputPort("roadmap").Eval(navigation.planner.GetMyContextFromRoot(context))
        nodes = len(roadmap.roadmap)
    return _Run(
        message=message,
        elapsed=context.get_time(),
        times=times.copy(),
        driven=planar_states(states.T, station.plant.num_positions(station.robot_model)),
        state_hash=hashlib.sha256(np.ascontiguousarray(states).tobytes()).hexdigest(),
        nodes=nodes,
        wall=wall,
    )


def _figures(scenario: Scenario, world: World, shortest: tuple[float, np.ndarray] | None, run: _Run) -> dict[str, Any]:
    """Fields of the `Trial`: its outcome, and what follows from where the robot drove.

    Args:
        scenario: of the run.
        world: of the run, with its footprints.
        shortest: the path for comparison, as of `omniscient_path`.
        run: what was simulated.
    """
    path, radius = run.driven[:, :2], scenario.robot.radius
    standing = clearance(world, path)
    outcome = COLLISION if standing.min() < radius else run.message.split()[0]
    clearances = np.minimum(standing, moving_obstacle_clearance(world.moving_obstacles, path, run.times)) - radius
    length = float(np.hypot(*np.diff(path.T, axis=1)).sum())
    blocked_s, blocked_by = run.blocked[0] if run.blocked else (None, None)
    still = length < NEVER_MOVED and run.elapsed > STANDSTILL
    if outcome == TIMEOUT and (still or (run.blocked and run.blocked[-1][1])):
        outcome = "blocked"
    if outcome in (TIMEOUT, "blocked", "unreachable") and goal_occupied(world, run.elapsed, scenario):
        outcome = "occupied"
    samples = evenly_sampled(run.times, np.column_stack((path, run.driven[:, 3:], clearances)), METRICS_PERIOD)
    motion = motion_metrics(
        samples[:, :2], samples[:, 2:4], samples[:, 4], time_step=METRICS_PERIOD, robot_radius=radius
    )
    return {
        "outcome": outcome,
        "contact": contact_in(run.message),
        "blocked_s": blocked_s,
        "blocked_by": blocked_by,
        "time_s": round(run.elapsed, 6),
        "path_length_m": length,
        "shortest_path_m": None if shortest is None else float(shortest[0]),
        "straight_line_m": math.dist(world.start[:2], world.goal),
        "tightest_gap_m": None if shortest is None else _finite(tightest_gap(world, shortest[1])),
        "score": benchmark_score(outcome, run.elapsed, world.optimal_time),
        "min_clearance_m": float(clearances.min()),
        "mean_speed_mps": length / run.elapsed if run.elapsed > 0.0 else 0.0,
        **vars(motion),
        "nodes": run.nodes,
        "wall_s": run.wall,
        "state_hash": run.state_hash,
        "path": simplified(path, PATH_TOLERANCE).round(3).tolist(),
    }


def goal_occupied(world: World, time: float, scenario: Scenario) -> bool:
    """Whether a robot that is within the tolerance of the world's goal would touch a moving obstacle at a time, s."""
    clearance_there = moving_obstacle_clearance(world.moving_obstacles, np.array([world.goal]), np.array([time]))
    return bool(clearance_there[0] + scenario.simulation.goal_tolerance < scenario.robot.radius)


def benchmark_score(outcome: str, time: float, optimal_time: float | None) -> float | None:
    """OT / clip(AT, 2 OT, 8 OT) of a trial that reached the goal, 0 of another one; None without an optimal time.

    Args:
        outcome: of the trial.
        time: AT, until the outcome, s.
        optimal_time: OT of the world, s.

    Source: the BARN challenge since 2024; in 2022 the lower bound was 4 OT, and the largest score 0.25.
    """
    if optimal_time is None:
        return None
    return optimal_time / min(max(time, 2.0 * optimal_time), 8.0 * optimal_time) if outcome == "reached" else 0.0


def caption_lines(trial: Trial) -> tuple[str, ...]:
    """The caption of a trial's picture."""
    said = {"reached": f"reached in {trial.time_s:.1f}\u00a0s", "unreachable": "found no way"}
    what = trial.outcome if trial.contact is None else f"{trial.outcome} of {trial.contact}"
    outcome = said.get(trial.outcome, f"{what} after {trial.time_s:.1f}\u00a0s")
    return f"method {trial.method}, seed {trial.seed}", outcome


def add_collision_monitor(builder: DiagramBuilder, navigation: Navigation, *, period: float = 0.02) -> None:
    """End the simulation at the robot's first contact with anything but the ground.

    Args:
        builder: of the diagram.
        navigation: in it.
        period: of the checks, s; where obstacles move, every step of the plant is checked.
    """
    robot, moving = navigation.robot, getattr(navigation.station, "moving_obstacle_geometries", ())
    if moving:
        period = robot.time_step
    collision = builder.AddNamedSystem(
        "collision_monitor",
        CollisionMonitor(
            robot=robot.robot_geometries,
            ground=robot.floor,
            moving_obstacles=moving,
            hull=getattr(navigation.station, "hull", None),
            period=period,
        ),
    )
    builder.Connect(navigation.geometry_query, collision.GetInputPort("geometry_query"))
    builder.Connect(navigation.station.GetOutputPort("localization.state"), collision.GetInputPort("state"))


def _add_arrival_monitor(builder: DiagramBuilder, navigation: Navigation, monitor: ArrivalMonitor) -> None:
    arrival = builder.AddNamedSystem("arrival_monitor", monitor)
    builder.Connect(navigation.localization("state"), arrival.GetInputPort("state"))
    builder.Connect(navigation.goal.get_output_port(), arrival.GetInputPort("goal"))
    if navigation.planner is not None and "status" in outputs(navigation.planner):
        builder.Connect(navigation.planner.GetOutputPort("status"), arrival.GetInputPort("status"))


def _advance(simulator: Simulator, timeout: float, progress: Callable[[float, float], None]) -> str:
    """Run until something ends the trial, and return its message: it begins with the outcome."""
    while True:
        now = simulator.get_context().get_time()
        if now >= timeout - 1e-9:
            return TIMEOUT
        try:
            status = advance(simulator, min(now + PROGRESS_PERIOD, timeout))
        except KeyboardInterrupt:
            return INTERRUPTED
        if status.reason() == SimulatorStatus.ReturnReason.kReachedTerminationCondition:
            return status.message()
        if status.reason() == SimulatorStatus.ReturnReason.kEventHandlerFailed:
            raise StarnavError(f"simulation failed: {status.message()}")
        progress(simulator.get_context().get_time(), timeout)


def omniscient_path(world: World, radius: float) -> tuple[float, np.ndarray] | None:
    """The shortest path given the full map, with which a trial is compared.

    Args:
        world: with its footprints, if it is of a model file.
        radius: of the robot, m.

    Returns:
        As `shortest_path`, which may miss passages with less than 2 to 4 cm to spare; None also where obstacles move.
    """
    if world.model is not None and world.model.moving:
        return None
    x0, y0, x1, y1 = world.extent
    resolution = min(max(math.sqrt((x1 - x0) * (y1 - y0) / CELLS), FINE), COARSE)
    return shortest_path(world, radius + SHORTEST_PATH_SLACK, resolution)


def trial_record(trial: Trial) -> dict[str, Any]:
    """The trial as a JSON-compatible mapping; an infinite clearance (nothing to hit) is null."""
    clearances = {name: _finite(getattr(trial, name)) for name in ("min_clearance_m", "mean_clearance_m")}
    return {**vars(trial), **clearances}


def _finite(value: float) -> float | None:
    """The value, or None for an infinite one, which JSON cannot represent."""
    return value if math.isfinite(value) else None
