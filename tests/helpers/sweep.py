"""A robot's motion in steps of a few milliseconds, independently of the samples that the package rolls out."""

import math

import numpy as np

from drake_starnav.geometry.compiled import kernel
from drake_starnav.robot import Limits
from drake_starnav.robot.motion import convert_to_velocity

STEP = 4e-3
"""Of the sweep, s."""


@kernel
def swept(pose, velocity, target, phases, limits):
    """Poses (n, 3) every STEP of a robot that keeps its velocity, ramps to the target, and then brakes.

    Args:
        pose: (x, y, yaw), W.
        velocity, target: speeds along x and y and turning rate, or curvature, shape (3,).
        phases: delay and hold, s.
        limits: `Limits`.
    """
    braking = 1.0 + int(max(abs(velocity[2]), abs(target[2])) / max(limits.max_yaw_acceleration, 1e-9))
    braking += int(
        max(math.hypot(velocity[0], velocity[1]), math.hypot(target[0], target[1])) / limits.max_deceleration
    )
    out = np.empty((int((phases[0] + phases[1] + braking) / STEP) + 4, 3))
    out[0], moving, n = pose, velocity.copy(), 1
    for phase in range(3):
        duration = phases[phase] if phase < 2 else braking
        for _ in range(int(round(duration / STEP))):
            aim = velocity.copy() if phase == 0 else target.copy() if phase == 1 else np.zeros(3)
            if phase == 2 and limits.steers > 0.0:
                aim[2] = moving[2]
            dx, dy = aim[0] - moving[0], aim[1] - moving[1]
            falls = dx * moving[0] + dy * moving[1] < 0.0
            change = limits.max_deceleration if falls else limits.max_acceleration
            share = min(change * STEP / max(math.hypot(dx, dy), 1e-12), 1.0)
            most = limits.max_yaw_acceleration * STEP
            after = np.array(
                (moving[0] + share * dx, moving[1] + share * dy, moving[2] + min(max(aim[2] - moving[2], -most), most))
            )
            x, y, turning = 0.5 * (moving + after)
            moving = after
            omega = turning * x if limits.steers > 0.0 else turning
            yaw = out[n - 1, 2] + 0.5 * omega * STEP
            out[n, 0] = out[n - 1, 0] + STEP * (math.cos(yaw) * x - math.sin(yaw) * y)
            out[n, 1] = out[n - 1, 1] + STEP * (math.sin(yaw) * x + math.cos(yaw) * y)
            out[n, 2] = out[n - 1, 2] + omega * STEP
            n += 1
            if phase == 2 and abs(moving[0]) + abs(moving[1]) < 1e-12 and (limits.steers > 0.0 or moving[2] == 0.0):
                break
    return out[:n]


def sweep(
    pose: np.ndarray, twists: tuple[np.ndarray, np.ndarray], phases: tuple[float, float], limits: Limits
) -> np.ndarray:
    """`swept` of a robot that is commanded the first twist, and now the second one."""
    return swept(
        pose, np.array(convert_to_velocity(twists[0])), np.array(convert_to_velocity(twists[1])), phases, limits
    )
