"""What the shield makes of a proposed twist: the most of it that every certificate accepts, else braking."""

from collections.abc import Sequence

import numpy as np

from drake_starnav.control.braking_certificate import STOPPED_DISTANCE
from drake_starnav.control.certificates import Certificate, first_accepted
from drake_starnav.control.motion import Actuation, Twist, ramped, roll_out

PROPOSALS = np.array(
    [(speed, 1.0) for speed in (1.0, 0.8, 0.6, 0.4, 0.25, 0.1, 0.0)]
    + [(speed, turn) for turn in (0.5, 0.0, -0.5) for speed in (0.5, 0.0)]
)
"""Shares of the desired speed and turning rate that are tried, in this order."""


def certified_twist(
    pose: np.ndarray,
    twist: np.ndarray,
    desired: np.ndarray,
    certificates: tuple[Certificate, ...],
    actuation: Actuation,
) -> tuple[np.ndarray, bool]:
    """The first of PROPOSALS that all certificates accept.

    Args:
        pose: (x, y, yaw) of the robot in W, m and rad.
        twist: (v, omega) commanded now, m/s and rad/s.
        desired: (v, omega) to certify, within the robot's limits.
        certificates: that must accept the motion.
        actuation: what commands do.

    Returns:
        (v, omega), m/s and rad/s, and whether any motion was certified; if not, the twist brakes.
    """
    proposed = PROPOSALS * desired
    k = first_accepted((roll_out(pose, twist, target, actuation) for target in proposed), certificates)
    if k is not None:
        return proposed[k], True
    standing = twist[0] * twist[0] <= 2.0 * actuation.limits.max_acceleration * STOPPED_DISTANCE
    turns = standing and actuation.footprint.is_disc  # which covers no new ground
    return np.array((0.0, desired[1] if turns else 0.0)), False


def ramped_twist(
    twist: Sequence[float] | np.ndarray, target: Sequence[float] | np.ndarray, actuation: Actuation
) -> Twist:
    """The twist after one period of approaching a target within the robot's accelerations.

    Args:
        twist: (v, omega) now, m/s and rad/s.
        target: (v, omega), within the robot's speeds.
        actuation: what commands do.
    """
    limits, period = actuation.limits, actuation.hold
    return Twist(
        ramped(float(twist[0]), float(target[0]), limits.max_acceleration * period),
        ramped(float(twist[1]), float(target[1]), limits.max_yaw_acceleration * period),
    )
