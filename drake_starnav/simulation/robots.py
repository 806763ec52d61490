"""One scenario of several robots -> one trial for each; they see each other by their lidars alone."""

import dataclasses
import functools
import itertools
import math
import time
from collections.abc import Callable, Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np
from pydrake.geometry import GeometryId, SceneGraph
from pydrake.multibody.plant import AddMultibodyPlant, MultibodyPlant
from pydrake.multibody.tree import ModelInstanceIndex
from pydrake.systems.analysis import Simulator
from pydrake.systems.framework import Context, Diagram, DiagramBuilder, TriggerType
from pydrake.systems.primitives import LogVectorOutput, VectorLogSink

from drake_starnav.errors import StarnavError
from drake_starnav.geometry.footprint import Footprint, disc, is_overlapping
from drake_starnav.geometry.trajectory import Motion, find_least_gaps
from drake_starnav.navigation import Navigation, Parts, add_navigation
from drake_starnav.navigation.robot import body_top
from drake_starnav.planning import PlannerStatus
from drake_starnav.scenario.schema import Scenario, check_method
from drake_starnav.simulation.monitors import make_watcher
from drake_starnav.simulation.run import advance_until, read_run
from drake_starnav.simulation.trial import (
    INTERRUPTED,
    TIMEOUT,
    Run,
    Trial,
    compute_hull_clearances,
    compute_trial_figures,
    find_omniscient_path,
)
from drake_starnav.station.lidar_mounts import add_collars
from drake_starnav.station.model_world import drop_floors, make_world_with_footprints
from drake_starnav.station.monitors import CollisionMonitor
from drake_starnav.station.plant import (
    DISCRETE_ONLY,
    evaluate_port,
    make_plant_config,
    make_simulator,
    make_simulator_config,
    plant_config,
)
from drake_starnav.station.robot_interface import RobotInterface, connect_robot
from drake_starnav.station.robot_model import add_robot
from drake_starnav.station.unseen import warn_of_unseen
from drake_starnav.station.world_geometry import add_ground, add_world
from drake_starnav.systems.goal_sequence import GoalSequence
from drake_starnav.systems.release import release
from drake_starnav.utils.stopwatch import STEPS, Stopwatch
from drake_starnav.worlds import GIVEN
from drake_starnav.worlds.solvable import check_free
from drake_starnav.worlds.world import World

SEEDS = 1000003
"""Added to the seed for each further robot: no two have the same noise."""


@dataclass(frozen=True)
class RobotTrial:
    """How one of several robots fared.

    Attributes:
        robot: its name.
        trial: its own, as if it had driven alone; it ends when the robot has reached its goals, or with the run.
        min_gap_m: least distance to another robot during the whole run, between their footprints.
        motion: during the whole run.
    """

    robot: str
    trial: Trial
    min_gap_m: float
    motion: Motion


class RobotNavigator(Diagram):
    """A robot's interface with all that drives it, as one system with the ports of its `RobotInterface`.

    Attributes:
        navigation: the systems in it.
    """

    def __init__(self, scenario: Scenario, robot: RobotInterface, world: World, seed: int, watch: Stopwatch) -> None:
        """Navigate one robot of a scenario; the world has its start and goal, the stopwatch notes times."""
        super().__init__()
        builder = DiagramBuilder()
        builder.AddNamedSystem("robot", robot)
        self.navigation = add_navigation(builder, scenario, Parts(world, robot), seed, stopwatch=watch)
        for name in ("geometry_query", "multibody_state"):
            builder.ExportInput(robot.GetInputPort(name), name)
        for name in ("localization.state", "actuation" if robot.continuous else "desired_state"):
            builder.ExportOutput(robot.GetOutputPort(name), name)
        builder.ExportOutput(self.navigation.twist_command, "twist_command")
        builder.BuildInto(self)


@dataclass(frozen=True)
class DrivenRobot:
    """A robot in the diagram of all.

    Attributes:
        scenario, world: its own.
        navigation: its systems.
        monitor: of its contacts.
        logs: of its states and commands.
        stopwatch: of its steps.
        blocked: from when on, s, why it stood still.
    """

    scenario: Scenario
    world: World
    navigation: Navigation
    monitor: CollisionMonitor
    logs: tuple[VectorLogSink, VectorLogSink]
    stopwatch: Stopwatch
    blocked: list[tuple[float, str]]

    def find_arrival_times(self, context: Context) -> np.ndarray:
        """When it reached each of its goals, s; NaN for those that it did not."""
        assert isinstance(self.navigation.goal, GoalSequence)
        return evaluate_port(self.navigation.goal.GetOutputPort("reached"), context)

    def has_given_up(self, context: Context) -> bool:
        """Whether its planner found no way."""
        status = self.navigation.planned("status")
        return status is not None and evaluate_port(status, context) is PlannerStatus.UNREACHABLE


def run_robots(
    scenario: Scenario,
    *,
    method: str | None = None,
    seed: int = 0,
    progress: Callable[[float, float], None] | None = None,
) -> list[RobotTrial]:
    """Simulate the robots of a scenario until all have arrived or given up, two touch, or time is over.

    Each has lidar, localization and navigation of its own, and knows of the others only what its lidar sees. A collar
    about each robot, as wide as its footprint, reaches through the planes of all lidars.

    Args:
        scenario: with `robots`.
        seed: of the world and of the sensors' noise.
        progress: called regularly with the simulated time and the time limit, s.

    Raises:
        StarnavError: the scenario has no robots; one starts in an obstacle or another robot; two goals are too near; or
            as in `run_trial`.
        KeyboardInterrupt: Ctrl-C.
    """
    method = check_method(scenario, method)
    robots = scenario.robots
    for each in robots:
        check_method(each, method)
    make_simulator_config(scenario.simulator_config)
    worlds = make_worlds_of_robots(scenario, seed)
    shortest = [find_omniscient_path(w, each.robot.shape, each.goals) for each, w in zip(robots, worlds, strict=True)]
    builder = DiagramBuilder()
    holder: Diagram | DiagramBuilder = builder
    try:
        driven_robots = add_robots(builder, scenario, worlds, seed)
        holder = diagram = builder.Build()
        simulator = make_simulator(diagram, settings=scenario.simulator_config)
        timeout = scenario.simulation.timeout or worlds[0].timeout
        start = time.perf_counter()
        message = _simulate_robots(simulator, driven_robots, timeout, progress)
        wall = time.perf_counter() - start
        runs = [_read_run(simulator, each, message, wall) for each in driven_robots]
        motions = [Motion(run.times, run.driven[:, :3]) for run in runs]
        gaps = find_least_gaps([each.robot.shape for each in robots], motions)
        trials = []
        for robot, way, run, gap, motion in zip(driven_robots, shortest, runs, gaps, motions, strict=True):
            until = run.times <= run.elapsed + 1e-9
            own = dataclasses.replace(run, times=run.times[until], driven=run.driven[until])
            steps: dict[str, Any] = {name: robot.stopwatch.summarize(name) for name in STEPS}
            hull = compute_hull_clearances(robot.world, own, robot.scenario.robot.shape)
            fields = {**compute_trial_figures(robot.scenario, robot.world, way, own, hull), **steps}
            trial = Trial(scenario=scenario.name, method=method, seed=seed, **fields)
            trials.append(RobotTrial(robot.scenario.name, trial, gap, motion))
        if message == INTERRUPTED:
            raise KeyboardInterrupt
        return trials
    finally:
        release(holder)


def make_worlds_of_robots(scenario: Scenario, seed: int) -> list[World]:
    """The world of a scenario with `robots`, once for each, with its start and its last goal.

    Raises:
        StarnavError: as in `run_robots`.
    """
    robots = scenario.robots
    if not robots:
        raise StarnavError(f"scenario {scenario.name} has no robots; allowed: a list of them, or run_trial")
    shape, goals = robots[0].robot.shape, robots[0].goals  # a world that is given has its start and its goal
    if not isinstance(scenario.world, GIVEN):
        shape, goals = disc(max(each.robot.radius for each in robots)), ()
    made_worlds = [
        make_world_with_footprints(scenario.world, seed, shape, goals, functools.partial(body_top, each))
        for each in robots
    ]
    _check_ends(robots, made_worlds)
    return [
        dataclasses.replace(world, start=each.start or world.start, goal=(each.goals[-1][0], each.goals[-1][1]))
        for each, world in zip(robots, made_worlds, strict=True)
    ]


def _check_ends(robots: Sequence[Scenario], worlds: Sequence[World]) -> None:
    """Raise a `StarnavError` where a start lies in an obstacle, or starts or last goals in another robot's."""
    for each, world in zip(robots, worlds, strict=True):
        check_free(world, each.start or (0.0, 0.0, 0.0), each.robot.shape, f"robot {each.name}: start")
    for a, b in itertools.combinations(robots, 2):
        for what, one, other in (("starts", a.start, b.start), ("last goals", a.goals[-1], b.goals[-1])):
            if is_overlapping(*_cover_place(a, one or ()), *_cover_place(b, other or ())):
                distance = math.dist((one or ())[:2], (other or ())[:2])
                raise StarnavError(
                    f"{what} of {a.name} and {b.name} are {distance:.3g} m apart; "
                    "allowed: where their footprints do not touch"
                )


def _cover_place(robot: Scenario, place: Sequence[float]) -> tuple[Footprint, np.ndarray]:
    """What a robot covers at a place (x, y, yaw), or may cover at one (x, y), and its pose."""
    x, y, *yaw = place
    return robot.robot.shape if yaw else disc(robot.robot.radius), np.array((x, y, *(yaw or (0.0,))))


def add_robots(builder: DiagramBuilder, scenario: Scenario, worlds: Sequence[World], seed: int) -> list[DrivenRobot]:
    """Add a plant with all robots of a scenario in `worlds` of `make_worlds_of_robots`, and what drives each."""
    robots, world, settings = scenario.robots, worlds[0], scenario.plant_config
    moving = world.model is not None and world.model.moving
    time_step = scenario.simulation.time_step if moving or DISCRETE_ONLY & set(settings) else 0.0
    plant, scene_graph = AddMultibodyPlant(make_plant_config(settings, plant_config(time_step)), builder)
    models = []
    for each in robots:
        models.append(add_robot(plant, scene_graph, each.robot, each.start or (0.0, 0.0, 0.0), name=f"{each.name}_"))
    add_collars(plant, scene_graph, robots, models)
    ground = add_ground(plant, world.extent)
    add_world(plant, world)
    plant.Finalize()
    if world.model is not None:
        drop_floors(plant, scene_graph, ground)
    return _add_navigators(builder, (plant, scene_graph), robots, worlds, models, seed)


def _add_navigators(
    builder: DiagramBuilder,
    scene: tuple[MultibodyPlant, SceneGraph],
    robots: Sequence[Scenario],
    worlds: Sequence[World],
    models: Sequence[ModelInstanceIndex],
    seed: int,
) -> list[DrivenRobot]:
    plant, scene_graph = scene
    seeds = [(seed + k * SEEDS) % 2**63 for k in range(len(robots))]
    interfaces = [
        RobotInterface(plant, scene_graph, model, each, seed=own)
        for each, model, own in zip(robots, models, seeds, strict=True)
    ]
    warn_of_unseen(plant, scene_graph, worlds[0], interfaces)
    shapes: list[list[GeometryId]] = [robot.robot_geometries for robot in interfaces]
    driven_robots = []
    for k, (each, robot, world) in enumerate(zip(robots, interfaces, worlds, strict=True)):
        stopwatch = Stopwatch()
        navigator = RobotNavigator(each, robot, world, seeds[k], stopwatch)
        navigator = builder.AddNamedSystem(each.name, navigator)
        connect_robot(builder, plant, scene_graph, models[k], navigator)
        others = [g for j, own in enumerate(shapes) if j != k for g in own]
        period = 1.0 / each.controller.rate
        monitor = CollisionMonitor(
            robot=shapes[k], ground=robot.floor, moving_obstacles=others, footprint=robot.robot.shape, period=period
        )
        monitor = builder.AddNamedSystem(f"collision_monitor_of_{each.name}", monitor)
        builder.Connect(scene_graph.get_query_output_port(), monitor.GetInputPort("geometry_query"))
        builder.Connect(navigator.GetOutputPort("localization.state"), monitor.GetInputPort("state"))
        ports = plant.get_state_output_port(models[k]), navigator.GetOutputPort("twist_command")
        states, commands = (LogVectorOutput(port, builder, {TriggerType.kPerStep}) for port in ports)
        driven_robots.append(DrivenRobot(each, world, navigator.navigation, monitor, (states, commands), stopwatch, []))
    return driven_robots


def _simulate_robots(
    simulator: Simulator, robots: Sequence[DrivenRobot], timeout: float, progress: Callable[[float, float], None] | None
) -> str:
    watches = [
        make_watcher(simulator, each.navigation, each.logs, each.scenario.drive.slip, each.blocked, None)
        for each in robots
    ]

    def watch(current_time: float, limit: float) -> None:
        for each in watches:
            each(current_time, limit)
        if progress is not None:
            progress(current_time, limit)

    def arrived(context: Context) -> bool:
        return all(np.isfinite(each.find_arrival_times(context)).all() or each.has_given_up(context) for each in robots)

    return advance_until(simulator, timeout, watch, arrived)


def _read_run(simulator: Simulator, robot: DrivenRobot, message: str, wall: float) -> Run:
    """What the simulation leaves of one robot; it ended for it when its last goal was reached."""
    context = simulator.get_context()
    times = robot.find_arrival_times(context)
    touching = robot.monitor.describe_contacts(robot.monitor.GetMyContextFromRoot(context))
    if np.isfinite(times).all():
        message = "reached"
    elif robot.has_given_up(context):
        message = "unreachable"
    elif message != INTERRUPTED:
        message = TIMEOUT
    message = touching or message
    run = read_run(simulator, robot.navigation, robot.logs[0], message, wall)
    elapsed_time = float(times[-1]) if message == "reached" else run.elapsed
    return dataclasses.replace(run, elapsed=elapsed_time, blocked=tuple(robot.blocked))
