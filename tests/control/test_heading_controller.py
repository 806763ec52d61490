"""The law that turns towards a heading, and the limits that it keeps."""

import math

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from drake_starnav.control.heading_controller import GRIP, GRIP_WHILE_BRAKING, gripped, slides, turning_law
from drake_starnav.control.motion import ramped
from drake_starnav.robot import Limits, RobotParameters
from drake_starnav.robot.limits import limited, wrapped_angle
from tests.helpers.motions import limited_twist

ROBOT = RobotParameters()
angles = st.floats(-math.pi, math.pi)


@given(angles, st.floats(0.0, 1.0))
def test_the_law_turns_towards_the_heading_and_can_stop_turning_there(error: float, speed: float) -> None:
    v, omega = turning_law(error, speed, ROBOT)
    assert omega * error >= 0.0
    assert abs(omega) <= ROBOT.max_yaw_rate
    assert omega**2 <= 2.0 * ROBOT.max_yaw_acceleration * abs(error) * (1.0 + 1e-12)
    assert 0.0 <= v <= speed
    assert v == 0.0 or abs(error) < 0.5 * math.pi


@given(st.tuples(st.floats(-0.8, 0.8), st.floats(-2.0, 2.0)), st.tuples(st.floats(-9.0, 9.0), st.floats(-9.0, 9.0)))
def test_a_period_s_twist_keeps_speeds_and_accelerations(twist, desired) -> None:
    after = limited_twist(np.array(twist), np.array(desired), ROBOT, 0.02)
    largest = np.array((ROBOT.max_speed, ROBOT.max_yaw_rate))
    change = 0.02 * np.array((ROBOT.max_acceleration, ROBOT.max_yaw_acceleration))
    assert (np.abs(after) <= largest + 1e-12).all()
    assert (np.abs(after - twist) <= change + 1e-12).all()
    reachable = np.abs(np.clip(desired, -largest, largest) - twist) <= change
    np.testing.assert_allclose(after[reachable], np.clip(desired, -largest, largest)[reachable], atol=1e-12)


@given(st.floats(-50.0, 50.0))
def test_a_wrapped_angle_is_the_same_direction(angle: float) -> None:
    wrapped = wrapped_angle(angle)
    assert -math.pi <= wrapped < math.pi + 1e-12
    assert math.cos(wrapped - angle) == pytest.approx(1.0)


def test_values_are_cut_off_and_ramped() -> None:
    assert [limited(x, 2.0) for x in (-3.0, 1.0, 3.0)] == [-2.0, 1.0, 2.0]
    assert [ramped(1.0, x, 0.5) for x in (0.0, 1.2, 9.0)] == [0.5, 1.2, 1.5]


def test_the_grip_falls_where_the_robot_may_brake_hard() -> None:
    assert gripped(GRIP_WHILE_BRAKING) == GRIP
    assert gripped(2.0 * GRIP_WHILE_BRAKING) == pytest.approx(GRIP / 8.0)
    limits = Limits(2.0, 4.0, GRIP_WHILE_BRAKING, 10.0)
    assert not slides(2.0, 0.5 * GRIP, limits)
    assert slides(2.0, -0.51 * GRIP, limits)
