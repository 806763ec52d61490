"""The kinematics of a differential drive, both ways."""

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from pydrake.systems.framework import DiagramBuilder

from drake_starnav import RobotParameters, World
from drake_starnav.station.plant import add_plant
from drake_starnav.station.robot_geometry import Drive, RobotModel
from drake_starnav.station.robot_model import WHEEL_GAIN
from drake_starnav.station.wheel_drive import SLIP_PERIOD, WheelServo, WheelSlip, WheelSpeedCommand, draw_wheel_shares

FAST = RobotParameters(max_speed=10.0, max_yaw_rate=10.0)
sizes = st.floats(0.01, 2.0)
speeds = st.floats(-5.0, 5.0)
SLIP, SEED = 0.2, 7
SIDES = np.array((0, 0, 1))
DESIRED = np.array((0.0, 0.0, 0.0, 3.0, 3.0, -2.0))
WHEELS = ("left_wheel", "right_wheel")


def wheel_speeds(v: float, omega: float, robot=FAST, wheel_radius: float = 0.05, track: float = 0.32) -> np.ndarray:
    """Desired state of the actuators for a twist, through a context."""
    wheels = Drive((wheel_radius, wheel_radius), (-0.5 * track, 0.5 * track))
    system = WheelSpeedCommand(robot=robot, drive=wheels)
    context = system.CreateDefaultContext()
    system.GetInputPort("twist_command").FixValue(context, [v, omega])
    return system.GetOutputPort("desired_state").Eval(context)


@given(v=speeds, omega=speeds, wheel_radius=sizes, track=sizes)
def test_wheels_that_roll_at_these_speeds_make_the_twist(v, omega, wheel_radius, track) -> None:
    *angles, left, right = wheel_speeds(v, omega, FAST, wheel_radius, track)
    assert angles == [0.0, 0.0]
    assert 0.5 * wheel_radius * (left + right) == pytest.approx(v, abs=1e-9)
    assert wheel_radius * (right - left) / track == pytest.approx(omega, abs=1e-8)


@given(v=st.floats(-1e3, 1e3), omega=st.floats(-1e3, 1e3))
def test_no_twist_beyond_the_limits_reaches_the_wheels(v, omega) -> None:
    _, _, left, right = wheel_speeds(v, omega, RobotParameters())
    driven = 0.025 * (left + right), 0.05 * (right - left) / 0.32
    assert driven == pytest.approx((min(max(v, -0.8), 0.8), min(max(omega, -2.0), 2.0)))


def test_wheels_of_any_size_and_axis_roll_at_the_speed_of_their_place() -> None:
    drive = Drive((0.1, -0.2, 0.1), (-0.3, -0.3, 0.4))
    assert drive.rates(1.0, 2.0) == pytest.approx((4.0, -2.0, 18.0))


def slipping(time: float) -> np.ndarray:
    system = WheelSlip(sides=SIDES, slip=SLIP, seed=SEED)
    context = system.CreateDefaultContext()
    system.GetInputPort("desired_state").FixValue(context, DESIRED)
    context.SetTime(time)
    return system.GetOutputPort("slipping_state").Eval(context)


@pytest.mark.parametrize("index", range(4))
def test_the_wheels_of_a_side_keep_their_share_for_one_period(index: int) -> None:
    expected = DESIRED[3:] * draw_wheel_shares(SLIP, SEED, index)[SIDES]
    for time in (index * SLIP_PERIOD, (index + 0.999) * SLIP_PERIOD):
        np.testing.assert_array_equal(slipping(time), (0.0, 0.0, 0.0, *expected))
    assert (np.abs(expected) >= (1.0 - SLIP) * np.abs(DESIRED[3:])).all()


@pytest.fixture(scope="module")
def robot():
    plant, scene_graph, model, _ = add_plant(DiagramBuilder(), World("open", (0, 0, 0), (1, 0)), RobotParameters(), 0.0)
    return RobotModel(plant, scene_graph, model)


def test_the_torque_is_the_gain_times_what_is_missing(robot) -> None:
    plant, _, model = robot
    servo = WheelServo(robot)
    context = servo.CreateDefaultContext()
    state = plant.CreateDefaultContext()
    for rate, name in zip((3.0, -1.0), WHEELS, strict=True):
        plant.GetJointByName(name, model).set_angular_rate(state, rate)
    servo.GetInputPort("desired_state").FixValue(context, [9.0, 9.0, 4.0, 1.0])
    servo.GetInputPort("multibody_state").FixValue(context, plant.GetPositionsAndVelocities(state, model))
    assert servo.GetOutputPort("actuation").Eval(context) == pytest.approx(WHEEL_GAIN * np.array((1.0, 2.0)))
