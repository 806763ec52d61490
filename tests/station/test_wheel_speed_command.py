"""The kinematics of a differential drive, both ways."""

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from drake_starnav.robot import RobotParameters
from drake_starnav.station.robot_geometry import Drive
from drake_starnav.station.wheel_speed_command import WheelSpeedCommand

FAST = RobotParameters(max_speed=10.0, max_yaw_rate=10.0)
sizes = st.floats(0.01, 2.0)
speeds = st.floats(-5.0, 5.0)


def two_wheels(radius: float, track: float) -> Drive:
    """The left and the right wheel of a differential drive."""
    return Drive(np.array((radius, radius)), np.array((-0.5 * track, 0.5 * track)))


def wheel_speeds(v: float, omega: float, wheel_radius: float = 0.05, track: float = 0.32) -> np.ndarray:
    """Desired state of the actuators for a twist, through a context."""
    system = WheelSpeedCommand(robot=FAST, drive=two_wheels(wheel_radius, track))
    context = system.CreateDefaultContext()
    system.GetInputPort("twist_command").FixValue(context, [v, omega])
    return system.GetOutputPort("desired_state").Eval(context)


@given(v=speeds, omega=speeds, wheel_radius=sizes, track=sizes)
def test_wheels_that_roll_at_these_speeds_make_the_twist(v, omega, wheel_radius, track) -> None:
    *angles, left, right = wheel_speeds(v, omega, wheel_radius, track)
    assert angles == [0.0, 0.0]
    assert 0.5 * wheel_radius * (left + right) == pytest.approx(v, abs=1e-9)
    assert wheel_radius * (right - left) / track == pytest.approx(omega, abs=1e-8)


def test_left_turn_is_driven_by_the_right_wheel() -> None:
    _, _, left, right = wheel_speeds(0.0, 1.0)
    assert right == -left > 0.0


def test_output_follows_the_input_at_once() -> None:
    system = WheelSpeedCommand(robot=FAST, drive=two_wheels(0.1, 0.4))
    context = system.CreateDefaultContext()
    twist = system.GetInputPort("twist_command")
    for v in (0.3, -0.7):
        twist.FixValue(context, [v, 0.0])
        assert system.GetOutputPort("desired_state").Eval(context)[2:] == pytest.approx([v / 0.1, v / 0.1])
    assert system.HasAnyDirectFeedthrough()
    assert system.num_input_ports() == system.num_output_ports() == 1
    assert context.num_total_states() == 0


@given(v=st.floats(-1e3, 1e3), omega=st.floats(-1e3, 1e3))
def test_no_twist_beyond_the_limits_reaches_the_wheels(v, omega) -> None:
    system = WheelSpeedCommand(robot=RobotParameters(), drive=two_wheels(0.05, 0.32))
    context = system.CreateDefaultContext()
    system.GetInputPort("twist_command").FixValue(context, [v, omega])
    _, _, left, right = system.GetOutputPort("desired_state").Eval(context)
    driven = 0.025 * (left + right), 0.05 * (right - left) / 0.32
    assert driven == pytest.approx((min(max(v, -0.8), 0.8), min(max(omega, -2.0), 2.0)))


def test_wheels_of_any_size_and_axis_roll_at_the_speed_of_their_place() -> None:
    drive = Drive(np.array((0.1, -0.2, 0.1)), np.array((-0.3, -0.3, 0.4)))
    assert drive.rates(1.0, 2.0) == pytest.approx((4.0, -2.0, 18.0))
