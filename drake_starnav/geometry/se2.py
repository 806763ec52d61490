"""Poses (x, y, yaw) in the plane, m and rad, and what follows when one frame lies in another."""

import math

import numpy as np


def now_in(frame: np.ndarray, pose: np.ndarray) -> tuple[float, float, float]:
    """A pose (x, y, yaw) as seen from another one."""
    dx, dy, yaw = float(pose[0] - frame[0]), float(pose[1] - frame[1]), float(frame[2])
    turn = math.remainder(float(pose[2]) - yaw, 2.0 * math.pi)
    return dx * math.cos(yaw) + dy * math.sin(yaw), dy * math.cos(yaw) - dx * math.sin(yaw), turn


def composed(frame: np.ndarray, step: tuple[float, float, float] | np.ndarray) -> np.ndarray:
    """The pose, shape (3,), that is at `step` (x, y, yaw) in another one; its yaw within a half turn."""
    x, y, yaw = frame
    dx, dy, turn = step
    return np.array(
        (
            x + dx * math.cos(yaw) - dy * math.sin(yaw),
            y + dx * math.sin(yaw) + dy * math.cos(yaw),
            math.remainder(yaw + turn, 2.0 * math.pi),
        )
    )


def inverse(frame: np.ndarray) -> np.ndarray:
    """The pose, shape (3,), of the outer frame as seen from `frame`."""
    return np.array(now_in(frame, np.zeros(3)))


def placed(frame: np.ndarray, points: np.ndarray) -> np.ndarray:
    """Points (n, 2) of a frame that is at the pose `frame`, as points of the frame around it, shape (n, 2)."""
    x, y, yaw = frame
    dx, dy = points[:, 0], points[:, 1]
    cosine, sine = math.cos(yaw), math.sin(yaw)
    return np.column_stack((x + dx * cosine - dy * sine, y + dx * sine + dy * cosine))
