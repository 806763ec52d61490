"""What a robot's drive can do, and heading errors, for compiled functions."""

import math
from typing import NamedTuple

from numba.extending import register_jitable

from drake_starnav.geometry.compiled import leaf

HEADING_GAIN = 4.0
"""Turning rate per heading error, 1/s."""


class Limits(NamedTuple):
    """The limits of the drive, as compiled functions take them.

    Attributes:
        max_speed: m/s.
        max_yaw_rate: rad/s; of a base that steers the largest curvature, 1/m.
        max_acceleration: m/s^2.
        max_yaw_acceleration: rad/s^2; of a base that steers the largest change of the curvature, 1/(m s).
        steers: 1 if the base is commanded a curvature, 0 if a turning rate.
    """

    max_speed: float
    max_yaw_rate: float
    max_acceleration: float
    max_yaw_acceleration: float
    steers: float = 0.0


@leaf
def turning_twist(heading, speed, limits):
    """The twist (v, omega) of a differential drive that turns towards a heading (rad), v = speed * cos(heading)^3.

    Never faster than allows the turn to stop at that heading with the largest yaw acceleration.
    """
    v = speed * max(math.cos(heading), 0.0) ** 3.0
    stopping = math.sqrt(2.0 * limits.max_yaw_acceleration * abs(heading))
    return v, limited(HEADING_GAIN * heading, min(limits.max_yaw_rate, stopping))


@register_jitable
def limited(value, limit):
    """The value, cut off at `limit` in size; NaN stays NaN."""
    return min(max(value, -limit), limit)


@leaf
def wrapped_angle(angle):
    """The angle in [-pi, pi), rad."""
    return (angle + math.pi) % (2.0 * math.pi) - math.pi
