"""Which output feeds an input port of a name, in planners, controllers and shields."""

from pydrake.common.value import Value
from pydrake.systems.framework import DiagramBuilder, OutputPort
from pydrake.systems.primitives import ConstantValueSource

from drake_starnav.baselines.known_obstacles import make_known_obstacles
from drake_starnav.errors import UnsupportedError
from drake_starnav.localization.scan_matching import UNSEEN_JUMP
from drake_starnav.navigation.methods import LoopConfig
from drake_starnav.navigation.parts import Navigation
from drake_starnav.systems.connecting import find_output_port
from drake_starnav.systems.jump_guard import JumpGuard
from drake_starnav.systems.state_predictor import StatePredictor


def find_control_sources(builder: DiagramBuilder, config: LoopConfig, navigation: Navigation) -> dict[str, OutputPort]:
    """What a controller of this package and the shield may read, by the name of the input port."""
    if config.method.guided:
        return _find_guided_sources(builder, config, navigation)
    return _find_baseline_sources(builder, config, navigation)


def _find_guided_sources(builder: DiagramBuilder, config: LoopConfig, navigation: Navigation) -> dict[str, OutputPort]:
    """For controllers that follow guidance, and their shield, in the odometry's frame.

    The state is the one in which a command finds the robot.
    """
    assert navigation.perception is not None and navigation.twist_command is not None
    scenario, rate = config.scenario, config.scenario.controller.rate
    star = navigation.perception.GetOutputPort("surroundings")
    state = navigation.station.GetOutputPort("localization.state")
    sources: dict[str, OutputPort] = {}
    guidance = navigation.planned("guidance")
    if guidance is not None:
        matcher = navigation.matcher
        sources["guidance"] = guidance if matcher is None else matcher.GetOutputPort("guidance")
    if navigation.tracker is not None:
        sources["tracks"] = navigation.tracker.GetOutputPort("tracks")
    if scenario.localization.jump > 0.0:
        tolerance = UNSEEN_JUMP * scenario.robot.shape.cover_radius
        rolling, holonomic = scenario.lidar.rolling, scenario.robot.drive.holonomic
        guard = JumpGuard(tolerance=tolerance, rate=rate, rolling=rolling, holonomic=holonomic)
        guard = builder.AddNamedSystem("jump_guard", guard)
        builder.Connect(star, guard.GetInputPort("surroundings"))
        builder.Connect(state, guard.GetInputPort("state"))
        star = guard.get_output_port()
    if scenario.drive.delay > 0.0:
        predictor = builder.AddNamedSystem(
            "predictor", StatePredictor(scenario.robot, delay=config.state_lead, rate=rate)
        )
        builder.Connect(state, predictor.GetInputPort("state"))
        builder.Connect(navigation.twist_command, predictor.GetInputPort("twist_command"))
        state = predictor.get_output_port()
    return {**sources, "surroundings": star, "state": state}


def _find_baseline_sources(
    builder: DiagramBuilder, config: LoopConfig, navigation: Navigation
) -> dict[str, OutputPort]:
    """For baselines: the same scans at the same times as for our controller."""
    world, station, scenario = navigation.world, navigation.station, config.scenario
    kind, baseline = scenario.controller.kind, config.method.baseline
    assert baseline is not None
    sources = {
        "goal": navigation.goal_position,
        "scan": station.GetOutputPort("lidar.scan"),
        "scan_pose": station.GetOutputPort("localization.scan_pose"),
        "state": station.GetOutputPort("localization.state"),
    }
    if navigation.planner is not None:
        sources["short_term_goal"] = find_output_port(navigation.planner, "short_term_goal", 2, "planner")
    if baseline.knows_obstacles:
        count = len(world.polygons)
        if count or world.model is not None or len(world.moving_obstacles):
            others = "a model file" if world.model is not None else "obstacles that move"
            what = f"{count} polygon{'s' * (count > 1)}" if count else others
            raise UnsupportedError(
                f"controller.kind {kind} in world {world.name}, which has {what}; "
                "allowed: a world of cylinders and spheres, whose obstacles it can know as circles"
            )
        known_discs = make_known_obstacles(world.discs, world.bounds, scenario.robot.radius + baseline.margin)
        source = builder.AddNamedSystem("known_obstacles", ConstantValueSource(Value(known_discs)))
        sources["obstacles"] = source.get_output_port()
    return sources
