"""A differential drive turns towards a direction before it drives."""

import math

import numpy as np
import pytest

from drake_starnav.robot import RobotParameters

ROBOT = RobotParameters()


@pytest.mark.parametrize("error", [math.pi / 2, -2.0, 3.0])
def test_it_turns_on_the_spot_towards_what_lies_aside_or_behind(error):
    v, omega = ROBOT.drive.towards(error, 0.8, ROBOT.limits)
    assert v == pytest.approx(0.0, abs=1e-12)
    assert math.copysign(1.0, omega) == math.copysign(1.0, error)


def test_standing_it_may_turn_and_else_only_brakes():
    now, desired = np.array((0.0, 0.1)), np.array((0.4, 1.2))
    np.testing.assert_array_equal(ROBOT.drive.braking(now, desired, True), (0.0, 1.2))
    np.testing.assert_array_equal(ROBOT.drive.braking(now, desired, False), (0.0, 0.0))
