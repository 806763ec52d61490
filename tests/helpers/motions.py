"""Motions as the shield rolls them out, and what it decides about one command."""

import math

import numpy as np

from drake_starnav.control import ControllerInputs, ControllerParameters, follow_guidance
from drake_starnav.geometry.footprint import disc
from drake_starnav.robot import BASES, Limits, RobotParameters
from drake_starnav.robot.motion import Actuation, roll_out
from drake_starnav.safety.certificates import all_accept
from drake_starnav.safety.clear import ClearanceCertificate
from drake_starnav.safety.shield import find_certified_twist, ramp_twist
from drake_starnav.surroundings.certified_star import CertifiedStar
from drake_starnav.surroundings.surroundings import Surroundings
from drake_starnav.utils.snapshot import replace_fields

PERIOD, ORIGIN = 0.02, np.zeros(2)
FINE = 2e-4
"""Step of the integration that stands for the true motion, s."""


def actuation(robot: RobotParameters, hold: float = PERIOD, delay: float = 0.0) -> Actuation:
    """What commands do to a robot."""
    return Actuation(robot.limits, robot.shape, hold, delay, robot.drive)


def only_star(values: np.ndarray, center: np.ndarray = ORIGIN) -> Surroundings:
    """Surroundings in which nothing but a star about `center` is known, by its boundary at M bearings, m."""
    return replace_fields(Surroundings.unknown(), certified_star=CertifiedStar(center, 0.0, values))


def clear(star: Surroundings) -> ClearanceCertificate:
    """The certificate of a disc of 0.25 m with the margin that a star was made for; none if it is no scan's."""
    return ClearanceCertificate(star, max(star.certified_star.radius - 0.25, 0.0), disc(0.25))


def certified(
    pose: np.ndarray,
    twist: np.ndarray,
    desired: np.ndarray,
    hold: float,
    limits: Limits,
    star: Surroundings,
    delay: float = 0.0,
) -> bool:
    """Whether that motion is certified, as the package decides it."""
    target = BASES["differential"].saturate(desired, limits)
    return all_accept(roll_out(pose, twist, target, Actuation(limits, disc(0.25), hold, delay)), (clear(star),))


def starred_twist(
    pose: np.ndarray,
    twist: np.ndarray,
    desired: np.ndarray,
    hold: float,
    limits: Limits,
    star: Surroundings,
    delay: float = 0.0,
) -> tuple[float, float, bool]:
    """What the shield makes of a twist in a static world: v, omega, and whether any motion was certified."""
    target = BASES["differential"].saturate(desired, limits)
    command = Actuation(limits, disc(0.25), hold, delay)
    (v, omega), certain = find_certified_twist(pose, twist, target, (clear(star),), command)
    return float(v), float(omega), certain


def limited_twist(twist: np.ndarray, desired: np.ndarray, robot: RobotParameters, period: float) -> np.ndarray:
    """The twist after one period of a robot that follows its commands within its limits."""
    return ramp_twist(twist, robot.drive.saturate(desired, robot.limits), actuation(robot, period))


def stepped(
    inputs: ControllerInputs, parameters: ControllerParameters, robot: RobotParameters
) -> tuple[np.ndarray, bool]:
    """The twist after one period of our controller and the shield in a static world, and whether it is certified."""
    pose, twist, _, star = inputs
    period = 1.0 / parameters.rate
    proposed = follow_guidance(inputs, robot).twist
    *target, accepted = starred_twist(pose, twist, proposed, period, robot.limits, star, parameters.delay)
    return limited_twist(twist, np.array(target), robot, period), accepted


def exact_rates(
    time: np.ndarray, twist: np.ndarray, target: np.ndarray, actuation: Actuation
) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Velocity in the robot's frame (n, 2), turning rate (n,) and curvature (n,), where it steers, at times (n,)."""
    limits, hold, delay = actuation.limits, actuation.hold, actuation.delay
    since, left = np.clip(time - delay, 0.0, hold), np.clip(time - delay - hold, 0.0, None)
    begin, end = ((*value[:-1], 0.0)[:2] for value in (twist, target))
    gap = np.subtract(end, begin)
    held = begin + share_of_change(begin, gap, since, limits)[:, None] * gap
    size = np.hypot(*held.T)
    velocity = held * (np.clip(size - limits.max_deceleration * left, 0.0, None) / np.maximum(size, 1e-12))[:, None]
    most = limits.max_yaw_acceleration * since
    turning = twist[-1] + np.clip(target[-1] - twist[-1], -most, most)
    if limits.steers:
        return velocity, turning * velocity[:, 0], turning
    return velocity, np.sign(turning) * np.clip(abs(turning) - limits.max_yaw_acceleration * left, 0.0, None), turning


def share_of_change(begin: np.ndarray, gap: np.ndarray, since: np.ndarray, limits: Limits) -> np.ndarray:
    """How much of a change of the velocity has been done at times (n,): the speed falls, then it grows."""
    change = max(math.hypot(*gap), 1e-12)
    falling = min(max(-float(np.dot(begin, gap)) / change, 0.0), change)
    braking = falling / limits.max_deceleration
    done = limits.max_deceleration * np.minimum(since, braking)
    done += limits.max_acceleration * np.clip(since - braking, 0.0, None)
    return np.minimum(done / change, 1.0)


def exact_poses(twist: np.ndarray, target: np.ndarray, actuation: Actuation) -> np.ndarray:
    """(x, y, yaw) of the robot from 0 on, while it does exactly what `roll_out` describes, shape (n, 3), m and rad."""
    limits, until = actuation.limits, actuation.delay + actuation.hold
    velocity, turning, _ = exact_rates(np.array((until,)), twist, target, actuation)
    stop = float(np.hypot(*velocity[0])) / limits.max_deceleration
    stop = stop if limits.steers else max(stop, abs(float(turning[0])) / limits.max_yaw_acceleration)
    velocity, turning, _ = exact_rates(np.arange(0.0, until + stop + FINE, FINE), twist, target, actuation)
    middle = 0.5 * FINE * np.column_stack((velocity[1:] + velocity[:-1], turning[1:] + turning[:-1]))
    yaw = np.concatenate(([0.0], np.cumsum(middle[:, 2])))
    moved = turned(middle[:, :2], yaw[:-1] + 0.5 * middle[:, 2])
    return np.column_stack((np.vstack((np.zeros((1, 2)), np.cumsum(moved, axis=0))), yaw))


def turned(vectors: np.ndarray, angle: np.ndarray) -> np.ndarray:
    """Vectors (n, 2), each turned by an angle (n,), rad."""
    (x, y), cosine, sine = vectors.T, np.cos(angle), np.sin(angle)
    return np.column_stack((cosine * x - sine * y, sine * x + cosine * y))
