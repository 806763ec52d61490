"""The braking certificate around a twist from anywhere: a person, a learned policy, a controller of the user's."""

import numpy as np

from drake_starnav.control.certificates import certified_twist
from drake_starnav.control.heading_controller import limited_twist
from drake_starnav.control.law import Command, ControlInput, Law
from drake_starnav.control.parameters import ControllerParameters
from drake_starnav.robot import RobotParameters

NOWHERE = np.zeros(2)


def shielded(desired: np.ndarray) -> Law:
    """The control law that drives a twist as far as the certificate accepts it, and else slower, or brakes.

    Args:
        desired: (v, omega), m/s and rad/s; what exceeds the robot's limits is cut off.
    """

    def step(now: ControlInput, parameters: ControllerParameters, robot: RobotParameters) -> Command:
        period = 1.0 / parameters.rate
        v, omega, accepted = certified_twist(
            now.pose, now.twist, desired, period, robot.limits, now.star, parameters.delay
        )
        return Command(limited_twist(now.twist, np.array((v, omega)), robot, period), NOWHERE, accepted)

    return step
