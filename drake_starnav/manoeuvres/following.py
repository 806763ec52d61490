"""From the poses of a manoeuvre to a twist."""

import math
from itertools import pairwise

import numpy as np

from drake_starnav.manoeuvres.manoeuvre import count_reached
from drake_starnav.robot import RobotParameters
from drake_starnav.robot.limits import compute_stopping_speed

SLOW_SHARE, SLOW_STOP = 0.725, 0.357
"""A manoeuvre is driven with this share of the largest speed, or so that the robot stops within this many radii."""


def follow_manoeuvre(pose: np.ndarray, poses: np.ndarray, robot: RobotParameters) -> tuple[np.ndarray, np.ndarray]:
    """Return the twist towards the first pose of a manoeuvre that is not reached, and the direction of motion, W.

    Args:
        pose: (x, y, yaw) of the robot, W, m and rad.
        poses: shape (k, 4), as of `planning.state.ManoeuvreState`.
        robot: that drives them.
    """
    base, limits, radius = robot.drive, robot.limits, robot.shape.radius
    k = min(count_reached(pose, poses, base, radius), len(poses) - 1)
    x, y, yaw, gear = poses[k].tolist()
    dx, dy, cosine, sine = x - pose[0], y - pose[1], math.cos(pose[2]), math.sin(pose[2])
    ahead, aside = cosine * dx + sine * dy, cosine * dy - sine * dx
    speed = min(SLOW_SHARE * limits.max_speed, math.sqrt(2.0 * limits.max_deceleration * SLOW_STOP * radius))
    distance_left = measure_way_left(math.hypot(ahead, aside if base.holonomic else 0.0), poses[k:])
    speed = min(speed, compute_stopping_speed(distance_left, limits.max_deceleration))
    twist = base.twist_towards(ahead, aside, math.remainder(yaw - pose[2], 2.0 * math.pi), gear, speed, limits)
    direction = np.array((dx, dy)) if base.holonomic else math.copysign(1.0, twist[0]) * np.array((cosine, sine))
    return base.saturate(twist, limits), direction / max(math.hypot(*direction), 1e-9)


def measure_way_left(length: float, poses: np.ndarray) -> float:
    """Return the way to the first of some poses (k, 4), which has a length, and on until the gear changes, m."""
    for previous_pose, next_pose in pairwise(poses):
        if next_pose[3] != poses[0, 3]:
            break
        length += math.dist(previous_pose[:2], next_pose[:2])
    return length
