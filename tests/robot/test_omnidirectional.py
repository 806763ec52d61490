"""An omnidirectional base drives at once wherever it shall, and keeps its direction when it is cut off."""

import math

import numpy as np
import pytest

from drake_starnav.geometry.footprint import disc
from drake_starnav.robot import RobotParameters
from drake_starnav.robot.base import convert_to_twist
from drake_starnav.robot.limits import find_velocity_towards
from drake_starnav.robot.motion import Actuation, roll_out

ROBOT = RobotParameters(base="omnidirectional")


@pytest.mark.parametrize("error", [0.0, 1.0, 1.6, -2.5, math.pi])
def test_it_drives_at_once_in_any_direction(error):
    x, y, omega = convert_to_twist(find_velocity_towards(error, 0.5, ROBOT.limits), ROBOT.drive)
    assert (x, y) == pytest.approx((0.5 * math.cos(error), 0.5 * math.sin(error)))
    assert omega == pytest.approx(np.clip(2.0 * math.remainder(error, math.pi), -2.0, 2.0), abs=1e-9)


def test_a_velocity_that_is_cut_off_keeps_its_direction():
    x, y, omega = ROBOT.drive.saturate(np.array((3.0, 4.0, 9.0)), ROBOT.limits)
    assert (x, y, omega) == pytest.approx((0.48, 0.64, 2.0))


def test_it_brakes_along_a_straight_line_whatever_its_direction():
    twist = np.array((0.3, -0.4, 0.0))
    motion = roll_out(np.zeros(3), twist, np.zeros(3), Actuation(ROBOT.limits, disc(0.2), 0.02, 0.0, ROBOT.drive))
    x, y = motion.position[-1]
    assert math.hypot(x, y) == pytest.approx(0.5**2 / 2.0, rel=0.01)
    assert math.atan2(y, x) == pytest.approx(math.atan2(-0.4, 0.3))
    assert motion.twist[-1, 0] == pytest.approx(0.0, abs=1e-9)
