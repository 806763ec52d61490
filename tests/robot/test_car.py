"""A car keeps its curvature while it brakes, and never turns where it stands."""

import math

import numpy as np
import pytest

from drake_starnav.geometry.footprint import disc
from drake_starnav.robot import RobotParameters
from drake_starnav.robot.base import convert_to_twist
from drake_starnav.robot.limits import find_velocity_towards
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
    v, bend = convert_to_twist(find_velocity_towards(error, 0.8, ROBOT.limits), ROBOT.drive)
    assert v > 0.0
    assert math.copysign(1.0, bend) == math.copysign(1.0, error)
    assert abs(bend) <= ROBOT.limits.max_yaw_rate


@pytest.mark.parametrize("least_radius", [0.02, 0.5, 3.0, 40.0])
@pytest.mark.parametrize("radius", [0.05, 0.5, 3.0])
def test_its_manoeuvres_are_circles_that_it_can_drive_and_almost_the_least_one(radius, least_radius):
    """With some curvature left to follow them, and no longer than the robot."""
    robot = RobotParameters(base="car", least_radius=least_radius, radius=radius, max_speed=0.05)
    length, turn = robot.motion_primitives[:, 0], abs(robot.motion_primitives[:, 2])
    circles = abs(length[turn > 0.0]) / turn[turn > 0.0]
    assert circles.min() == pytest.approx(1.0 / (0.6 * robot.limits.max_yaw_rate))
    assert abs(length).max() < 0.5 * radius and turn.max() < 0.5
