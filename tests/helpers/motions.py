"""Motions as the shield rolls them out, and what it decides about one command."""

import numpy as np

from drake_starnav.control import ControllerInputs, ControllerParameters, followed
from drake_starnav.control.braking_certificate import StarCertificate
from drake_starnav.control.certificates import accepted
from drake_starnav.control.motion import Actuation, roll_out
from drake_starnav.control.shield import certified_twist, ramped_twist
from drake_starnav.geometry.footprint import disc
from drake_starnav.regions.safe_region import CertifiedRegion
from drake_starnav.robot import BASES, Limits, RobotParameters
from tests.helpers.scans import MARGINS

PERIOD = 0.02


def actuation(robot: RobotParameters, hold: float = PERIOD, delay: float = 0.0) -> Actuation:
    """What commands do to a robot."""
    return Actuation(robot.limits, robot.shape, hold, delay)


def motion(
    pose: np.ndarray, twist: np.ndarray, desired: np.ndarray, hold: float, limits: Limits, delay: float = 0.0
) -> np.ndarray:
    """Poses (x, y, yaw) until the robot stands, shape (n, 3): `twist` for the delay, then `desired`, then braking."""
    target = BASES["differential"].saturated(desired, limits)
    return roll_out(pose, twist, target, Actuation(limits, disc(0.25), hold, delay)).pose


def certified(
    pose: np.ndarray,
    twist: np.ndarray,
    desired: np.ndarray,
    hold: float,
    limits: Limits,
    star: CertifiedRegion,
    delay: float = 0.0,
) -> bool:
    """Whether that motion stays inside the certified region, as the package decides it."""
    target = BASES["differential"].saturated(desired, limits)
    return accepted(roll_out(pose, twist, target, Actuation(limits, disc(0.25), hold, delay)), (StarCertificate(star),))


def starred_twist(
    pose: np.ndarray,
    twist: np.ndarray,
    desired: np.ndarray,
    hold: float,
    limits: Limits,
    star: CertifiedRegion,
    delay: float = 0.0,
) -> tuple[float, float, bool]:
    """What the shield makes of a twist in a static world: v, omega, and whether any motion was certified."""
    target = BASES["differential"].saturated(desired, limits)
    command = Actuation(limits, disc(0.25), hold, delay)
    (v, omega), certain = certified_twist(pose, twist, target, (StarCertificate(star),), command)
    return float(v), float(omega), certain


def limited_twist(twist: np.ndarray, desired: np.ndarray, robot: RobotParameters, period: float) -> np.ndarray:
    """The twist after one period of a robot that follows its commands within its limits."""
    return ramped_twist(twist, robot.drive.saturated(desired, robot.limits), actuation(robot, period))


def stepped(
    inputs: ControllerInputs, parameters: ControllerParameters, robot: RobotParameters
) -> tuple[np.ndarray, bool]:
    """The twist after one period of our controller and the shield in a static world, and whether it is certified."""
    pose, twist, _, star = inputs
    period = 1.0 / parameters.rate
    proposed = followed(inputs, MARGINS, robot).twist
    *target, accepted = starred_twist(pose, twist, proposed, period, robot.limits, star, parameters.delay)
    return limited_twist(twist, np.array(target), robot, period), accepted


def least_clearance(poses: np.ndarray, hits: np.ndarray, needed: np.ndarray) -> float:
    """Least distance of the poses (n, 3) to the hits (m, 2), less what each needs (m,), m."""
    return float((np.hypot(*np.moveaxis(poses[:, None, :2] - hits, -1, 0)) - needed).min())
