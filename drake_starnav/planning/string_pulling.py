"""String pulling: paths shortened inside the union of regions."""

import numpy as np
from numba import njit

from drake_starnav.geometry.polyline import subdivided
from drake_starnav.regions.star_region import LINE_STEP, RegionStack, segment_covered

FORWARD_STEP, BACKWARD_STEP = 0.2, 0.1
"""Spacing of the points that the path may skip to, in the first and in the second pass, m."""


def string_pulled(path: np.ndarray, position: np.ndarray, regions: RegionStack) -> np.ndarray:
    """The path shortened inside the union of regions: from the robot forwards, then, finer, from its end backwards.

    Args:
        path: shape (k, 2), way points after the robot, W, m.
        position: of the robot, shape (2,), W, m.
        regions: whose union bounds the path.

    Returns:
        Shape (m, 2), W, m; ends where the path ends.
    """
    arrays = regions.arrays
    line = np.vstack((position, path))
    forward = _pull(subdivided(line, FORWARD_STEP)[1:], *position, *arrays)
    line = np.vstack((position, forward))
    backward = _pull(subdivided(line, BACKWARD_STEP)[:-1][::-1].copy(), *line[-1], *arrays)
    if not len(backward) or np.hypot(*(backward[-1] - position)) > 1e-6:
        return forward
    return np.vstack((backward[:-1][::-1], line[-1:]))


def last_in_sight(points: np.ndarray, position: np.ndarray, regions: RegionStack) -> int:
    """Index of the last point that is reached by a straight line inside the union of regions, or -1.

    Args:
        points: shape (k, 2), W, m.
        position: start of the lines, shape (2,), W, m.
        regions: whose union bounds the lines.
    """
    return int(_last_in_sight(points, 0, *position, *regions.arrays))


@njit(cache=True)
def _last_in_sight(points, first, x, y, center, bearing_0, values, reach):
    """Index of the last of points[first:] in line of sight from (x, y), or -1."""
    for j in range(len(points) - 1, first - 1, -1):
        if segment_covered(center, bearing_0, values, reach, x, y, points[j, 0], points[j, 1], LINE_STEP):
            return j
    return -1


@njit(cache=True)
def _pull(points, x, y, center, bearing_0, values, reach):
    """From (x, y), go repeatedly to the last point in line of sight."""
    count = len(points)
    out = np.empty((count, 2))
    n = 0
    i = np.int64(0)  # a literal would compile `_last_in_sight` twice
    while i < count:
        j = max(_last_in_sight(points, i, x, y, center, bearing_0, values, reach), i)
        x, y = points[j, 0], points[j, 1]
        out[n, 0], out[n, 1] = x, y
        n += 1
        i = j + 1
    return out[:n].copy()
