"""Certificates for rules of a place: areas that the robot must stay out of, and areas in which it must be slow."""

import math

import numpy as np

from drake_starnav.control.motion import Motion
from drake_starnav.errors import StarnavError
from drake_starnav.geometry.se2 import places


class KeepOut:
    """Accepts motions on which the robot, as the discs that cover its footprint, stays out of a polygon.

    A robot that begins nearer may move, but not nearer to the polygon. The planner does not know the
    area: a robot whose way leads through it stops at its edge, and tries another way once it has stalled.
    """

    def __init__(self, polygon: np.ndarray, *, margin: float = 0.02) -> None:
        """
        Args:
            polygon: corners, shape (n, 2), n >= 3, W, m; simple, in either order.
            margin: kept beyond those discs, m: half the distance between two samples, and the base's error.

        Raises:
            StarnavError: the polygon has another shape or is not finite, or the margin is negative.
        """
        self.polygon, self._margin = _corners(polygon, "KeepOut"), margin
        if not (math.isfinite(margin) and margin >= 0.0):
            raise StarnavError(f"KeepOut: margin is {margin}; allowed: 0 m or more")

    def accepts(self, motion: Motion) -> bool:
        """Whether the robot keeps its distance, or the one that it has."""
        narrow, cover = motion.footprint.narrow, motion.footprint.cover
        distance = signed_distance(self.polygon, places(motion.pose, cover)).reshape(-1, len(cover)).min(axis=1)
        return bool(distance.min() >= min(narrow + self._margin, distance[0]) - 1e-9)


class SpeedZone:
    """Accepts motions on which the robot is no faster than a limit while its centre is in a polygon.

    A robot that is too fast already brakes.
    """

    def __init__(self, polygon: np.ndarray, max_speed: float) -> None:
        """
        Args:
            polygon: corners, shape (n, 2), n >= 3, W, m; simple, in either order.
            max_speed: m/s.

        Raises:
            StarnavError: the polygon has another shape or is not finite, or the speed is not above 0.
        """
        self.polygon, self.max_speed = _corners(polygon, "SpeedZone"), max_speed
        if not (math.isfinite(max_speed) and max_speed > 0.0):
            raise StarnavError(f"SpeedZone: max_speed is {max_speed}; allowed: more than 0 m/s")

    def accepts(self, motion: Motion) -> bool:
        """Whether the robot is slow wherever the zone says so."""
        fast = np.abs(motion.twist[:, 0]) > self.max_speed + 1e-9
        if not fast.any():
            return True
        fast[1:] |= fast[:-1]  # where it is slow enough, it has just slowed down
        return bool((signed_distance(self.polygon, motion.position[fast]) > 0.0).all())


def signed_distance(polygon: np.ndarray, points: np.ndarray) -> np.ndarray:
    """Distance of points (m, 2) to a polygon (n, 2), negative inside; shape (m,), m."""
    start, along = polygon, np.roll(polygon, -1, axis=0) - polygon
    offset = points[:, None] - start
    share = np.clip((offset * along).sum(axis=2) / np.maximum((along * along).sum(axis=1), 1e-18), 0.0, 1.0)
    away = offset - share[..., None] * along
    distance = np.sqrt((away * away).sum(axis=2).min(axis=1))
    end_y = (start + along)[:, 1]
    crosses = (start[:, 1] > points[:, 1, None]) != (end_y > points[:, 1, None])
    rise = np.where(along[:, 1] == 0.0, 1.0, along[:, 1])
    left = points[:, 0, None] < start[:, 0] + along[:, 0] * (points[:, 1, None] - start[:, 1]) / rise
    return np.where((crosses & left).sum(axis=1) % 2 == 1, -distance, distance)


def _corners(polygon: np.ndarray, name: str) -> np.ndarray:
    corners = np.array(polygon, dtype=float)
    if corners.ndim != 2 or corners.shape[1:] != (2,) or len(corners) < 3 or not np.isfinite(corners).all():
        raise StarnavError(f"{name}: polygon has shape {corners.shape}; allowed: (n, 2), n >= 3, finite x and y")
    return corners
