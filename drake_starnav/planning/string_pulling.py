"""String pulling: paths shortened inside the union of regions."""

import numpy as np
from numba import njit

from drake_starnav.geometry.polyline import subdivided
from drake_starnav.surroundings.region_union import RegionUnion, cover_at, first_gap

FORWARD_STEP, BACKWARD_STEP = 0.8, 0.4
"""Spacing of the points that the path may skip to, in the first and in the second pass, in radii of the robot."""


def string_pulled(path: np.ndarray, position: np.ndarray, regions: RegionUnion, radius: float) -> np.ndarray:
    """The path shortened inside the union of regions: from the robot forwards, then, finer, from its end backwards.

    Args:
        path: shape (k, 2), way points after the robot, W, m.
        position: of the robot, shape (2,), W, m.
        regions: whose union bounds the path.
        radius: of the robot, m.

    Returns:
        Shape (m, 2), W, m; ends where the path ends.
    """
    line = np.vstack((position, path))
    forward = _pull(subdivided(line, FORWARD_STEP * radius)[1:], position, regions, radius)
    line = np.vstack((position, forward))
    backward = _pull(subdivided(line, BACKWARD_STEP * radius)[:-1][::-1].copy(), line[-1], regions, radius)
    if not len(backward) or np.hypot(*(backward[-1] - position)) > 1e-6:
        return forward
    return np.vstack((backward[:-1][::-1], line[-1:]))


@njit(cache=True)
def last_in_sight(points, x, y, union, radius):
    """Index of the last of some points (n, 2) in line of sight from (x, y) inside a union, or -1, for a robot."""
    if cover_at(union, x, y, 0.0) < 0:
        return -1
    gap = 0.0  # where the last line left the union: the next one probably does, too
    for j in range(len(points) - 1, -1, -1):
        gap = first_gap(union, (x, y), (points[j, 0], points[j, 1]), gap, radius)
        if gap < 0.0:
            return j
    return -1


def _pull(points: np.ndarray, position: np.ndarray, regions: RegionUnion, radius: float) -> np.ndarray:
    """From a position (2,), go repeatedly to the last of some points (n, 2) in line of sight."""
    kept, i = [], 0
    while i < len(points):
        i += max(last_in_sight(points[i:], *position, regions, radius), 0)
        position = points[i]
        kept.append(position)
        i += 1
    return np.array(kept).reshape(-1, 2)
