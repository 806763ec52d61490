"""Which output feeds an input port of a name, in our controller and in shields."""

from pydrake.systems.framework import DiagramBuilder, OutputPort

from drake_starnav.localization.scan_matching import UNSEEN_JUMP
from drake_starnav.navigation.loop_config import LoopConfig
from drake_starnav.navigation.parts import Navigation
from drake_starnav.systems.jump_guard import JumpGuard
from drake_starnav.systems.state_predictor import StatePredictor


def find_control_sources(builder: DiagramBuilder, config: LoopConfig, navigation: Navigation) -> dict[str, OutputPort]:
    """What our controller and the shield may read, by the name of the input port, in the odometry's frame.

    Without perception it is the state alone. The state is the one in which a command finds the robot.
    """
    assert navigation.twist_command is not None
    scenario, rate = config.scenario, config.scenario.controller.rate
    state = navigation.station.GetOutputPort("localization.state")
    if navigation.perception is None:
        return {"state": state}
    star = navigation.perception.GetOutputPort("surroundings")
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
