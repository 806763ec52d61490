"""Poses (x, y, yaw) in the plane, m and rad, and their transforms between frames."""

import math

import numpy as np

from drake_starnav.geometry.compiled import kernel


def find_pose_in_frame(frame: np.ndarray, pose: np.ndarray) -> tuple[float, float, float]:
    """A pose (x, y, yaw) in the frame at the pose `frame`; both are given in one outer frame."""
    dx, dy, yaw = float(pose[0] - frame[0]), float(pose[1] - frame[1]), float(frame[2])
    turn = math.remainder(float(pose[2]) - yaw, 2.0 * math.pi)
    return dx * math.cos(yaw) + dy * math.sin(yaw), dy * math.cos(yaw) - dx * math.sin(yaw), turn


Place = tuple[float, float, float] | np.ndarray
"""A pose (x, y, yaw), m and rad."""


def compose_poses(frame: Place, step: Place) -> np.ndarray:
    """The pose, shape (3,), in the outer frame of a pose `step` given in `frame`; its yaw is within [-pi, pi]."""
    x, y, yaw = frame
    dx, dy, turn = step
    return np.array(
        (
            x + dx * math.cos(yaw) - dy * math.sin(yaw),
            y + dx * math.sin(yaw) + dy * math.cos(yaw),
            math.remainder(yaw + turn, 2.0 * math.pi),
        )
    )


def invert_pose(frame: np.ndarray) -> np.ndarray:
    """The pose, shape (3,), of the outer frame in `frame`."""
    return np.array(find_pose_in_frame(frame, np.zeros(3)))


def transform_points(frame: np.ndarray, points: np.ndarray) -> np.ndarray:
    """Points, shape (n, 2), given in `frame`, in the outer frame; shape (n, 2), m."""
    x, y, yaw = frame
    return _transform_points(
        np.ascontiguousarray(points, dtype=float), float(x), float(y), math.cos(yaw), math.sin(yaw)
    )


@kernel
def _transform_points(points, x, y, cosine, sine):
    """The loop of `transform_points`."""
    out = np.empty((len(points), 2))
    for k in range(len(points)):
        dx, dy = points[k, 0], points[k, 1]
        out[k, 0], out[k, 1] = x + dx * cosine - dy * sine, y + dx * sine + dy * cosine
    return out


def place_points(poses: np.ndarray, points: np.ndarray) -> np.ndarray:
    """Where points (k, 2) of a robot are at its poses (n, 3), shape (n * k, 2), W, m; the points of a pose in a row."""
    cosine, sine = np.cos(poses[:, 2, None]), np.sin(poses[:, 2, None])
    x = poses[:, 0, None] + cosine * points[:, 0] - sine * points[:, 1]
    y = poses[:, 1, None] + sine * points[:, 0] + cosine * points[:, 1]
    return np.stack((x, y), axis=-1).reshape(-1, 2)
