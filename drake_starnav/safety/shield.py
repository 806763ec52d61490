"""What the shield makes of a proposed twist: the most of it that every certificate accepts, else braking."""

from collections.abc import Sequence

import numpy as np
from numba.extending import register_jitable

from drake_starnav.geometry.compiled import kernel
from drake_starnav.robot import Limits
from drake_starnav.robot.motion import (
    SAMPLES,
    Actuation,
    convert_to_velocity,
    ramp_velocity,
    roll_out,
    sample,
)
from drake_starnav.safety.certificates import Certificate, all_accept
from drake_starnav.safety.clear import STOPPED_DISTANCE, ClearanceCertificate, star_covers


def shield_twist(
    pose: np.ndarray,
    twist: np.ndarray,
    desired_twist: np.ndarray,
    certificates: tuple[Certificate, ...],
    actuation: Actuation,
) -> tuple[np.ndarray, bool]:
    """Return the twist that is driven next, and whether it is certified.

    It is ramped from the current twist towards the first proposal that all certificates accept, or towards braking.
    Where a star suffices, and accepts the desired twist, this is one compiled call. Arguments as of
    `find_certified_twist`.
    """
    only_certificate = certificates[0] if len(certificates) == 1 else None
    star = only_certificate.sufficient_star if isinstance(only_certificate, ClearanceCertificate) else None
    if star is not None:
        driven_twist, places = np.empty(len(twist)), actuation.footprint.cover
        if _can_drive(pose, twist, desired_twist, actuation.numbers, star, places, driven_twist):
            return driven_twist, True
    target, is_certified = find_certified_twist(pose, twist, desired_twist, certificates, actuation)
    return ramp_twist(twist, target, actuation), is_certified


@kernel
def _can_drive(pose, twist, target, numbers, star, places, driven_twist):
    """Return whether a star covers the motion to a target, and wheels grip; then write the `driven_twist` after it."""
    samples = np.empty((SAMPLES, 6))
    sample_count, _, _, within_grip = sample(pose, twist, target, numbers, samples)
    if sample_count > SAMPLES or not within_grip or not star_covers(star, samples[:sample_count], places):
        return False
    next_velocity, _ = ramp_velocity(
        convert_to_velocity(twist), convert_to_velocity(target), numbers[1], Limits(*numbers[4:])
    )
    driven_twist[0], driven_twist[-1] = next_velocity.v_x, next_velocity.turning
    if len(driven_twist) == 3:
        driven_twist[1] = next_velocity.v_y
    return True


def find_certified_twist(
    pose: np.ndarray,
    twist: np.ndarray,
    desired_twist: np.ndarray,
    certificates: tuple[Certificate, ...],
    actuation: Actuation,
) -> tuple[np.ndarray, bool]:
    """Return the first of the base's proposals that all certificates accept.

    Args:
        pose: (x, y, yaw) of the robot in W, m and rad.
        twist: commanded now.
        desired_twist: to certify, within the robot's limits.
        certificates: that must accept the motion.
        actuation: what commands do.

    Returns:
        The twist, and whether any motion was certified; if not, the twist brakes.
    """
    base, limits = actuation.base, actuation.limits
    for target in base.proposals(desired_twist, limits):
        if all_accept(roll_out(pose, twist, target, actuation), certificates):
            return target, True
    return make_braking_twist(twist, desired_twist, limits, actuation.footprint.is_disc), False


@register_jitable
def make_braking_twist(twist, desired_twist, limits, is_disc):
    """Return the twist that brakes: a car keeps its curvature; a disc that stands may turn: it covers no new ground."""
    squared, target = 0.0, np.zeros(len(twist))
    for speed in twist[:-1]:
        squared += speed * speed
    if limits.steers > 0.0:
        target[-1] = twist[-1]
    elif is_disc and squared <= 2.0 * limits.max_deceleration * STOPPED_DISTANCE:
        target[-1] = desired_twist[-1]
    return target


def ramp_twist(
    twist: Sequence[float] | np.ndarray, target: Sequence[float] | np.ndarray, actuation: Actuation
) -> np.ndarray:
    """Return the twist after one period of approaching a target within the robot's accelerations.

    Args:
        twist: now.
        target: within the robot's speeds.
        actuation: what commands do.
    """
    next_velocity, _ = ramp_velocity(
        convert_to_velocity(twist), convert_to_velocity(target), actuation.hold, actuation.limits
    )
    return np.array(next_velocity if len(twist) > 2 else (next_velocity.v_x, next_velocity.turning))
