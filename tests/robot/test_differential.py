"""A differential drive turns towards a direction before it drives."""

import math

import pytest

from drake_starnav.robot import RobotParameters

ROBOT = RobotParameters()


@pytest.mark.parametrize("error", [math.pi / 2, -2.0, 3.0])
def test_it_turns_on_the_spot_towards_what_lies_aside_or_behind(error):
    v, omega = ROBOT.drive.towards(error, 0.8, ROBOT.limits)
    assert v == pytest.approx(0.0, abs=1e-12)
    assert math.copysign(1.0, omega) == math.copysign(1.0, error)
