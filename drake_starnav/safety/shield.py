"""What the shield makes of a proposed twist: the most of it that every certificate accepts, else braking."""

from collections.abc import Sequence

import numpy as np
from numba.extending import register_jitable

from drake_starnav.geometry.compiled import kernel
from drake_starnav.robot import Limits
from drake_starnav.robot.motion import (
    SAMPLES,
    Actuation,
    ramped_velocity,
    roll_out,
    sample,
    velocity_of,
)
from drake_starnav.safety.certificates import Certificate, accepted
from drake_starnav.safety.clear import STOPPED_DISTANCE, Clear, star_covers


def shield_twist(
    pose: np.ndarray,
    twist: np.ndarray,
    desired: np.ndarray,
    certificates: tuple[Certificate, ...],
    actuation: Actuation,
) -> tuple[np.ndarray, bool]:
    """Return what is driven next: the twist, ramped towards `certified_twist`, and whether any motion was certified.

    Where it is enough that a star accepts what is desired, and it does, this is one compiled call. Arguments as of
    `certified_twist`.
    """
    asked = certificates[0] if len(certificates) == 1 else None
    star = asked.sufficient_star if isinstance(asked, Clear) else None
    if star is not None:
        driven, places = np.empty(len(twist)), actuation.footprint.cover
        if _drives(pose, twist, desired, actuation.numbers, star, places, driven):
            return driven, True
    target, certified = certified_twist(pose, twist, desired, certificates, actuation)
    return ramped_twist(twist, target, actuation), certified


@kernel
def _drives(pose, twist, target, numbers, star, places, driven):
    """Return whether a star covers the motion to a target, and wheels grip; then write the twist after to `driven`."""
    samples = np.empty((SAMPLES, 6))
    count, _, _, grips = sample(pose, twist, target, numbers, samples)
    if count > SAMPLES or not grips or not star_covers(star, samples[:count], places):
        return False
    after, _ = ramped_velocity(velocity_of(twist), velocity_of(target), numbers[1], Limits(*numbers[4:]))
    driven[0], driven[-1] = after.ahead, after.turning
    if len(driven) == 3:
        driven[1] = after.aside
    return True


def certified_twist(
    pose: np.ndarray,
    twist: np.ndarray,
    desired: np.ndarray,
    certificates: tuple[Certificate, ...],
    actuation: Actuation,
) -> tuple[np.ndarray, bool]:
    """Return the first of the base's proposals that all certificates accept.

    Args:
        pose: (x, y, yaw) of the robot in W, m and rad.
        twist: commanded now.
        desired: to certify, within the robot's limits.
        certificates: that must accept the motion.
        actuation: what commands do.

    Returns:
        The twist, and whether any motion was certified; if not, the twist brakes.
    """
    base, limits = actuation.base, actuation.limits
    for target in base.proposals(desired, limits):
        if accepted(roll_out(pose, twist, target, actuation), certificates):
            return target, True
    return braking_twist(twist, desired, limits, actuation.footprint.is_disc), False


@register_jitable
def braking_twist(twist, desired, limits, is_disc):
    """Return the twist that brakes: a car keeps its curvature; a disc that stands may turn: it covers no new ground."""
    squared, target = 0.0, np.zeros(len(twist))
    for speed in twist[:-1]:
        squared += speed * speed
    if limits.steers > 0.0:
        target[-1] = twist[-1]
    elif is_disc and squared <= 2.0 * limits.max_deceleration * STOPPED_DISTANCE:
        target[-1] = desired[-1]
    return target


def ramped_twist(
    twist: Sequence[float] | np.ndarray, target: Sequence[float] | np.ndarray, actuation: Actuation
) -> np.ndarray:
    """Return the twist after one period of approaching a target within the robot's accelerations.

    Args:
        twist: now.
        target: within the robot's speeds.
        actuation: what commands do.
    """
    after, _ = ramped_velocity(velocity_of(twist), velocity_of(target), actuation.hold, actuation.limits)
    return np.array(after if len(twist) > 2 else (after.ahead, after.turning))
