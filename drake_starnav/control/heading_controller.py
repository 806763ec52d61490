"""From a heading error to a twist of the differential drive."""

import numpy as np
from numba import njit

from drake_starnav.robot import RobotParameters
from drake_starnav.robot.limits import turning_twist

GOAL_SLOWDOWN = 1.2
"""Speed per metre of distance to the goal on arrival, 1/s."""
CREEP_SPEED = 0.08
"""Speed that remains on arrival, so that the robot does arrive, m/s."""
GRIP = 8.0
"""Acceleration across the robot, speed times yaw rate, that its wheels follow without sliding, m/s^2."""
GRIP_WHILE_BRAKING = 3.0
"""GRIP holds up to this acceleration along the robot, m/s^2; beyond it grip falls with the third power."""


def turning_law(heading: float, speed: float, robot: RobotParameters) -> np.ndarray:
    """The twist (v, omega) that turns towards a heading: omega = HEADING_GAIN * error, v = speed * cos(error)^3.

    Never faster than allows the turn to stop at that heading with the largest yaw acceleration.

    Args:
        heading: error of the robot's heading, rad.
        speed: with no error, m/s.
        robot: its limits.
    """
    return np.array(turning_twist(heading, speed, robot.limits))


@njit(cache=True)
def gripped(acceleration):
    """Largest speed times yaw rate of a robot that may brake with this acceleration, m/s^2: more, and it slides."""
    return GRIP * min(GRIP_WHILE_BRAKING / acceleration, 1.0) ** 3


@njit(cache=True)
def slides(v, omega, limits):
    """Whether a robot that has this twist, and may brake as hard as its limits allow, slides."""
    return abs(v * omega) > gripped(limits.max_acceleration) + 1e-9
