"""Shipped robots in their station: they follow ramped twists within their limits, level and with their grip."""

import numpy as np
import pytest
from pydrake.systems.analysis import Simulator

from drake_starnav.scenario.scenario_file import load_scenario
from drake_starnav.scenario.schema import Scenario
from drake_starnav.station.navigation_station import NavigationStation
from drake_starnav.worlds.world import World
from tests.helpers.motions import limited_twist

JACKAL, CARRIER = load_scenario("barn"), load_scenario("room", overrides=["robot.model=carrier"])
PLAIN = World("plain", (0.0, 0.0, 0.0), (9.0, 0.0))
PERIOD = 0.025


def drive(scenario: Scenario, targets: list[tuple[float, float, float]]) -> np.ndarray:
    """Errors of (v, omega) at every period, shape (n, 2), while each twist is approached for so many seconds."""
    station = NavigationStation(PLAIN, scenario)
    simulator = Simulator(station)
    context = simulator.get_mutable_context()
    command = station.GetInputPort("drive.twist_command")
    command.FixValue(context, np.zeros(2))
    simulator.AdvanceTo(0.5)
    twist, errors = np.zeros(2), []
    for v, omega, seconds in targets:
        for _ in range(round(seconds / PERIOD)):
            twist = limited_twist(twist, np.array((v, omega)), scenario.robot, PERIOD)
            command.FixValue(context, twist)
            simulator.AdvanceTo(context.get_time() + PERIOD)
            errors.append(station.GetOutputPort("localization.state").Eval(context)[3:] - twist)
            rotation = station.plant.EvalBodyPoseInWorld(
                station.plant.GetMyContextFromRoot(context), station.plant.GetBodyByName("base_link")
            ).rotation()
            assert rotation.matrix()[2, 2] > np.cos(np.radians(0.5)), "it tips"
    return np.array(errors)


@pytest.mark.parametrize("v", [0.4, 2.0])
@pytest.mark.parametrize("omega", [0.0, 3.0])
def test_follows_the_commanded_twist(v: float, omega: float) -> None:
    errors = drive(JACKAL, [(v, omega, 1.5)])
    assert np.abs(errors[-10:, 0]).max() < 2e-3
    assert np.abs(errors[-10:, 1]).max() < 5e-3
    assert np.abs(errors[:, 0]).max() < 0.02


def test_brakes_as_hard_as_commanded() -> None:
    errors = drive(JACKAL, [(2.0, 0.0, 1.0), (0.0, 4.0, 1.0), (0.0, -4.0, 1.0)])
    assert np.abs(errors[:, 0]).max() < 0.02
    assert np.abs(errors[:, 1]).max() < 0.1


def test_the_carrier_follows_commands_within_its_limits() -> None:
    errors = drive(CARRIER, [(1.0, 1.5, 2.0), (-1.0, -1.5, 2.0), (0.0, 0.0, 2.0)])
    assert np.abs(errors).max(axis=0) == pytest.approx((0.0, 0.0), abs=0.05)
