"""One scenario and one seed -> one trial: its outcome, its metrics and, on request, its recording."""

import dataclasses
import hashlib
import math
import time
from collections.abc import Callable, Iterator, Sequence
from contextlib import contextmanager
from pathlib import Path
from typing import Protocol

import numpy as np
from pydrake.systems.analysis import Simulator, SimulatorStatus
from pydrake.systems.framework import Context, Diagram, DiagramBuilder
from pydrake.systems.primitives import VectorLogSink

from drake_starnav.errors import StarnavError, check_kind
from drake_starnav.geometry.footprint import Footprint
from drake_starnav.geometry.trajectory import Motion
from drake_starnav.navigation import Navigation, Parts, add_navigation
from drake_starnav.navigation.parts import AS_DECLARED
from drake_starnav.navigation.robot import robot_world
from drake_starnav.scenario.schema import Scenario, check_method
from drake_starnav.simulation.monitors import add_monitors, make_watcher, read_arrival_times, read_blocking_reason
from drake_starnav.simulation.trial import (
    INTERRUPTED,
    TIMEOUT,
    Run,
    Task,
    Trial,
    make_caption_lines,
    make_trial,
)
from drake_starnav.station.navigation_station import StationInterface, add_station, simulated
from drake_starnav.station.planar_localization import read_planar_states
from drake_starnav.station.plant import advance, evaluate_port, make_simulator, make_simulator_config
from drake_starnav.systems.release import release
from drake_starnav.systems.star_roadmap_planner import StarRoadmapPlanner
from drake_starnav.utils.files import check_outputs, write_text
from drake_starnav.utils.stopwatch import STEPS, Stopwatch
from drake_starnav.worlds.clearance import compute_body_clearance
from drake_starnav.worlds.moving_obstacles import compute_moving_obstacle_clearance
from drake_starnav.worlds.world import World

PROGRESS_PERIOD = 1.0
"""Simulated time between two reports of progress, with a look at whether the robot drives as it is told, s."""


class Observer(Protocol):
    """Follows a trial from the construction of its diagram to its end."""

    def add_to(self, builder: DiagramBuilder, navigation: Navigation, scenario: Scenario) -> None:
        """Add systems to the diagram."""

    def finish(self, lines: tuple[str, ...], motion: Motion) -> None:
        """The run has ended; `lines` describe how, and `motion` is the robot's."""


def run_trial(
    scenario: Scenario,
    parts: Parts = AS_DECLARED,
    *,
    method: str | None = None,
    seed: int = 0,
    html: str | Path | None = None,
    csv: str | Path | None = None,
    observer: Observer | None = None,
    progress: Callable[[float, float], None] | None = None,
) -> Trial:
    """Simulate one trial.

    Args:
        scenario: the parameters; those of the method are already in them.
        parts: of your own, in the place of the scenario's, but no station. Systems serve for one trial, and are not to
            be used after it.
        method: its name in reports; the one that the scenario was loaded with, unless given.
        seed: of the world and of the sensor's noise.
        html, csv: files for a recording, and for the robot's states and the clearance of its footprint at each step of
            the plant, if any.
        observer: follows the run, if any; it must not change it.
        progress: called regularly with the simulated time and the time limit, s.

    Raises:
        UnsupportedError: the method cannot be tried in this world.
        StarnavError: the scenario is not one of the method; the world cannot be made (e.g. the start is inside an
            obstacle), a file not written, a system of yours not wired, or the robot does not follow its commands.
        KeyboardInterrupt: Ctrl-C; what was driven until then is in the files.
    """
    method = check_method(scenario, method)
    make_simulator_config(scenario.simulator_config)  # refused before the run
    files = [Path(path) for path in (html, csv) if path is not None]
    check_outputs(files)
    world = _make_trial_world(scenario, parts, seed)
    task = Task.of(scenario.name, _name_method(method, parts), seed, scenario, world)
    observers = _list_observers(observer, html)
    with _drive(task, parts, observers, progress) as run:
        trial = make_trial(task, run)
        if csv is not None:
            _write_states(Path(csv), run)
        for each in observers:
            each.finish(make_caption_lines(trial), run.motion)
    if trial.outcome == INTERRUPTED:
        raise KeyboardInterrupt(f"{run.elapsed:.1f} s were driven{', in ' * bool(files)}{', '.join(map(str, files))}")
    return trial


def _name_method(method: str, parts: Parts) -> str:
    """A method's name in reports: that of a controller of the user's own, if there is one."""
    controller = parts.controller
    return method if controller is None else getattr(controller, "__name__", type(controller).__name__)


def _list_observers(observer: Observer | None, html: str | Path | None) -> list[Observer]:
    """The observer of a trial, if there is one, and what records the trial if it is to be recorded."""
    observers: list[Observer] = [] if observer is None else [observer]
    if html is not None:
        from drake_starnav.visualization.recorder import Recorder  # Meshcat is only started when it is wanted

        observers.append(Recorder(html))
    return observers


@contextmanager
def _drive(
    task: Task, parts: Parts, observers: Sequence[Observer], progress: Callable[[float, float], None] | None
) -> Iterator[Run]:
    """Simulate a robot in the world of a task; when the block ends, all systems are released."""
    scenario, builder, stopwatch = task.scenario, DiagramBuilder(), Stopwatch()
    holder: Diagram | DiagramBuilder = builder
    try:
        station = add_station(builder, task.world, scenario, continuous=True, seed=task.seed)
        parts = dataclasses.replace(parts, world=task.world, station=station)
        navigation = add_navigation(builder, scenario, parts, task.seed, stopwatch=stopwatch)
        logs = add_monitors(builder, navigation)
        for each in observers:
            each.add_to(builder, navigation, scenario)
        holder = diagram = builder.Build()
        yield _simulate(diagram, navigation, logs, stopwatch, progress)
    finally:
        release(holder)


def _make_trial_world(scenario: Scenario, parts: Parts, seed: int) -> World:
    """The world of the parts, or else of the scenario, with the last goal of the scenario, if it has any."""
    check_kind(parts, Parts, "parts", "of your own")
    if parts.station is not None:
        raise StarnavError("parts has a station; allowed: none, as a trial makes its own")
    world = robot_world(scenario, seed) if parts.world is None else parts.world
    if not scenario.goals:
        return world
    x, y, *_ = scenario.goals[-1]
    return dataclasses.replace(world, goal=(x, y))


def _simulate(
    diagram: Diagram,
    navigation: Navigation,
    logs: list[VectorLogSink],
    stopwatch: Stopwatch,
    progress: Callable[[float, float], None] | None,
) -> Run:
    """Simulate until something ends the trial; the run says also what blocked the robot, and when."""
    scenario = navigation.station.scenario
    simulator = make_simulator(diagram, settings=scenario.simulator_config)
    reports: list[tuple[float, str]] = []
    watchers = [make_watcher(simulator, navigation, logs, reports), *([] if progress is None else [progress])]
    start_time = time.perf_counter()
    message = advance_until(simulator, scenario.simulation.timeout or navigation.world.timeout, watchers)
    wall_time, context = time.perf_counter() - start_time, simulator.get_context()
    if message.startswith("unreachable") and (reason := read_blocking_reason(navigation, context)):
        reports.append((context.get_time(), reason))
    run = read_run(context, navigation, logs[0], stopwatch)
    return dataclasses.replace(run, message=message, wall=wall_time, blocked=tuple(reports))


def _write_states(path: Path, run: Run) -> None:
    """Write time, state and clearance of the footprint at each step of the plant as CSV."""
    state_rows = np.column_stack((run.times, run.driven, run.clearances))
    csv_lines = ["t,x,y,yaw,v,omega,clearance", *(",".join(f"{value:.6g}" for value in row) for row in state_rows)]
    write_text(path, "\n".join(csv_lines) + "\n")


def read_run(context: Context, navigation: Navigation, log: VectorLogSink, stopwatch: Stopwatch) -> Run:
    """What a simulation leaves of a robot, by the log of its states and the times of its steps."""
    station = simulated(navigation.station)
    times, states = _read_states(context, station, log)
    driven = read_planar_states(states.T, station.plant.num_positions(station.robot_model))
    shape = station.scenario.robot.shape
    standing_clearances, clearances = _measure_clearances(navigation.world, times, driven[:, :3], shape)
    return Run(
        elapsed=context.get_time(),
        times=times,
        driven=driven,
        standing_clearances=standing_clearances,
        clearances=clearances,
        state_hash=hashlib.sha256(np.ascontiguousarray(states).tobytes()).hexdigest(),
        nodes=_count_nodes(navigation, context),
        steps={name: stopwatch.summarize(name) for name in STEPS},
        goals=tuple(time for time in read_arrival_times(navigation, context).tolist() if math.isfinite(time)),
    )


def _read_states(context: Context, station: StationInterface, log: VectorLogSink) -> tuple[np.ndarray, np.ndarray]:
    """Times, shape (n,), s, and logged states of a robot, shape (m, n), up to now."""
    state_record = log.FindLog(context)
    times, states = state_record.sample_times().copy(), state_record.data()
    if times[-1] < context.get_time():
        end_state = evaluate_port(station.plant.get_state_output_port(station.robot_model), context)
        times, states = np.append(times, context.get_time()), np.column_stack((states, end_state))
    return times, states


def _measure_clearances(
    world: World, times: np.ndarray, poses: np.ndarray, shape: Footprint
) -> tuple[np.ndarray, np.ndarray]:
    """Clearances of a footprint at poses (n, 3), W, from what stands, and from what stands or moves; each (n,), m."""
    standing_clearances = compute_body_clearance(world, poses, shape)
    moving_clearances = compute_moving_obstacle_clearance(world.moving_obstacles, poses, times, shape)
    return standing_clearances, np.minimum(standing_clearances, moving_clearances)


def _count_nodes(navigation: Navigation, context: Context) -> int:
    """Number of nodes in the roadmap; 0 without one."""
    if not isinstance(navigation.planner, StarRoadmapPlanner):
        return 0
    return len(evaluate_port(navigation.planner.GetOutputPort("planner_state"), context).roadmap)


def advance_until(
    simulator: Simulator,
    timeout: float,
    watchers: Sequence[Callable[[float, float], None]],
    has_arrived: Callable[[Context], bool] = lambda _: False,
) -> str:
    """Run until something ends the trial, or the timeout, s, and return its message: it begins with the outcome.

    Args:
        simulator, timeout: of the diagram, and s.
        watchers: called regularly with the simulated time and the time limit, s.
        has_arrived: whether all is done, where no system of the diagram ends the run then.
    """
    while True:
        current_time = simulator.get_context().get_time()
        if has_arrived(simulator.get_context()):
            return "reached"
        if current_time >= timeout - 1e-9:
            return TIMEOUT
        try:
            status = advance(simulator, min(current_time + PROGRESS_PERIOD, timeout))
        except KeyboardInterrupt:
            if simulator.get_context().get_time() == 0.0:  # nothing was driven
                raise
            return INTERRUPTED
        if status.reason() == SimulatorStatus.ReturnReason.kReachedTerminationCondition:
            return status.message()
        if status.reason() == SimulatorStatus.ReturnReason.kEventHandlerFailed:
            raise StarnavError(f"simulation failed: {status.message()}")
        for watch in watchers:
            watch(simulator.get_context().get_time(), timeout)
