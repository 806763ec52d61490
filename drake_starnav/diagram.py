"""The whole navigation loop as one Drake diagram."""

from dataclasses import dataclass

from pydrake.common.value import Value
from pydrake.systems.framework import Diagram, DiagramBuilder, LeafSystem
from pydrake.systems.primitives import ConstantValueSource, ConstantVectorSource

from drake_starnav.baselines import known_obstacles
from drake_starnav.errors import UnsupportedError
from drake_starnav.scenario import Scenario
from drake_starnav.station import NavigationStation, RobotEquipment
from drake_starnav.stopwatch import Stopwatch
from drake_starnav.systems.baseline_controller import BaselineController
from drake_starnav.systems.certified_controller import CertifiedController
from drake_starnav.systems.dsm_controller import DsmController
from drake_starnav.systems.model_world import make_world_with_footprints
from drake_starnav.systems.mpc_controller import MpcController
from drake_starnav.systems.star_perception import StarPerception
from drake_starnav.systems.star_roadmap_planner import StarRoadmapPlanner
from drake_starnav.worlds.world import World

CERTIFIED: dict[str, type[CertifiedController]] = {"star": DsmController, "mpc": MpcController}
"""By `controller.kind`: those that follow the planner's guidance; the others are baselines."""


@dataclass(frozen=True)
class Navigation:
    """The systems that `add_navigation` put into a builder, for connecting more to them.

    A baseline that heads for the goal itself has neither perception nor planner.
    """

    world: World
    station: NavigationStation | RobotEquipment
    goal: LeafSystem
    perception: StarPerception | None
    planner: StarRoadmapPlanner | None
    controller: CertifiedController | BaselineController


def add_navigation(
    builder: DiagramBuilder,
    scenario: Scenario,
    *,
    seed: int = 0,
    world: World | None = None,
    station: NavigationStation | RobotEquipment | None = None,
    stopwatch: Stopwatch | None = None,
    goal: LeafSystem | None = None,
) -> Navigation:
    """Add the station, perception, planner and controller of a scenario to a builder, and wire them.

    The lidar scans at multiples of its period; perception follows one step of the plant later, the planner two, and
    the controller's updates lie between, so that each reads what the one before it has finished.

    Args:
        builder: to which the systems are added.
        scenario: the parameters.
        seed: of the world and of the sensor's noise.
        world: in which to drive, instead of the scenario's.
        station: already in the builder, instead of a new one: e.g. the equipment of one of several robots in a plant.
        stopwatch: where wall-clock times are noted, if anywhere.
        goal: whose only output is the goal, (x, y) in W, m, instead of the world's.

    Raises:
        UnsupportedError: the controller must know all obstacles as circles, and the world has others.
    """
    if world is None:
        world = make_world_with_footprints(scenario.world, seed, scenario.robot.radius)
    step = scenario.simulation.time_step
    if station is None:
        station = builder.AddNamedSystem(
            "station", NavigationStation(world, scenario.robot, scenario.lidar, time_step=step, seed=seed)
        )
    goal = builder.AddNamedSystem("goal", goal or ConstantVectorSource(world.goal))
    perception: StarPerception | None = None
    planner: StarRoadmapPlanner | None = None
    controller: CertifiedController | BaselineController
    if scenario.controller.kind in CERTIFIED:
        perception, planner = _add_planning(builder, scenario, station, goal, stopwatch)
        controller = _add_certified_controller(builder, scenario, station, perception, planner, stopwatch)
    else:
        if scenario.controller.target == "short_term_goal":
            perception, planner = _add_planning(builder, scenario, station, goal, stopwatch)
        controller = _add_baseline(builder, scenario, world, station, goal, planner, stopwatch)
    builder.Connect(controller.GetOutputPort("twist_command"), station.GetInputPort("drive.twist_command"))
    return Navigation(world, station, goal, perception, planner, controller)


def _add_planning(
    builder: DiagramBuilder,
    scenario: Scenario,
    station: NavigationStation | RobotEquipment,
    goal: LeafSystem,
    stopwatch: Stopwatch | None,
) -> tuple[StarPerception, StarRoadmapPlanner]:
    step = scenario.simulation.time_step
    perception = builder.AddNamedSystem(
        "perception",
        StarPerception(
            scenario.robot,
            scenario.planner,
            scenario.controller,
            rate=scenario.lidar.rate,
            offset=step,
            stopwatch=stopwatch,
        ),
    )
    planner = builder.AddNamedSystem(
        "planner", StarRoadmapPlanner(scenario.robot, scenario.planner, offset=2 * step, stopwatch=stopwatch)
    )
    for source, name, system, port in (
        (station, "lidar.scan", perception, "scan"),
        (station, "localization.scan_pose", perception, "pose"),
        (perception, "star", planner, "star"),
        (station, "localization.pose", planner, "pose"),
    ):
        builder.Connect(source.GetOutputPort(name), system.GetInputPort(port))
    builder.Connect(goal.get_output_port(), planner.GetInputPort("goal"))
    return perception, planner


def _add_certified_controller(
    builder: DiagramBuilder,
    scenario: Scenario,
    station: NavigationStation | RobotEquipment,
    perception: StarPerception,
    planner: StarRoadmapPlanner,
    stopwatch: Stopwatch | None,
) -> CertifiedController:
    offset = 2 * scenario.simulation.time_step
    controller = builder.AddNamedSystem(
        "controller",
        CERTIFIED[scenario.controller.kind](scenario.robot, scenario.controller, offset=offset, stopwatch=stopwatch),
    )
    for source, name, port in (
        (planner, "guidance", "guidance"),
        (perception, "safety_star", "safety_star"),
        (station, "localization.state", "state"),
    ):
        builder.Connect(source.GetOutputPort(name), controller.GetInputPort(port))
    return controller


def _add_baseline(
    builder: DiagramBuilder,
    scenario: Scenario,
    world: World,
    station: NavigationStation | RobotEquipment,
    goal: LeafSystem,
    planner: StarRoadmapPlanner | None,
    stopwatch: Stopwatch | None,
) -> BaselineController:
    """Add a baseline; it reads the same scans at the same times as the star controller."""
    kind, offset = scenario.controller.kind, 2 * scenario.simulation.time_step
    settings = getattr(scenario, kind)
    controller = builder.AddNamedSystem(
        "controller",
        BaselineController(scenario.robot, scenario.controller, settings, offset=offset, stopwatch=stopwatch),
    )
    builder.Connect(goal.get_output_port(), controller.GetInputPort("goal"))
    for name, port in (
        ("lidar.scan", "scan"),
        ("localization.scan_pose", "scan_pose"),
        ("localization.state", "state"),
    ):
        builder.Connect(station.GetOutputPort(name), controller.GetInputPort(port))
    if planner is not None:
        builder.Connect(planner.GetOutputPort("short_term_goal"), controller.GetInputPort("short_term_goal"))
    if kind == "dsm":
        count = len(world.polygons)
        if count or world.model is not None:
            what = f"{count} polygon{'s' * (count > 1)}" if count else "a model file"
            raise UnsupportedError(
                f"controller.kind dsm in world {world.name}, which has {what}; "
                "allowed: a world of cylinders and spheres, whose obstacles it can know as circles"
            )
        known = known_obstacles(world.discs, world.bounds, scenario.robot.radius + scenario.dsm.margin)
        source = builder.AddNamedSystem("known_obstacles", ConstantValueSource(Value(known)))
        builder.Connect(source.get_output_port(), controller.GetInputPort("obstacles"))
    return controller


def make_diagram(scenario: Scenario, *, seed: int = 0, world: World | None = None) -> Diagram:
    """The built diagram of a scenario: simulate it, or add it to a builder of your own.

    It exports the planner's, the controller's and the station's outputs under dotted names: `planner.guidance`,
    `planner.short_term_goal`, `planner.roadmap`, `planner.status` (if there is a planner), `controller.twist_command`,
    `controller.guiding_vector`, `controller.certificate`, and all of the station's.

    Args:
        scenario: the parameters, as from `load_scenario`.
        seed: of the world and of the sensor's noise.
        world: in which to drive, instead of the scenario's.
    """
    builder = DiagramBuilder()
    navigation = add_navigation(builder, scenario, seed=seed, world=world)
    for name, system in (("planner", navigation.planner), ("controller", navigation.controller)):
        if system is None:
            continue
        for index in range(system.num_output_ports()):
            port = system.get_output_port(index)
            builder.ExportOutput(port, f"{name}.{port.get_name()}")
    for index in range(navigation.station.num_output_ports()):
        port = navigation.station.get_output_port(index)
        builder.ExportOutput(port, port.get_name())
    diagram = builder.Build()
    diagram.set_name(scenario.name)
    return diagram
