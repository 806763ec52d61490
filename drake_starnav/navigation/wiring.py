"""Adds the systems of a navigation loop to a builder, and wires them."""

import dataclasses
from typing import Any

from pydrake.common.value import Value
from pydrake.systems.framework import DiagramBuilder, OutputPort, System
from pydrake.systems.primitives import ConstantValueSource

from drake_starnav.control import follow_guidance
from drake_starnav.errors import StarnavError, check_kind, counted
from drake_starnav.lidar.sensor_model import LidarParameters
from drake_starnav.localization.scan_matching import OdometryError
from drake_starnav.navigation.loop_config import LoopConfig
from drake_starnav.navigation.parts import AS_DECLARED, Navigation, Parts, find_function
from drake_starnav.navigation.robot import robot_world, scan_ports
from drake_starnav.navigation.sources import find_control_sources
from drake_starnav.navigation.validation import (
    check_and_derive_margins,
    check_interface,
    check_lidar_on_axis,
    check_own_plant,
    check_start,
    check_time_step,
)
from drake_starnav.planning import Guidance
from drake_starnav.safety.certificates import Certificate
from drake_starnav.safety.zones import KeepOut
from drake_starnav.scenario.schema import Scenario
from drake_starnav.station.navigation_station import NavigationStation, StationInterface
from drake_starnav.station.robot_interface import RobotInterface
from drake_starnav.surroundings.perception import perceive
from drake_starnav.systems.connecting import add_system, connect, connect_inputs, find_output_port, list_outputs
from drake_starnav.systems.controller import Controller
from drake_starnav.systems.dsm_controller import DsmController
from drake_starnav.systems.fixed_goal import FixedGoal
from drake_starnav.systems.goal_sequence import GoalSequence
from drake_starnav.systems.obstacle_tracker import ObstacleTracker
from drake_starnav.systems.scan_matcher import ScanMatcher
from drake_starnav.systems.star_perception import StarPerception, lidar_names
from drake_starnav.systems.star_roadmap_planner import StarRoadmapPlanner
from drake_starnav.systems.twist_shield import TwistShield, Unshielded
from drake_starnav.utils.stopwatch import Stopwatch
from drake_starnav.worlds.solvable import check_free
from drake_starnav.worlds.world import World

SYSTEMS = (
    "goal", "perception", "planner", "tracker", "matcher", "controller", "shield", "jump_guard", "predictor",
    "known_world",
)  # fmt: skip
"""Names that `add_navigation` gives, beside the station's."""


def add_navigation(
    builder: DiagramBuilder,
    scenario: Scenario,
    parts: Parts = AS_DECLARED,
    seed: int = 0,
    *,
    stopwatch: Stopwatch | None = None,
) -> Navigation:
    """Add the station, perception, planner, controller and shield of a scenario to a builder, and wire them.

    The lidar scans at multiples of its period, in an unrestricted update. What follows from a scan, the plan included,
    is calculated when something first asks for it, see `ScanState`. Drake executes unrestricted updates before the
    discrete ones of the same instant: the controller's sees the new scan and the plan from it.

    Margins, the certificate and the perception allow for the faults that the scenario declares; see `derive_margins`.

    Args:
        parts: of your own, in the place of the scenario's.
        seed: of the world and of the sensor's noise.
        stopwatch: records wall-clock times, if given.

    Raises:
        StarnavError: the lidar sees too little; the start lies in an obstacle; the station was made with other
            parameters; the builder has systems of the same names; or your system has not the ports it needs.
    """
    check_kind(scenario, Scenario, "scenario", "as from load_scenario")
    check_kind(parts, Parts, "parts", "of your own")
    scenario = _adopt_time_step(scenario, parts)
    parts = parts.of_method(scenario)
    _check_parts(scenario, parts)
    _check_names(builder, parts)
    world = _check_world(scenario, parts, seed)
    station = parts.station or builder.AddNamedSystem("station", NavigationStation(world, scenario, seed=seed))
    config = LoopConfig(scenario, check_and_derive_margins(scenario, station.mounts, parts.certified), parts, stopwatch)
    _check_station(config, station, world)
    goal = add_system(builder, "goal", parts.goal or _read_goal(scenario, world), "goal")
    navigation = Navigation(world, station, goal)
    own_controller = _make_own_system(parts.controller)
    if _asks_for_planning(parts, own_controller, navigation):
        navigation = _add_planning(builder, config, _add_perception(builder, config, navigation))
    if isinstance(goal, GoalSequence):
        connect_inputs(builder, goal, {"state": navigation.localization("state")}, "goal")
    return _add_control(builder, config, navigation, own_controller)


def _adopt_time_step(scenario: Scenario, parts: Parts) -> Scenario:
    """Return the scenario with the time step of a station of the user's, whose plant is made already."""
    if not isinstance(parts.station, StationInterface):
        return scenario
    time_step = parts.station.scenario.simulation.time_step
    return dataclasses.replace(scenario, simulation=dataclasses.replace(scenario.simulation, time_step=time_step))


def _check_station(config: LoopConfig, station: System, world: World) -> None:
    """Raise a `StarnavError` where a plant of the user's, its time step or the start does not suit."""
    if isinstance(config.parts.station, RobotInterface):
        check_own_plant(config.parts.station, world)
    if isinstance(station, StationInterface):
        check_time_step(station.robot_interface)
        if config.parts.certified:
            check_start(world, config.scenario, station.mounts, config.margins.safety)


def _asks_for_planning(parts: Parts, own_controller: System | None, navigation: Navigation) -> bool:
    """Whether anything reads what perception or planner say: not so for a lone controller that knows other inputs."""
    if parts.certified or parts.planner is not None or parts.perception is not None or own_controller is None:
        return True
    inputs = {own_controller.get_input_port(k).get_name() for k in range(own_controller.num_input_ports())}
    return not inputs <= {*navigation.signals, "twist_command", "world"}


def _make_own_system(part: Any) -> System | None:
    """Return a part of the user's, unless it is a function for a system of ours."""
    return None if find_function(part) is not None else part


def _read_goal(scenario: Scenario, world: World) -> System:
    if not scenario.goals:
        return FixedGoal(world.goal)
    for k, goal in enumerate(scenario.goals):
        check_free(world, goal, scenario.robot.shape, f"goals[{k}]")
    robot, tolerance, period = scenario.robot, scenario.simulation.goal_tolerance, 1.0 / scenario.controller.rate
    return GoalSequence(scenario.goals, tolerance=tolerance, period=period, footprint=robot.shape, base=robot.drive)


def _check_parts(scenario: Scenario, parts: Parts) -> None:
    """Raise a `StarnavError` where a scenario is one of several robots, or excludes systems of the user's."""
    if scenario.robots:
        raise StarnavError(
            f"scenario {scenario.name} has {counted(len(scenario.robots), 'robot')}; allowed: one of them, or all of "
            "them by starnav simulate or simulation.robots.run_robots"
        )
    certificates = parts.certificates if parts.shield is None else ()
    if certificates and not parts.certified:
        raise StarnavError("certificates of your own with parts that are not certified; allowed: certified=True")
    if scenario.zones and not (parts.shield is None and parts.certified):
        own_shield = "a shield of your own" if parts.certified else f"method {scenario.method}"
        raise StarnavError(f"zones with {own_shield}, which does not keep them; allowed: star, behind its own shield")


def _check_names(builder: DiagramBuilder, parts: Parts) -> None:
    """Raise a `StarnavError` where the builder has other systems of the names that are to be given."""
    own = parts.goal, parts.perception, parts.planner, parts.controller, parts.shield
    for name in SYSTEMS if parts.station is not None else (*SYSTEMS, "station"):
        if builder.HasSubsystemNamed(name) and builder.GetSubsystemByName(name) not in own:
            raise StarnavError(
                f"the builder has a system named {name} already; allowed: one navigation a builder, without systems of "
                "these names (several robots each have a diagram of their own: scripts/examples/07_two_robots.py)"
            )


def _check_world(scenario: Scenario, parts: Parts, seed: int) -> World:
    """The world to drive in, of the scenario or the user's own; the user's station is checked too."""
    if parts.station is not None:
        check_interface(scenario, parts.station)
    if parts.world is None and parts.station is not None and scenario.world is None:
        return World(scenario.name, (0.0, 0.0, 0.0), (1.0, 0.0))
    if parts.world is None:
        return robot_world(scenario, seed)
    if parts.station is None or isinstance(parts.station, StationInterface):
        check_free(parts.world, parts.world.start, scenario.robot.shape, f"world {parts.world.name}.start")
    return parts.world


def _make_shield(config: LoopConfig) -> System:
    robot, controller = config.scenario.robot, config.scenario.controller
    if not config.parts.certified:
        return Unshielded(robot, controller, stopwatch=config.stopwatch)
    return TwistShield(
        robot,
        controller,
        config.margins,
        certificates=_make_zones(config) + config.parts.certificates,
        obstacles=config.obstacles,
        state_lead=config.state_lead,
        stopwatch=config.stopwatch,
    )


def _make_zones(config: LoopConfig) -> tuple[Certificate, ...]:
    """The scenario's zones that are not among the user's certificates."""
    return tuple(zone for zone in config.scenario.zones if zone not in config.parts.certificates)


def _add_perception(builder: DiagramBuilder, config: LoopConfig, navigation: Navigation) -> Navigation:
    """Add what processes scans: tracker and matcher where they are declared, and perception."""
    scans = scan_ports(navigation.station)
    if config.obstacles is not None:
        navigation = _add_tracker(builder, config, navigation)
        assert navigation.tracker is not None
        scans = [navigation.tracker.GetOutputPort(name) for name in lidar_names("scan", len(scans))]
    own = _make_own_system(config.parts.perception)
    perception = own or StarPerception(
        config.scenario.robot,
        config.margins,
        _make_worst_case_lidar(config.scenario),
        mounts=navigation.station.mounts,
        certifies=config.parts.certified,
        perceive=find_function(config.parts.perception) or perceive,
        stopwatch=config.stopwatch,
    )
    perception = add_system(builder, "perception", perception, "perception")
    for name in ("observation", "surroundings"):
        find_output_port(perception, name, None, "perception")
    sources = dict(zip(lidar_names("scan", len(scans)), scans, strict=True))
    if own is None:
        sources["pose"] = navigation.localization("scan_pose")  # that of the scan, as our perception calls it
    connect_inputs(builder, perception, navigation.signals | sources, "perception")
    navigation = dataclasses.replace(navigation, perception=perception)
    return _add_matcher(builder, config, navigation) if config.matches else navigation


def _add_tracker(builder: DiagramBuilder, config: LoopConfig, navigation: Navigation) -> Navigation:
    """Add what tracks moving obstacles in the scans, and tells which hits are of them."""
    assert config.obstacles is not None
    lidar, mounts = _make_worst_case_lidar(config.scenario), navigation.station.mounts
    tracker = ObstacleTracker(config.obstacles, lidar, mounts, stopwatch=config.stopwatch)
    builder.AddNamedSystem("tracker", tracker)
    for name, scan in zip(lidar_names("scan", len(mounts)), scan_ports(navigation.station), strict=True):
        builder.Connect(scan, tracker.GetInputPort(name))
    builder.Connect(navigation.localization("scan_pose"), tracker.GetInputPort("pose"))
    return dataclasses.replace(navigation, tracker=tracker)


def _add_matcher(builder: DiagramBuilder, config: LoopConfig, navigation: Navigation) -> Navigation:
    """Add what corrects the pose by the scans."""
    scenario, perception = config.scenario, navigation.perception
    assert perception is not None
    localization, radius = scenario.localization, scenario.robot.shape.cover_radius
    error = OdometryError(localization.drift, localization.jump, _make_worst_case_lidar(scenario).noise, radius)
    matcher = builder.AddNamedSystem("matcher", ScanMatcher(error))
    for name in ("observation", "surroundings"):
        builder.Connect(perception.GetOutputPort(name), matcher.GetInputPort(name))
    for name in ("state", "scan_pose"):
        builder.Connect(navigation.localization(name), matcher.GetInputPort(name))
    return dataclasses.replace(navigation, matcher=matcher)


def _make_worst_case_lidar(scenario: Scenario) -> LidarParameters:
    """The first lidar, with the rate of the slowest, and the noise and the outliers of the one that has most."""
    lidars = scenario.all_lidars
    noise, outliers = max(lidar.noise for lidar in lidars), max(lidar.outliers for lidar in lidars)
    return dataclasses.replace(lidars[0], rate=min(lidar.rate for lidar in lidars), noise=noise, outliers=outliers)


def _add_planning(builder: DiagramBuilder, config: LoopConfig, navigation: Navigation) -> Navigation:
    scenario, parts, matcher = config.scenario, config.parts, navigation.matcher
    rules = *_make_zones(config), *parts.certificates
    planner = _make_own_system(parts.planner) or StarRoadmapPlanner(
        scenario.robot,
        scenario.planner,
        config.margins,
        goal_tolerance=scenario.simulation.goal_tolerance,
        step=find_function(parts.planner),
        keep_outs=[rule for rule in rules if isinstance(rule, KeepOut)],
        stopwatch=config.stopwatch,
    )
    planner = add_system(builder, "planner", planner, "planner")
    if "guidance" in list_outputs(planner) and parts.controller is None:
        guidance_value = find_output_port(planner, "guidance", None, "planner").Allocate().get_value()
        check_kind(guidance_value, Guidance, "planner: output port guidance", "whose path a controller follows")
    connect_inputs(builder, planner, navigation.signals, "planner")
    if matcher is not None and "guidance" in list_outputs(planner):
        connect(builder, planner.GetOutputPort("guidance"), matcher.GetInputPort("guidance"), "planner")
    return dataclasses.replace(navigation, planner=planner)


def _add_control(
    builder: DiagramBuilder, config: LoopConfig, navigation: Navigation, own_controller: System | None
) -> Navigation:
    """Add controller and shield, and connect them with each other, the station and the matcher."""
    station, matcher = navigation.station, navigation.matcher
    controller = add_system(builder, "controller", own_controller or _make_controller(config), "controller")
    if isinstance(controller, Controller):
        if controller.needs_lidar_on_axis:
            check_lidar_on_axis(config.scenario, station.mounts)
        controller.stopwatch = controller.stopwatch or config.stopwatch
    shield = add_system(builder, "shield", config.parts.shield or _make_shield(config), "shield")
    navigation = dataclasses.replace(navigation, controller=controller, shield=shield)
    _connect_control(builder, config, navigation)
    connect(builder, navigation.twist_command, station.GetInputPort("drive.twist_command"), "shield")
    if matcher is not None and "certificate" in list_outputs(shield):
        builder.Connect(shield.GetOutputPort("certificate"), matcher.GetInputPort("certificate"))
    return navigation


def _connect_control(builder: DiagramBuilder, config: LoopConfig, navigation: Navigation) -> None:
    """Connect the inputs of the controller, be it of the user's own or not, and of the shield."""
    assert navigation.controller is not None and navigation.shield is not None
    sources = {"twist_command": navigation.twist_command} | find_control_sources(builder, config, navigation)
    own = navigation.controller is config.parts.controller
    if not own and "guidance" not in sources:
        names = ", ".join(list_outputs(navigation.planner)) or "none"
        raise StarnavError(f"planner has the output ports {names}; allowed: one named guidance, or your own controller")
    controller_sources = _find_own_sources(builder, navigation) if own else sources
    connect_inputs(builder, navigation.controller, controller_sources, "controller")
    sources["desired_twist"] = find_output_port(
        navigation.controller, "desired_twist", navigation.twist_size, "controller"
    )
    connect_inputs(builder, navigation.shield, sources, "shield")


def _find_own_sources(builder: DiagramBuilder, navigation: Navigation) -> dict[str, OutputPort]:
    """What a controller of the user's may read; the world only if it asks for it."""
    assert navigation.controller is not None and navigation.twist_command is not None
    sources = navigation.signals | {"twist_command": navigation.twist_command}
    if navigation.controller.HasInputPort("world"):
        source = builder.AddNamedSystem("known_world", ConstantValueSource(Value(navigation.world)))
        sources["world"] = source.get_output_port()
    return sources


def _make_controller(config: LoopConfig) -> DsmController:
    return DsmController(
        config.scenario.robot,
        config.scenario.controller,
        config.margins,
        propose=find_function(config.parts.controller) or follow_guidance,
        obstacles=config.obstacles,
        state_lead=config.state_lead,
        stopwatch=config.stopwatch,
    )
