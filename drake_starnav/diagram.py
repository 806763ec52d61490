"""The whole navigation loop as one Drake diagram."""

from dataclasses import dataclass

from pydrake.systems.framework import Diagram, DiagramBuilder
from pydrake.systems.primitives import ConstantVectorSource

from drake_starnav.scenario import Scenario
from drake_starnav.station import NavigationStation
from drake_starnav.stopwatch import Stopwatch
from drake_starnav.systems.certified_controller import CertifiedController
from drake_starnav.systems.dsm_controller import DsmController
from drake_starnav.systems.model_world import make_world_with_footprints
from drake_starnav.systems.mpc_controller import MpcController
from drake_starnav.systems.star_perception import StarPerception
from drake_starnav.systems.star_roadmap_planner import StarRoadmapPlanner
from drake_starnav.worlds.world import World

CONTROLLERS: dict[str, type[CertifiedController]] = {"modulation": DsmController, "predictive": MpcController}
"""By `controller.law`."""


@dataclass(frozen=True)
class Navigation:
    """The systems that `add_navigation` put into a builder, for connecting more to them."""

    world: World
    station: NavigationStation
    goal: ConstantVectorSource
    perception: StarPerception
    planner: StarRoadmapPlanner
    controller: CertifiedController


def add_navigation(
    builder: DiagramBuilder,
    scenario: Scenario,
    *,
    seed: int = 0,
    world: World | None = None,
    stopwatch: Stopwatch | None = None,
) -> Navigation:
    """Add the station, perception, planner and controller of a scenario to a builder, and wire them.

    The lidar scans at multiples of its period; perception follows one step of the plant later, the planner two, and
    the controller's updates lie between, so that each reads what the one before it has finished.

    Args:
        builder: to which the systems are added.
        scenario: the parameters.
        seed: of the world and of the sensor's noise.
        world: in which to drive, instead of the scenario's.
        stopwatch: where wall-clock times are noted, if anywhere.
    """
    if world is None:
        world = make_world_with_footprints(scenario.world, seed, scenario.robot.radius)
    step = scenario.simulation.time_step
    robot, planner_parameters, controller_parameters = scenario.robot, scenario.planner, scenario.controller
    station = builder.AddNamedSystem(
        "station", NavigationStation(world, robot, scenario.lidar, time_step=step, seed=seed)
    )
    goal = builder.AddNamedSystem("goal", ConstantVectorSource(world.goal))
    perception = builder.AddNamedSystem(
        "perception",
        StarPerception(
            robot,
            planner_parameters,
            controller_parameters,
            rate=scenario.lidar.rate,
            offset=step,
            stopwatch=stopwatch,
        ),
    )
    planner = builder.AddNamedSystem(
        "planner", StarRoadmapPlanner(robot, planner_parameters, offset=2 * step, stopwatch=stopwatch)
    )
    law = CONTROLLERS[controller_parameters.law]
    controller = builder.AddNamedSystem(
        "controller", law(robot, controller_parameters, offset=2 * step, stopwatch=stopwatch)
    )
    for source, name, system, port in (
        (station, "lidar.scan", perception, "scan"),
        (station, "localization.scan_pose", perception, "pose"),
        (perception, "star", planner, "star"),
        (station, "localization.pose", planner, "pose"),
        (planner, "guidance", controller, "guidance"),
        (perception, "safety_star", controller, "safety_star"),
        (station, "localization.state", controller, "state"),
        (controller, "twist_command", station, "drive.twist_command"),
    ):
        builder.Connect(source.GetOutputPort(name), system.GetInputPort(port))
    builder.Connect(goal.get_output_port(), planner.GetInputPort("goal"))
    return Navigation(world, station, goal, perception, planner, controller)


def make_diagram(scenario: Scenario, *, seed: int = 0, world: World | None = None) -> Diagram:
    """The built diagram of a scenario: simulate it, or add it to a builder of your own.

    It exports the planner's, the controller's and the station's outputs under dotted names: `planner.guidance`,
    `planner.short_term_goal`, `planner.roadmap`, `planner.status`, `controller.twist_command`,
    `controller.guiding_vector`, `controller.certificate`, and all of the station's.

    Args:
        scenario: the parameters, as from `load_scenario`.
        seed: of the world and of the sensor's noise.
        world: in which to drive, instead of the scenario's.
    """
    builder = DiagramBuilder()
    navigation = add_navigation(builder, scenario, seed=seed, world=world)
    for name, system in (("planner", navigation.planner), ("controller", navigation.controller)):
        for index in range(system.num_output_ports()):
            port = system.get_output_port(index)
            builder.ExportOutput(port, f"{name}.{port.get_name()}")
    for index in range(navigation.station.num_output_ports()):
        port = navigation.station.get_output_port(index)
        builder.ExportOutput(port, port.get_name())
    diagram = builder.Build()
    diagram.set_name(scenario.name)
    return diagram
