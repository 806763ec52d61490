"""A differential drive turns towards a direction before it drives."""

import math

import pytest
from hypothesis import given
from hypothesis import strategies as st

from drake_starnav.robot import RobotParameters
from drake_starnav.robot.base import convert_to_twist
from drake_starnav.robot.limits import find_velocity_towards

ROBOT = RobotParameters()


@pytest.mark.parametrize("error", [math.pi / 2, -2.0, 3.0])
def test_it_turns_on_the_spot_towards_what_lies_aside_or_behind(error):
    v, omega = convert_to_twist(find_velocity_towards(error, 0.8, ROBOT.limits), ROBOT.drive)
    assert v == pytest.approx(0.0, abs=1e-12)
    assert math.copysign(1.0, omega) == math.copysign(1.0, error)


@given(st.floats(-math.pi, math.pi), st.floats(0.0, 1.0))
def test_the_law_turns_towards_the_heading_and_can_stop_turning_there(error: float, speed: float) -> None:
    v, omega = convert_to_twist(find_velocity_towards(error, speed, ROBOT.limits), ROBOT.drive)
    assert omega * error >= 0.0
    assert abs(omega) <= ROBOT.max_yaw_rate
    assert omega**2 <= 2.0 * ROBOT.max_yaw_acceleration * abs(error) * (1.0 + 1e-12)
    assert 0.0 <= v <= speed
    assert v == 0.0 or abs(error) < 0.5 * math.pi
