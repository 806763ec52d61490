"""The whole navigation loop as one Drake diagram."""

import dataclasses
from dataclasses import dataclass
from typing import NamedTuple

from pydrake.common.value import Value
from pydrake.systems.framework import Diagram, DiagramBuilder, LeafSystem, OutputPort
from pydrake.systems.primitives import ConstantValueSource, ConstantVectorSource, ZeroOrderHold

from drake_starnav.baselines import known_obstacles, paper
from drake_starnav.baselines.sampling_mpc import predictive_step
from drake_starnav.control import Law, control_step
from drake_starnav.control.parameters import GUIDED
from drake_starnav.errors import StarnavError, UnsupportedError
from drake_starnav.localization.scan_matching import UNSEEN_JUMP, OdometryError
from drake_starnav.planning import PlanStep, plan_step
from drake_starnav.regions.perception import Perceive, perceive
from drake_starnav.scenario import Scenario
from drake_starnav.scenario.margins import with_margins
from drake_starnav.station.model_world import make_world_with_footprints
from drake_starnav.station.navigation_station import STATION_OUTPUTS, NavigationStation, Station
from drake_starnav.station.robot_interface import RobotInterface, delay_steps
from drake_starnav.systems.baseline_controller import BaselineController
from drake_starnav.systems.certified_controller import CertifiedController
from drake_starnav.systems.jump_guard import JumpGuard
from drake_starnav.systems.obstacle_tracker import ObstacleTracker
from drake_starnav.systems.scan_matcher import ScanMatcher
from drake_starnav.systems.star_perception import StarPerception
from drake_starnav.systems.star_roadmap_planner import StarRoadmapPlanner
from drake_starnav.systems.state_predictor import StatePredictor
from drake_starnav.utils.stopwatch import Stopwatch
from drake_starnav.validation import check_interface, validate
from drake_starnav.worlds.endpoints import check_free_ends
from drake_starnav.worlds.world import World


class Method(NamedTuple):
    """The functions of a method that follows the planner's guidance."""

    law: Law
    perceive: Perceive = perceive
    step: PlanStep = plan_step


METHODS = {
    "star": Method(control_step),
    "mpc": Method(predictive_step),
    "star_paper": Method(paper.control_step, paper.perceive, paper.plan_step),
}
"""By `controller.kind`, of GUIDED."""
SYSTEMS = (
    "goal", "perception", "planner", "tracker", "matcher", "controller", "jump_guard", "predictor", "known_obstacles",
    "command_hold",
)  # fmt: skip
"""Names that `add_navigation` gives, beside the station's."""


@dataclass(frozen=True)
class Navigation:
    """The systems that `add_navigation` put into a builder, for connecting more to them.

    A baseline that heads for the goal itself has neither perception nor planner. There is a tracker if the scenario
    declares obstacles that move, and a matcher if it declares that the believed pose errs.
    """

    world: World
    station: NavigationStation | Station | RobotInterface
    goal: LeafSystem
    perception: StarPerception | None
    planner: StarRoadmapPlanner | None
    controller: CertifiedController | BaselineController
    tracker: ObstacleTracker | None = None
    matcher: ScanMatcher | None = None

    def localization(self, name: str) -> OutputPort:
        """The port `pose`, `state` or `scan_pose` in the world frame of planner and goal."""
        if self.matcher is not None:
            return self.matcher.GetOutputPort(name)
        return self.station.GetOutputPort(f"localization.{name}")

    @property
    def certificate(self) -> OutputPort:
        """The port of the controller's certificate, in the same frame."""
        return (self.matcher or self.controller).GetOutputPort("certificate")


def add_navigation(
    builder: DiagramBuilder,
    scenario: Scenario,
    *,
    seed: int = 0,
    world: World | None = None,
    station: NavigationStation | Station | RobotInterface | None = None,
    stopwatch: Stopwatch | None = None,
    goal: LeafSystem | None = None,
) -> Navigation:
    """Add the station, perception, planner and controller of a scenario to a builder, and wire them.

    The lidar scans at multiples of its period; perception follows one tick (`simulation.time_step`) later, planner and
    controller two, so that each reads the finished result of the one before it: of simultaneous updates Drake executes
    the unrestricted ones, such as the planner's, before the discrete ones, such as the controller's. If obstacles move,
    the tracker takes the first of these steps and the others follow one later.

    Margins, the certificate and the perception allow for the faults that the scenario declares; see `margins`.

    Args:
        builder: to which the systems are added.
        scenario: the parameters.
        seed: of the world and of the sensor's noise.
        world: in which to drive, instead of the scenario's.
        station: already in the builder, as by `add_station`, instead of a `NavigationStation`; or the equipment of one
            of several robots in a plant.
        stopwatch: records wall-clock times, if given.
        goal: whose only output is the goal, (x, y) in W, m, instead of the world's; in the builder already, or not.

    Raises:
        UnsupportedError: the controller must know all obstacles as circles, and the world has others; or it does not
            do what the scenario asks of it.
        StarnavError: the lidar sees too little; the start lies in an obstacle; the station was made with other
            parameters; or the builder has systems of the same names.
    """
    validate(scenario)
    for name in SYSTEMS if station is not None else (*SYSTEMS, "station"):
        if builder.HasSubsystemNamed(name):
            raise StarnavError(
                f"the builder has a system named {name} already; allowed: one navigation a builder, without systems of "
                "these names (several robots each have a diagram of their own: scripts/examples/07_two_robots.py)"
            )
    if station is not None:
        check_interface(scenario, station)
    if world is None:
        world = make_world_with_footprints(scenario.world, seed, scenario.robot.radius)
    elif station is None:
        check_free_ends(world, scenario.robot.radius, f"world {world.name}", ("start",))
    step = scenario.simulation.time_step
    planner_parameters, controller_parameters = with_margins(scenario)
    scenario = dataclasses.replace(scenario, planner=planner_parameters, controller=controller_parameters)
    if station is None:
        station = builder.AddNamedSystem(
            "station",
            NavigationStation(
                world,
                scenario.robot,
                scenario.lidar,
                localization=scenario.localization,
                drive=scenario.drive,
                time_step=step,
                seed=seed,
            ),
        )
    if goal is None or goal not in builder.GetSystems():
        goal = builder.AddNamedSystem("goal", goal or ConstantVectorSource(world.goal))
    perception: StarPerception | None = None
    planner: StarRoadmapPlanner | None = None
    tracker: ObstacleTracker | None = None
    matcher: ScanMatcher | None = None
    controller: CertifiedController | BaselineController
    if scenario.controller.kind in GUIDED:
        perception, planner, tracker, matcher = _add_planning(builder, scenario, station, goal, stopwatch)
        controller = _add_certified_controller(
            builder, scenario, station, perception, matcher or planner, tracker, stopwatch
        )
    else:
        if scenario.controller.target == "short_term_goal":
            perception, planner, tracker, _ = _add_planning(builder, scenario, station, goal, stopwatch)
        controller = _add_baseline(builder, scenario, world, station, goal, planner, stopwatch)
    command, equipment = controller.GetOutputPort("twist_command"), _equipment(station)
    if equipment.continuous:  # a discrete plant takes a command up at its next step, and so it is certified
        period, offset = 1.0 / scenario.controller.rate, _command_offset(scenario) + step
        hold = builder.AddNamedSystem("command_hold", ZeroOrderHold(period, 2, offset))
        builder.Connect(command, hold.get_input_port())
        command = hold.get_output_port()
    builder.Connect(command, station.GetInputPort("drive.twist_command"))
    if matcher is not None:
        builder.Connect(controller.GetOutputPort("certificate"), matcher.GetInputPort("certificate"))
    return Navigation(world, station, goal, perception, planner, controller, tracker, matcher)


@dataclass(frozen=True)
class _Schedule:
    """First update of each system, s, one tick after its inputs; None for a system that is absent."""

    tracker: float | None
    perception: float
    matcher: float | None
    last: float

    @staticmethod
    def of(scenario: Scenario) -> "_Schedule":
        step, lidar = scenario.simulation.time_step, scenario.lidar
        moving, matching = _tracks(scenario), _matches(scenario)
        first = step + lidar.release_offset
        perception = first + step if moving else first
        return _Schedule(
            tracker=first if moving else None,
            perception=perception,
            matcher=perception + step if matching else None,
            last=(2 + moving + matching) * step,
        )


def _command_offset(scenario: Scenario) -> float:
    """When the controller is first updated, s."""
    if scenario.controller.kind in GUIDED:
        return _Schedule.of(scenario).last
    return 2 * scenario.simulation.time_step


def _equipment(station: NavigationStation | Station | RobotInterface) -> RobotInterface:
    return station if isinstance(station, RobotInterface) else station.equipment


def _add_planning(
    builder: DiagramBuilder,
    scenario: Scenario,
    station: NavigationStation | Station | RobotInterface,
    goal: LeafSystem,
    stopwatch: Stopwatch | None,
) -> tuple[StarPerception, StarRoadmapPlanner, ObstacleTracker | None, ScanMatcher | None]:
    lidar, schedule = scenario.lidar, _Schedule.of(scenario)
    method = METHODS.get(scenario.controller.kind, METHODS["star"])  # a baseline may head for short-term goals
    scan, tracker = station.GetOutputPort("lidar.scan"), None
    if schedule.tracker is not None:
        tracker = builder.AddNamedSystem(
            "tracker",
            ObstacleTracker(scenario.obstacles, rate=lidar.rate, offset=schedule.tracker, stopwatch=stopwatch),
        )
        builder.Connect(scan, tracker.GetInputPort("scan"))
        builder.Connect(station.GetOutputPort("localization.scan_pose"), tracker.GetInputPort("pose"))
        scan = tracker.GetOutputPort("scan")
    perception = builder.AddNamedSystem(
        "perception",
        StarPerception(
            scenario.robot,
            scenario.planner,
            scenario.controller,
            lidar,
            offset=schedule.perception,
            perceive=method.perceive,
            stopwatch=stopwatch,
        ),
    )
    planner = builder.AddNamedSystem(
        "planner",
        StarRoadmapPlanner(
            scenario.robot,
            scenario.planner,
            goal_tolerance=scenario.simulation.goal_tolerance,
            offset=schedule.last,
            step=method.step,
            stopwatch=stopwatch,
        ),
    )
    builder.Connect(scan, perception.GetInputPort("scan"))
    builder.Connect(station.GetOutputPort("localization.scan_pose"), perception.GetInputPort("pose"))
    builder.Connect(goal.get_output_port(), planner.GetInputPort("goal"))
    star, pose, matcher = perception.GetOutputPort("star"), station.GetOutputPort("localization.pose"), None
    if schedule.matcher is not None:
        localization = scenario.localization
        error = OdometryError(localization.drift, localization.jump, lidar.noise)
        matcher = builder.AddNamedSystem("matcher", ScanMatcher(error, rate=lidar.rate, offset=schedule.matcher))
        for port, name in (
            (star, "star"),
            (station.GetOutputPort("localization.state"), "state"),
            (station.GetOutputPort("localization.scan_pose"), "scan_pose"),
            (planner.GetOutputPort("guidance"), "guidance"),
        ):
            builder.Connect(port, matcher.GetInputPort(name))
        star, pose = matcher.GetOutputPort("star"), matcher.GetOutputPort("pose")
    builder.Connect(star, planner.GetInputPort("star"))
    builder.Connect(pose, planner.GetInputPort("pose"))
    return perception, planner, tracker, matcher


def _tracks(scenario: Scenario) -> bool:
    """Whether obstacles that move are tracked and avoided; to the paper's method the world is static."""
    return scenario.obstacles.max_speed > 0.0 and scenario.controller.kind != "star_paper"


def _matches(scenario: Scenario) -> bool:
    """Whether scans correct the believed pose: where it errs, and the controller follows the planner's guidance."""
    localization = scenario.localization
    return localization.matching and not localization.exact and scenario.controller.kind in GUIDED


def _add_certified_controller(
    builder: DiagramBuilder,
    scenario: Scenario,
    station: NavigationStation | Station | RobotInterface,
    perception: StarPerception,
    guide: StarRoadmapPlanner | ScanMatcher,
    tracker: ObstacleTracker | None,
    stopwatch: Stopwatch | None,
) -> CertifiedController:
    offset, rate = _command_offset(scenario), scenario.controller.rate
    delay = delay_steps(scenario.drive, scenario.simulation.time_step) * scenario.simulation.time_step
    controller = builder.AddNamedSystem(
        "controller",
        CertifiedController(
            scenario.robot,
            scenario.controller,
            offset=offset,
            law=METHODS[scenario.controller.kind].law,
            obstacles=scenario.obstacles if tracker is not None else None,
            lead=delay,
            stopwatch=stopwatch,
        ),
    )
    if tracker is not None:
        builder.Connect(tracker.GetOutputPort("tracks"), controller.GetInputPort("tracks"))
    star, state = perception.GetOutputPort("safety_star"), station.GetOutputPort("localization.state")
    if scenario.localization.jump > 0.0:
        guard = JumpGuard(tolerance=UNSEEN_JUMP, rate=rate, offset=offset, rolling=scenario.lidar.rolling)
        guard = builder.AddNamedSystem("jump_guard", guard)
        builder.Connect(star, guard.GetInputPort("safety_star"))
        builder.Connect(state, guard.GetInputPort("state"))
        star = guard.get_output_port()
    if scenario.drive.delay > 0.0:
        predictor = builder.AddNamedSystem("predictor", StatePredictor(delay=delay, rate=rate, offset=offset))
        builder.Connect(state, predictor.GetInputPort("state"))
        builder.Connect(controller.GetOutputPort("twist_command"), predictor.GetInputPort("twist_command"))
        state = predictor.get_output_port()
    builder.Connect(guide.GetOutputPort("guidance"), controller.GetInputPort("guidance"))
    builder.Connect(star, controller.GetInputPort("safety_star"))
    builder.Connect(state, controller.GetInputPort("state"))
    return controller


def _add_baseline(
    builder: DiagramBuilder,
    scenario: Scenario,
    world: World,
    station: NavigationStation | Station | RobotInterface,
    goal: LeafSystem,
    planner: StarRoadmapPlanner | None,
    stopwatch: Stopwatch | None,
) -> BaselineController:
    """Add a baseline; it reads the same scans at the same times as the star controller."""
    kind, offset = scenario.controller.kind, _command_offset(scenario)
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
        if count or world.model is not None or len(world.moving_obstacles):
            others = "a model file" if world.model is not None else "obstacles that move"
            what = f"{count} polygon{'s' * (count > 1)}" if count else others
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
    `controller.guiding_vector`, `controller.certificate`, and all of the station's; if the scenario declares that the
    believed pose errs, also `matcher.pose` and the others of the matcher.

    Args:
        scenario: the parameters, as from `load_scenario`.
        seed: of the world and of the sensor's noise.
        world: in which to drive, instead of the scenario's.
    """
    builder = DiagramBuilder()
    navigation = add_navigation(builder, scenario, seed=seed, world=world)
    systems = {"planner": navigation.planner, "matcher": navigation.matcher, "controller": navigation.controller}
    for name, system in systems.items():
        if system is None:
            continue
        for index in range(system.num_output_ports()):
            port = system.get_output_port(index)
            builder.ExportOutput(port, f"{name}.{port.get_name()}")
    for name in STATION_OUTPUTS:
        builder.ExportOutput(navigation.station.GetOutputPort(name), name)
    diagram = builder.Build()
    diagram.set_name(scenario.name)
    return diagram
