"""One scenario of several robots -> one trial for each; they see each other by their lidars alone."""

import dataclasses
import functools
import itertools
import math
import time
from collections.abc import Callable, Sequence
from dataclasses import dataclass

import numpy as np
from pydrake.geometry import GeometryId
from pydrake.multibody.plant import AddMultibodyPlant
from pydrake.systems.framework import Context, Diagram, DiagramBuilder, TriggerType
from pydrake.systems.primitives import LogVectorOutput, VectorLogSink

from drake_starnav.errors import StarnavError
from drake_starnav.geometry.footprint import Footprint, disc, is_overlapping
from drake_starnav.geometry.trajectory import Motion, find_least_gaps
from drake_starnav.navigation import Navigation, Parts, add_navigation
from drake_starnav.navigation.robot import body_top
from drake_starnav.planning import PlannerStatus
from drake_starnav.scenario.schema import Scenario, check_method
from drake_starnav.simulation.monitors import make_watcher, read_arrival_times
from drake_starnav.simulation.run import advance_until, read_run
from drake_starnav.simulation.trial import INTERRUPTED, TIMEOUT, Run, Task, Trial, make_trial
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
from drake_starnav.systems.release import release
from drake_starnav.utils.stopwatch import Stopwatch
from drake_starnav.worlds import GIVEN_GOAL_KINDS
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
class SimulatedRobot:
    """A robot in the diagram of all: its systems, the monitor of its contacts, the logs of its states and commands, the
    stopwatch of its steps, and from when on, s, why it stood still."""

    navigation: Navigation
    monitor: CollisionMonitor
    logs: list[VectorLogSink]
    stopwatch: Stopwatch
    standstill_reasons: list[tuple[float, str]]

    def has_arrived(self, context: Context) -> bool:
        """Whether it has reached all of its goals."""
        return bool(np.isfinite(read_arrival_times(self.navigation, context)).all())

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
    for each in scenario.robots:
        check_method(each, method)
    make_simulator_config(scenario.simulator_config)
    worlds = make_worlds_of_robots(scenario, seed)
    tasks = [
        Task.of(scenario.name, method, seed, each, world) for each, world in zip(scenario.robots, worlds, strict=True)
    ]
    runs = _drive(scenario, worlds, seed, progress)
    gaps = find_least_gaps([each.robot.shape for each in scenario.robots], [run.motion for run in runs])
    return [
        RobotTrial(task.scenario.name, make_trial(task, _select_own_run(run)), gap, run.motion)
        for task, run, gap in zip(tasks, runs, gaps, strict=True)
    ]


def _drive(
    scenario: Scenario, worlds: Sequence[World], seed: int, progress: Callable[[float, float], None] | None
) -> list[Run]:
    """Simulate the robots of a scenario, each in its world of `make_worlds_of_robots`; Ctrl-C is raised at the end."""
    builder = DiagramBuilder()
    holder: Diagram | DiagramBuilder = builder
    try:
        robots = add_robots(builder, scenario, worlds, seed)
        holder = diagram = builder.Build()
        simulator = make_simulator(diagram, settings=scenario.simulator_config)
        watchers = [make_watcher(simulator, each.navigation, each.logs, each.standstill_reasons) for each in robots]
        start_time, timeout = time.perf_counter(), scenario.simulation.timeout or worlds[0].timeout
        message = advance_until(
            simulator,
            timeout,
            [*watchers, *([] if progress is None else [progress])],
            lambda context: all(each.has_arrived(context) or each.has_given_up(context) for each in robots),
        )
        if message == INTERRUPTED:
            raise KeyboardInterrupt
        wall_time = time.perf_counter() - start_time
        return [_read_run(simulator.get_context(), each, wall_time) for each in robots]
    finally:
        release(holder)


def _read_run(context: Context, robot: SimulatedRobot, wall_time: float) -> Run:
    """What the simulation leaves of one robot; it ended for it when its last goal was reached."""
    run, blocked = read_run(context, robot.navigation, robot.logs[0], robot.stopwatch), tuple(robot.standstill_reasons)
    message = "unreachable" if robot.has_given_up(context) else TIMEOUT
    if robot.has_arrived(context):
        message = "reached"
    message = robot.monitor.describe_contacts(robot.monitor.GetMyContextFromRoot(context)) or message
    elapsed_time = run.goals[-1] if message == "reached" else run.elapsed
    return dataclasses.replace(run, message=message, elapsed=elapsed_time, wall=wall_time, blocked=blocked)


def _select_own_run(run: Run) -> Run:
    """A robot's part of a run, which ends when the robot has reached its goals."""
    is_before_end = run.times <= run.elapsed + 1e-9
    names = ("times", "driven", "standing_clearances", "clearances")
    return dataclasses.replace(run, **{name: getattr(run, name)[is_before_end] for name in names})


def make_worlds_of_robots(scenario: Scenario, seed: int) -> list[World]:
    """The world of a scenario with `robots`, once for each, with its start and its last goal.

    Raises:
        StarnavError: as in `run_robots`.
    """
    robots = scenario.robots
    if not robots:
        raise StarnavError(f"scenario {scenario.name} has no robots; allowed: a list of them, or run_trial")
    common_shape, goals = robots[0].robot.shape, robots[0].goals  # a world that is given has its start and its goal
    if not isinstance(scenario.world, GIVEN_GOAL_KINDS):
        common_shape, goals = disc(max(each.robot.radius for each in robots)), ()
    made_worlds = [
        make_world_with_footprints(scenario.world, seed, common_shape, goals, functools.partial(body_top, each))
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
        for end_name, place_a, place_b in (("starts", a.start, b.start), ("last goals", a.goals[-1], b.goals[-1])):
            assert place_a is not None and place_b is not None  # each of several robots has a start
            if is_overlapping(*_cover_place(a, *place_a), *_cover_place(b, *place_b)):
                distance = math.dist(place_a[:2], place_b[:2])
                raise StarnavError(
                    f"{end_name} of {a.name} and {b.name} are {distance:.3g} m apart; "
                    "allowed: where their footprints do not touch"
                )


def _cover_place(robot: Scenario, x: float, y: float, yaw: float | None = None) -> tuple[Footprint, np.ndarray]:
    """What a robot covers at a place, or may cover at one without a yaw, and its pose."""
    return disc(robot.robot.radius) if yaw is None else robot.robot.shape, np.array((x, y, yaw or 0.0))


def add_robots(builder: DiagramBuilder, scenario: Scenario, worlds: Sequence[World], seed: int) -> list[SimulatedRobot]:
    """Add a plant with all robots of a scenario in `worlds` of `make_worlds_of_robots`, and what drives each."""
    seeds = [(seed + k * SEEDS) % 2**63 for k in range(len(worlds))]
    interfaces = _add_plant_of_robots(builder, scenario, worlds[0], seeds)
    driven_robots = []
    for interface, world, own_seed in zip(interfaces, worlds, seeds, strict=True):
        others = [geometry for each in interfaces if each is not interface for geometry in each.robot_geometries]
        driven_robots.append(_add_navigator(builder, interface, world, own_seed, others))
    return driven_robots


def _add_plant_of_robots(
    builder: DiagramBuilder, scenario: Scenario, world: World, seeds: Sequence[int]
) -> list[RobotInterface]:
    """Add the plant, and make what makes its models robots, each with its own seed."""
    robots, settings = scenario.robots, scenario.plant_config
    moves = world.model is not None and world.model.moving
    time_step = scenario.simulation.time_step if moves or DISCRETE_ONLY & set(settings) else 0.0
    plant, scene_graph = AddMultibodyPlant(make_plant_config(settings, plant_config(time_step)), builder)
    models = [
        add_robot(plant, scene_graph, each.robot, each.start or (0.0, 0.0, 0.0), name=f"{each.name}_")
        for each in robots
    ]
    add_collars(plant, scene_graph, robots, models)
    ground = add_ground(plant, world.extent)
    add_world(plant, world)
    plant.Finalize()
    if world.model is not None:
        drop_floors(plant, scene_graph, ground)
    interfaces = [
        RobotInterface(plant, scene_graph, model, each, seed=seed)
        for each, model, seed in zip(robots, models, seeds, strict=True)
    ]
    warn_of_unseen(plant, scene_graph, world, interfaces)
    return interfaces


def _add_navigator(
    builder: DiagramBuilder, interface: RobotInterface, world: World, seed: int, others: list[GeometryId]
) -> SimulatedRobot:
    """Add what drives a robot of the plant, and what checks its contacts, also with the geometries of other robots."""
    scenario, plant, scene_graph = interface.scenario, interface.plant, interface.scene_graph
    stopwatch = Stopwatch()
    navigator = RobotNavigator(scenario, interface, world, seed, stopwatch)
    navigator = builder.AddNamedSystem(scenario.name, navigator)
    connect_robot(builder, plant, scene_graph, interface.model, navigator)
    monitor = CollisionMonitor(
        robot=interface.robot_geometries,
        ground=interface.floor,
        moving_obstacles=others,
        footprint=scenario.robot.shape,
        period=1.0 / scenario.controller.rate,
    )
    monitor = builder.AddNamedSystem(f"collision_monitor_of_{scenario.name}", monitor)
    builder.Connect(scene_graph.get_query_output_port(), monitor.GetInputPort("geometry_query"))
    builder.Connect(navigator.GetOutputPort("localization.state"), monitor.GetInputPort("state"))
    ports = plant.get_state_output_port(interface.model), navigator.GetOutputPort("twist_command")
    logs = [LogVectorOutput(port, builder, {TriggerType.kPerStep}) for port in ports]
    return SimulatedRobot(navigator.navigation, monitor, logs, stopwatch, [])
