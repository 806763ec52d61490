"""The torques are the gain times the missing speed of each wheel, whatever the order of the actuators."""

import numpy as np
import pytest
from pydrake.systems.framework import DiagramBuilder

from drake_starnav.robot import RobotParameters
from drake_starnav.station.plant import add_plant
from drake_starnav.station.robot_geometry import wheel_rates
from drake_starnav.station.robot_model import WHEEL_GAIN
from drake_starnav.station.wheel_servo import WheelServo
from drake_starnav.worlds.world import World

WHEELS = ("left_wheel", "right_wheel")


@pytest.fixture(scope="module")
def plant_and_model():
    plant, _, model, _ = add_plant(DiagramBuilder(), World("open", (0, 0, 0), (1, 0)), RobotParameters(), 0.0)
    return plant, model


def test_the_torque_is_the_gain_times_what_is_missing(plant_and_model) -> None:
    plant, model = plant_and_model
    servo = WheelServo(plant, model)
    context = servo.CreateDefaultContext()
    state = plant.CreateDefaultContext()
    for rate, name in zip((3.0, -1.0), WHEELS, strict=True):
        plant.GetJointByName(name, model).set_angular_rate(state, rate)
    servo.GetInputPort("desired_state").FixValue(context, [9.0, 9.0, 4.0, 1.0])
    servo.GetInputPort("multibody_state").FixValue(context, plant.GetPositionsAndVelocities(state, model))
    assert servo.GetOutputPort("actuation").Eval(context) == pytest.approx(WHEEL_GAIN * np.array((1.0, 2.0)))


def test_the_rates_are_those_of_the_wheels(plant_and_model) -> None:
    rates = wheel_rates(*plant_and_model)
    assert rates.shape == (2, plant_and_model[0].num_multibody_states())
    assert rates.sum(axis=1).tolist() == [1.0, 1.0]
