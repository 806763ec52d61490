"""From the poses of a manoeuvre to a twist."""

import math

import numpy as np

from drake_starnav.planning.manoeuvre import reached
from drake_starnav.robot import Base, Limits
from drake_starnav.robot.limits import stopping

SLOW_SHARE, SLOW_SPEED = 0.6, 0.1
"""Of a manoeuvre: share of the largest speed, at most of 0.8 m/s, and what is added to it, m/s."""


def followed_manoeuvre(
    pose: np.ndarray, poses: np.ndarray, base: Base, limits: Limits
) -> tuple[np.ndarray, np.ndarray]:
    """The twist towards the first pose of a manoeuvre that is not reached, and the direction of motion, W.

    Args:
        pose: (x, y, yaw) of the robot, W, m and rad.
        poses: shape (k, 4), as of `planning.manoeuvre.Manoeuvring`.
        base: of the robot.
        limits: of the robot.
    """
    k = min(reached(pose, poses, base), len(poses) - 1)
    x, y, yaw, gear = poses[k].tolist()
    dx, dy, cosine, sine = x - pose[0], y - pose[1], math.cos(pose[2]), math.sin(pose[2])
    ahead, aside = cosine * dx + sine * dy, cosine * dy - sine * dx
    speed = SLOW_SHARE * min(limits.max_speed, 0.8) + SLOW_SPEED
    if k + 1 == len(poses) or poses[k + 1, 3] != gear:
        speed = min(speed, stopping(math.hypot(ahead, aside if base.holonomic else 0.0), limits.max_acceleration))
    twist = base.pursued(ahead, aside, math.remainder(yaw - pose[2], 2.0 * math.pi), gear, speed, limits)
    direction = np.array((dx, dy)) if base.holonomic else math.copysign(1.0, twist[0]) * np.array((cosine, sine))
    return base.saturated(twist, limits), direction / max(math.hypot(*direction), 1e-9)
