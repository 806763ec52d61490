"""The carrier is as its limits say, and follows commands within them."""

import numpy as np
import pytest

from drake_starnav.scenario.scenario_file import load_scenario
from drake_starnav.station.navigation_station import NavigationStation
from drake_starnav.station.plant import make_simulator
from drake_starnav.station.robot_geometry import RobotModel, robot_outline
from drake_starnav.worlds.world import World

SCENARIO = load_scenario("room", overrides=["robot.model=carrier"])


@pytest.fixture(scope="module")
def station() -> NavigationStation:
    return NavigationStation(World("plain", (0.0, 0.0, 0.0), (9.0, 0.0)), SCENARIO)


def test_its_footprint_is_its_outline(station: NavigationStation) -> None:
    outline = robot_outline(RobotModel(station.plant, station.scene_graph, station.robot_model))
    assert sorted(map(tuple, np.round(outline, 9).tolist())) == sorted(map(tuple, SCENARIO.robot.footprint))


def test_follows_commands_within_its_limits(station: NavigationStation) -> None:
    simulator = make_simulator(station)
    context = simulator.get_mutable_context()
    limits, twist, errors = SCENARIO.robot.limits, np.zeros(2), []
    for target in ((1.0, 1.5), (-1.0, -1.5), (0.0, 0.0)):
        for _ in range(100):
            steps = 0.02 * np.array((limits.max_acceleration, limits.max_yaw_acceleration))
            twist = np.clip(target, twist - steps, twist + steps)
            station.GetInputPort("drive.twist_command").FixValue(context, twist)
            simulator.AdvanceTo(context.get_time() + 0.02)
            errors.append(station.GetOutputPort("localization.state").Eval(context)[3:] - twist)
    assert np.abs(errors).max(axis=0) == pytest.approx((0.0, 0.0), abs=0.05)
