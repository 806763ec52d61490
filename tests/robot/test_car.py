"""A car keeps its curvature while it brakes, and never turns where it stands."""

import math

import numpy as np
import pytest

from drake_starnav.geometry.footprint import disc
from drake_starnav.robot import RobotParameters
from drake_starnav.robot.base import twist_of
from drake_starnav.robot.limits import aimed
from drake_starnav.robot.motion import Actuation, roll_out

ROBOT = RobotParameters(base="car", least_radius=0.5)
ACTUATION = Actuation(ROBOT.limits, disc(0.2), 0.1, 0.0, ROBOT.drive)


def test_it_drives_a_circle_until_it_stands():
    twist = np.array((0.6, 1.5))
    motion = roll_out(np.zeros(3), twist, twist, ACTUATION)
    x, y = motion.position.T
    np.testing.assert_allclose(np.hypot(x, y - 1.0 / 1.5), 1.0 / 1.5, atol=2e-3)
    assert motion.pose[-1, 2] == pytest.approx(1.5 * (0.06 + 0.6**2 / 2.0), rel=0.01)


def test_it_does_not_turn_where_it_stands():
    motion = roll_out(np.zeros(3), np.zeros(2), np.array((0.0, 2.0)), ACTUATION)
    assert (motion.pose == 0.0).all()


@pytest.mark.parametrize("error", [0.3, -1.2, 2.5, math.pi - 0.1])
def test_it_steers_towards_a_direction(error):
    v, bend = twist_of(aimed(error, 0.8, ROBOT.limits), ROBOT.drive)
    assert v > 0.0
    assert math.copysign(1.0, bend) == math.copysign(1.0, error)
    assert abs(bend) <= ROBOT.limits.max_yaw_rate
