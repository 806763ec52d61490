"""A planar base and a car drive as commanded in the plant, discrete and continuous, and stop at their limits."""

import math

import numpy as np
import pytest

from drake_starnav.scenario.scenario_file import load_scenario
from drake_starnav.worlds.world import World
from tests.station.test_plant import Drive


def driven(model: str, twist: tuple[float, ...], *, continuous: bool) -> np.ndarray:
    """(x, y, yaw, v, omega) of a robot after following a twist from (1, -2, 0.5) for 2 s."""
    open_plane = World("open", (1.0, -2.0, 0.5), (5.0, 0.0), bounds=(-20.0, -20.0, 20.0, 20.0))
    drive = Drive(open_plane, twist, continuous, load_scenario("forest", overrides=[f"robot.model={model}"]).robot)
    drive.simulator.AdvanceTo(2.0)
    return drive.state()


@pytest.mark.parametrize("continuous", [False, True])
def test_an_omnidirectional_base_moves_aside_and_turns_as_commanded(continuous):
    x, y, yaw, v, omega = driven("omnibot", (0.2, 0.3, 0.4), continuous=continuous)
    assert (v, omega) == pytest.approx((math.hypot(0.2, 0.3), 0.4), rel=0.02)
    assert yaw == pytest.approx(0.5 + 0.8, abs=0.02)
    turned = 0.8  # the velocity turns with the robot
    chord = math.hypot(0.2, 0.3) * 2.0 * math.sin(0.5 * turned) / (0.5 * turned)
    assert math.hypot(x - 1.0, y + 2.0) == pytest.approx(chord, rel=0.02)
    assert math.atan2(y + 2.0, x - 1.0) == pytest.approx(0.5 + 0.5 * turned + math.atan2(0.3, 0.2), abs=0.03)


@pytest.mark.parametrize("continuous", [False, True])
def test_a_car_drives_a_circle_of_the_commanded_curvature(continuous):
    _, _, yaw, v, omega = driven("carbot", (0.4, 1.5), continuous=continuous)
    assert v == pytest.approx(0.4, rel=0.05)
    assert omega == pytest.approx(0.6, rel=0.05)
    assert yaw == pytest.approx(0.5 + 1.2, rel=0.1)


@pytest.mark.parametrize(
    ("model", "twist", "expected"), [("omnibot", (9.0, -9.0, 9.0), (0.8, 2.0)), ("carbot", (0.4, 9.0), (0.4, 0.8))]
)
def test_no_base_drives_turns_or_steers_more_than_it_may(model, twist, expected):
    assert driven(model, twist, continuous=False)[3:] == pytest.approx(expected, rel=0.05)
