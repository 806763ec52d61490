"""The whole navigation loop as one Drake diagram."""

import dataclasses
from collections.abc import Callable
from dataclasses import dataclass
from typing import Any, NamedTuple

from pydrake.common.value import Value
from pydrake.systems.framework import Diagram, DiagramBuilder, OutputPort, System
from pydrake.systems.primitives import ConstantValueSource

from drake_starnav.baselines import known_obstacles, paper
from drake_starnav.control.certificates import Certificate
from drake_starnav.control.parameters import CERTIFIED
from drake_starnav.errors import StarnavError, UnsupportedError, check_kind
from drake_starnav.localization.scan_matching import UNSEEN_JUMP, OdometryError
from drake_starnav.planning import PlanStep, plan_step
from drake_starnav.regions.margins import Margins
from drake_starnav.regions.perception import Perceive, perceive
from drake_starnav.scenario import Scenario
from drake_starnav.station.drake_configs import scenario_simulator_config
from drake_starnav.station.model_world import make_world_with_footprints
from drake_starnav.station.navigation_station import STATION_OUTPUTS, NavigationStation, Station
from drake_starnav.station.robot_interface import RobotInterface, delay_steps
from drake_starnav.systems.baseline_controller import BaselineController
from drake_starnav.systems.connecting import add_system, connect, connect_inputs, output_port, outputs
from drake_starnav.systems.dsm_controller import DsmController
from drake_starnav.systems.fixed_goal import FixedGoal
from drake_starnav.systems.jump_guard import JumpGuard
from drake_starnav.systems.obstacle_tracker import ObstacleTracker
from drake_starnav.systems.paper_controller import PaperController
from drake_starnav.systems.predictive_controller import PredictiveController
from drake_starnav.systems.scan_matcher import ScanMatcher
from drake_starnav.systems.star_perception import StarPerception
from drake_starnav.systems.star_roadmap_planner import StarRoadmapPlanner
from drake_starnav.systems.state_predictor import StatePredictor
from drake_starnav.systems.twist_shield import TwistShield, Unshielded
from drake_starnav.tracking import DynamicObstacleParameters
from drake_starnav.utils.stopwatch import Stopwatch
from drake_starnav.validation import check_interface, validated_margins
from drake_starnav.worlds.endpoints import check_free_ends
from drake_starnav.worlds.world import World


class ControllerNeeds(NamedTuple):
    """What a controller is made of.

    Attributes:
        scenario: its parameters.
        margins: derived from it.
        obstacles: what is declared of moving obstacles, where they are tracked.
        state_lead: how far in the future its `state` lies, s.
        stopwatch: if any.
    """

    scenario: Scenario
    margins: Margins
    obstacles: DynamicObstacleParameters | None
    state_lead: float
    stopwatch: Stopwatch | None


class Method(NamedTuple):
    """One way to drive.

    Attributes:
        controller: makes the system that proposes twists.
        perceive, step: perception and planner, where there is a planner.
        guided: whether it follows the planner's guidance.
        shielded: whether its twists are certified; not those of the methods to compare with, as published.
    """

    controller: Callable[[ControllerNeeds], System]
    perceive: Perceive = perceive
    step: PlanStep = plan_step
    guided: bool = True
    shielded: bool = True


def _guided(kind: type[DsmController]) -> Callable[[ControllerNeeds], System]:
    return lambda needs: kind(
        needs.scenario.robot,
        needs.scenario.controller,
        needs.margins,
        obstacles=needs.obstacles,
        state_lead=needs.state_lead,
        stopwatch=needs.stopwatch,
    )


def _paper(needs: ControllerNeeds) -> System:
    return PaperController(needs.scenario.robot, stopwatch=needs.stopwatch)


def _baseline(needs: ControllerNeeds) -> System:
    scenario = needs.scenario
    return BaselineController(scenario.robot, getattr(scenario, scenario.controller.kind), stopwatch=needs.stopwatch)


METHODS = {
    "star": Method(_guided(DsmController)),
    "mpc": Method(_guided(PredictiveController)),
    "star_paper": Method(_paper, paper.perceive, paper.plan_step, shielded=False),
    **dict.fromkeys(("dsm", "foa", "dwa", "apf"), Method(_baseline, guided=False, shielded=False)),
}
"""By `controller.kind`."""
SYSTEMS = (
    "goal", "perception", "planner", "tracker", "matcher", "controller", "shield", "jump_guard", "predictor",
    "known_obstacles",
)  # fmt: skip
"""Names that `add_navigation` gives, beside the station's."""


@dataclass(frozen=True)
class Navigation:
    """The systems of a navigation loop in a builder, for connecting more to them and for recording them.

    `add_navigation` makes one. For a loop wired by hand, `Navigation(world, station)` with what else there is tells
    `Recorder` what to draw.

    Attributes:
        world: driven through.
        station: robot and sensor.
        goal: its only output is the goal.
        perception: None for a baseline that heads for the goal itself.
        planner: None for such a baseline.
        controller: proposes the twist.
        tracker: if the scenario declares obstacles that move.
        matcher: if it declares that the believed pose errs.
        shield: decides what of it is driven.
    """

    world: World
    station: NavigationStation | Station | RobotInterface
    goal: Any = None  # systems of any kind, or None: a union would ask for a check at each use
    perception: StarPerception | None = None
    planner: Any = None
    controller: Any = None
    tracker: ObstacleTracker | None = None
    matcher: ScanMatcher | None = None
    shield: Any = None

    @property
    def robot(self) -> RobotInterface:
        """The robot's lidar, localization and wheels."""
        return self.station if isinstance(self.station, RobotInterface) else self.station.equipment

    @property
    def geometry_query(self) -> OutputPort:
        """The port of the scene, in the builder that holds the station."""
        if isinstance(self.station, RobotInterface):
            return self.station.scene_graph.get_query_output_port()
        return self.station.GetOutputPort("cheat.geometry_query")

    def localization(self, name: str) -> OutputPort:
        """The port `pose`, `state` or `scan_pose` in the world frame of planner and goal."""
        if self.matcher is not None:
            return self.matcher.GetOutputPort(name)
        return self.station.GetOutputPort(f"localization.{name}")

    @property
    def certificate(self) -> OutputPort | None:
        """The port of the certificate, in the same frame; None of a shield that has no such port."""
        if self.shield is None or "certificate" not in outputs(self.shield):
            return None
        return (self.matcher or self.shield).GetOutputPort("certificate")

    @property
    def twist_command(self) -> OutputPort | None:
        """The port of the twist that is driven; None without a shield."""
        return None if self.shield is None else output_port(self.shield, "twist_command", 2, "shield")


def add_navigation(
    builder: DiagramBuilder,
    scenario: Scenario,
    *,
    seed: int = 0,
    world: World | None = None,
    station: NavigationStation | Station | RobotInterface | None = None,
    stopwatch: Stopwatch | None = None,
    goal: System | None = None,
    planner: System | None = None,
    controller: System | None = None,
    shield: System | None = None,
    certificates: tuple[Certificate, ...] = (),
) -> Navigation:
    """Add the station, perception, planner, controller and shield of a scenario to a builder, and wire them.

    A planner or controller of your own is wired by the names of its ports. Inputs are `scan`, `ranges`, `scan_pose`,
    `pose`, `state`, `goal`, `star`, `safety_star` and `tracks`, as of the systems that output them, and for a
    controller `twist_command`, which is driven now, and the planner's outputs: `short_term_goal`, `guidance` and all
    others. Inputs that are connected already stay so.

    The lidar scans at multiples of its period, in an unrestricted update. What follows from a scan, the plan included,
    is calculated when something first asks for it, see `ScanState`. Drake executes unrestricted updates before the
    discrete ones of the same instant: the controller's sees the new scan and the plan from it.

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
        planner: instead of the star roadmap; it outputs `guidance`, or what your controller reads.
        controller: instead of the scenario's; it outputs `desired_twist`, (v, omega), m/s and rad/s.
        shield: instead of a `TwistShield`, e.g. an `Unshielded`, for which no guarantee holds.
        certificates: of your own, each of which must accept what is driven, too; for the scenario's shield.

    Raises:
        UnsupportedError: the controller must know all obstacles as circles, and the world has others; or it does not
            do what the scenario asks of it.
        StarnavError: the lidar sees too little; the start lies in an obstacle; the station was made with other
            parameters; the builder has systems of the same names; or your system has not the ports it needs.
    """
    check_kind(scenario, Scenario, "scenario", "as from load_scenario")
    if world is not None:
        check_kind(world, World, "world", "as from make_world")
    method = METHODS[scenario.controller.kind]
    _check_own_systems(scenario, method, planner, controller, certificates if shield is None else ())
    margins = validated_margins(scenario)
    given = goal, planner, controller, shield
    for name in SYSTEMS if station is not None else (*SYSTEMS, "station"):
        if builder.HasSubsystemNamed(name) and builder.GetSubsystemByName(name) not in given:
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
    if station is None:
        station = builder.AddNamedSystem(
            "station",
            NavigationStation(
                world,
                scenario.robot,
                scenario.lidar,
                localization=scenario.localization,
                drive=scenario.drive,
                settings=scenario.plant_config,
                time_step=scenario.simulation.time_step,
                seed=seed,
            ),
        )
    goal = add_system(builder, "goal", goal or FixedGoal(world.goal), "goal")
    made = Navigation(world, station, goal)
    if method.guided or scenario.controller.target == "short_term_goal":
        made = _add_planning(builder, scenario, margins, made, method, planner, stopwatch)
    moving = scenario.obstacles if made.tracker is not None else None
    if shield is None and method.shielded:
        shield = TwistShield(
            scenario.robot,
            scenario.controller,
            margins,
            certificates=certificates,
            obstacles=moving,
            state_lead=_lead(scenario),
            stopwatch=stopwatch,
        )
    elif shield is None:
        shield = Unshielded(scenario.robot, scenario.controller, stopwatch=stopwatch)
    own, needs = controller is not None, ControllerNeeds(scenario, margins, moving, _lead(scenario), stopwatch)
    controller = add_system(builder, "controller", controller or method.controller(needs), "controller")
    made = dataclasses.replace(made, controller=controller, shield=add_system(builder, "shield", shield, "shield"))
    _connect_control(builder, scenario, made, method, own)
    connect(builder, made.twist_command, station.GetInputPort("drive.twist_command"), "shield")
    if made.matcher is not None and "certificate" in outputs(made.shield):
        builder.Connect(made.shield.GetOutputPort("certificate"), made.matcher.GetInputPort("certificate"))
    return made


def _check_own_systems(
    scenario: Scenario,
    method: Method,
    planner: System | None,
    controller: System | None,
    certificates: tuple[Certificate, ...],
) -> None:
    """Raise a `StarnavError` where a scenario excludes systems of the user's."""
    settings = scenario.controller
    if (controller is not None or certificates) and not method.shielded:
        what = "a controller" if controller is not None else "certificates"
        raise StarnavError(
            f"controller.kind is {settings.kind} with {what} of your own; allowed: {', '.join(CERTIFIED)}"
        )
    if planner is not None and not method.guided and settings.target != "short_term_goal":
        raise StarnavError(
            f"controller.kind is {settings.kind}, which heads for the goal, with a planner of your own; "
            "allowed: controller.target short_term_goal"
        )


def _add_planning(
    builder: DiagramBuilder,
    scenario: Scenario,
    margins: Margins,
    made: Navigation,
    method: Method,
    own: System | None,
    stopwatch: Stopwatch | None,
) -> Navigation:
    lidar, station = scenario.lidar, made.station
    scan, tracker = station.GetOutputPort("lidar.scan"), None
    if _tracks(scenario):
        tracker = builder.AddNamedSystem(
            "tracker",
            ObstacleTracker(scenario.obstacles, lidar, stopwatch=stopwatch),
        )
        builder.Connect(scan, tracker.GetInputPort("scan"))
        builder.Connect(station.GetOutputPort("localization.scan_pose"), tracker.GetInputPort("pose"))
        scan = tracker.GetOutputPort("scan")
    perception = builder.AddNamedSystem(
        "perception",
        StarPerception(
            scenario.robot,
            margins,
            lidar,
            certifies=scenario.controller.certifies,
            perceive=method.perceive,
            stopwatch=stopwatch,
        ),
    )
    builder.Connect(scan, perception.GetInputPort("scan"))
    builder.Connect(station.GetOutputPort("localization.scan_pose"), perception.GetInputPort("pose"))
    matcher = None
    if _matches(scenario, method):
        localization = scenario.localization
        error = OdometryError(localization.drift, localization.jump, lidar.noise)
        matcher = builder.AddNamedSystem("matcher", ScanMatcher(error, rate=lidar.rate))
        for port, name in (
            (perception.GetOutputPort("star"), "star"),
            (station.GetOutputPort("localization.state"), "state"),
            (station.GetOutputPort("localization.scan_pose"), "scan_pose"),
        ):
            builder.Connect(port, matcher.GetInputPort(name))
    made = dataclasses.replace(made, perception=perception, tracker=tracker, matcher=matcher)
    planner = own
    if planner is None:
        planner = StarRoadmapPlanner(
            scenario.robot,
            scenario.planner,
            margins,
            lidar,
            goal_tolerance=scenario.simulation.goal_tolerance,
            step=method.step,
            stopwatch=stopwatch,
        )
    planner = add_system(builder, "planner", planner, "planner")
    if own is None:
        builder.Connect(perception.GetOutputPort("safety_star"), planner.GetInputPort("safety_star"))
    connect_inputs(builder, planner, _sources(made), "planner")
    if matcher is not None and "guidance" in outputs(planner):
        connect(builder, planner.GetOutputPort("guidance"), matcher.GetInputPort("guidance"), "planner")
    return dataclasses.replace(made, planner=planner)


def _sources(made: Navigation) -> dict[str, OutputPort]:
    """What a planner or controller of the user's may read, by the name of its input port, all in one frame."""
    assert made.perception is not None
    sources = {name: made.localization(name) for name in ("pose", "state", "scan_pose")}
    sources |= {name: made.station.GetOutputPort(f"lidar.{name}") for name in ("scan", "ranges")}
    sources |= {"goal": made.goal.get_output_port(), "star": (made.matcher or made.perception).GetOutputPort("star")}
    if made.matcher is None:  # else these are in the frame of the odometry
        sources["safety_star"] = made.perception.GetOutputPort("safety_star")
        if made.tracker is not None:
            sources["tracks"] = made.tracker.GetOutputPort("tracks")
    return sources if made.planner is None else outputs(made.planner) | sources


def _tracks(scenario: Scenario) -> bool:
    """Whether obstacles that move are tracked and avoided; to the paper's method the world is static."""
    return scenario.obstacles.max_speed > 0.0 and scenario.controller.kind != "star_paper"


def _matches(scenario: Scenario, method: Method) -> bool:
    """Whether scans correct the believed pose: where it errs, and the controller follows the planner's guidance."""
    localization = scenario.localization
    return localization.matching and not localization.exact and method.guided


def _lead(scenario: Scenario) -> float:
    """How late commands take effect, s."""
    return delay_steps(scenario.drive, scenario.simulation.time_step) * scenario.simulation.time_step


def _connect_control(builder: DiagramBuilder, scenario: Scenario, made: Navigation, method: Method, own: bool) -> None:
    """Connect the inputs of the controller, be it of the user's own or not, and of the shield."""
    assert made.twist_command is not None
    driven = {"twist_command": made.twist_command}
    add_sources = _guided_sources if method.guided else _baseline_sources
    sources = driven | add_sources(builder, scenario, made)
    if not own and method.guided and "guidance" not in sources:
        names = ", ".join(outputs(made.planner)) or "none"
        raise StarnavError(f"planner has the output ports {names}; allowed: one named guidance, or your own controller")
    connect_inputs(builder, made.controller, _sources(made) | driven if own else sources, "controller")
    sources["desired_twist"] = output_port(made.controller, "desired_twist", 2, "controller")
    connect_inputs(builder, made.shield, sources, "shield")


def _guided_sources(builder: DiagramBuilder, scenario: Scenario, made: Navigation) -> dict[str, OutputPort]:
    """What controllers of this package that follow guidance, and their shield, may read, in the odometry's frame.

    The state is the one in which a command finds the robot.
    """
    assert made.perception is not None and made.twist_command is not None
    rate = scenario.controller.rate
    star, state = made.perception.GetOutputPort("safety_star"), made.station.GetOutputPort("localization.state")
    sources = {}
    if "guidance" in outputs(made.planner):
        sources["guidance"] = (made.matcher or made.planner).GetOutputPort("guidance")
    if made.tracker is not None:
        sources["tracks"] = made.tracker.GetOutputPort("tracks")
    if scenario.localization.jump > 0.0:
        guard = JumpGuard(tolerance=UNSEEN_JUMP, rate=rate, rolling=scenario.lidar.rolling)
        guard = builder.AddNamedSystem("jump_guard", guard)
        builder.Connect(star, guard.GetInputPort("safety_star"))
        builder.Connect(state, guard.GetInputPort("state"))
        star = guard.get_output_port()
    if scenario.drive.delay > 0.0:
        predictor = StatePredictor(delay=_lead(scenario), rate=rate)
        predictor = builder.AddNamedSystem("predictor", predictor)
        builder.Connect(state, predictor.GetInputPort("state"))
        builder.Connect(made.twist_command, predictor.GetInputPort("twist_command"))
        state = predictor.get_output_port()
    return {**sources, "safety_star": star, "state": state}


def _baseline_sources(builder: DiagramBuilder, scenario: Scenario, made: Navigation) -> dict[str, OutputPort]:
    """What baselines may read: the same scans at the same times as the star controller."""
    world, station, kind = made.world, made.station, scenario.controller.kind
    sources = {
        "goal": made.goal.get_output_port(),
        "scan": station.GetOutputPort("lidar.scan"),
        "scan_pose": station.GetOutputPort("localization.scan_pose"),
        "state": station.GetOutputPort("localization.state"),
    }
    if made.planner is not None:
        sources["short_term_goal"] = output_port(made.planner, "short_term_goal", 2, "planner")
    if getattr(scenario, kind).known:
        count = len(world.polygons)
        if count or world.model is not None or len(world.moving_obstacles):
            others = "a model file" if world.model is not None else "obstacles that move"
            what = f"{count} polygon{'s' * (count > 1)}" if count else others
            raise UnsupportedError(
                f"controller.kind {kind} in world {world.name}, which has {what}; "
                "allowed: a world of cylinders and spheres, whose obstacles it can know as circles"
            )
        known = known_obstacles(world.discs, world.bounds, scenario.robot.radius + scenario.dsm.margin)
        source = builder.AddNamedSystem("known_obstacles", ConstantValueSource(Value(known)))
        sources["obstacles"] = source.get_output_port()
    return sources


class NavigationDiagram(Diagram):
    """The diagram of a scenario, see `make_diagram`.

    Attributes:
        navigation: the systems in it.
        simulator_config: the scenario's, for `make_simulator`.
    """

    def __init__(self, scenario: Scenario, seed: int, world: World | None) -> None:
        """Arguments as of `make_diagram`."""
        super().__init__()
        scenario_simulator_config(scenario.simulator_config)  # refused before it is used
        self.simulator_config = scenario.simulator_config
        builder = DiagramBuilder()
        self.navigation = add_navigation(builder, scenario, seed=seed, world=world)
        for name in ("planner", "matcher", "controller", "shield"):
            system = getattr(self.navigation, name)
            for port_name, port in ({} if system is None else outputs(system)).items():
                builder.ExportOutput(port, f"{name}.{port_name}")
        for name in STATION_OUTPUTS:
            builder.ExportOutput(self.navigation.station.GetOutputPort(name), name)
        builder.BuildInto(self)
        self.set_name(scenario.name)


def make_diagram(scenario: Scenario, *, seed: int = 0, world: World | None = None) -> NavigationDiagram:
    """The built diagram of a scenario: simulate it, or add it to a builder of your own.

    Any simulator steps it; `make_simulator` also applies the scenario's `simulator_config`. It exports the outputs of
    planner, controller, shield and station under dotted names: `planner.guidance`, `planner.short_term_goal`,
    `planner.roadmap`, `planner.status`, `planner.blocked_by` (if there is a planner), `controller.desired_twist`,
    `controller.guiding_vector`, `shield.twist_command`, `shield.certificate`, and all of the station's; if the scenario
    declares that the believed pose errs, also `matcher.pose` and the others of the matcher.

    Args:
        scenario: the parameters, as from `load_scenario`.
        seed: of the world and of the sensor's noise.
        world: in which to drive, instead of the scenario's.
    """
    return NavigationDiagram(scenario, seed, world)
