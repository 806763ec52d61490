"""Paths pulled tight like a string inside the union of regions."""

import math

import numpy as np
from numba import njit

from drake_starnav.regions.star_region import LINE_STEP, RegionStack, segment_covered


def string_pulled(path: np.ndarray, position: np.ndarray, regions: RegionStack) -> np.ndarray:
    """The path shortened inside the union of regions: from the robot forwards, then, finer, from the end back.

    Args:
        path: shape (k, 2), way points after the robot, W, m.
        position: of the robot, shape (2,), W, m.
        regions: whose union bounds the path.

    Returns:
        Shape (m, 2), W, m; ends where the path ends.
    """
    arrays = regions.arrays
    line = np.vstack((position, path))
    forward = _pull(_resampled(line, 0.2)[1:], *position, *arrays)
    line = np.vstack((position, forward))
    backward = _pull(_resampled(line, 0.1)[:-1][::-1].copy(), *line[-1], *arrays)
    if not len(backward) or np.hypot(*(backward[-1] - position)) > 1e-6:
        return forward
    return np.vstack((backward[:-1][::-1], line[-1:]))


def last_in_sight(points: np.ndarray, position: np.ndarray, regions: RegionStack) -> int:
    """Index of the last of the points to which the straight line stays inside the union of regions, or -1.

    Args:
        points: shape (k, 2), W, m.
        position: where the lines begin, shape (2,), W, m.
        regions: that bound them.
    """
    return int(_last_in_sight(points, 0, *position, *regions.arrays))


def _resampled(line: np.ndarray, step: float) -> np.ndarray:
    """The polyline with intermediate points at most `step` apart; corners stay."""
    points = [line[:1]]
    for a, b in zip(line[:-1], line[1:], strict=True):
        count = int(math.hypot(b[0] - a[0], b[1] - a[1]) / step) + 1
        points.append(a + (b - a) * (np.arange(1, count + 1) / count)[:, None])
    return np.vstack(points)


@njit(cache=True)
def _last_in_sight(points, first, x, y, center, bearing_0, values, reach):
    """Index of the last of points[first:] in line of sight from (x, y), or -1."""
    for j in range(len(points) - 1, first - 1, -1):
        if segment_covered(center, bearing_0, values, reach, x, y, points[j, 0], points[j, 1], LINE_STEP):
            return j
    return -1


@njit(cache=True)
def _pull(points, x, y, center, bearing_0, values, reach):
    """From (x, y) always on to the last of the points in line of sight."""
    count = len(points)
    out = np.empty((count, 2))
    n = 0
    i = np.int64(0)  # a literal would have `_last_in_sight` compiled twice
    while i < count:
        j = max(_last_in_sight(points, i, x, y, center, bearing_0, values, reach), i)
        x, y = points[j, 0], points[j, 1]
        out[n, 0], out[n, 1] = x, y
        n += 1
        i = j + 1
    return out[:n].copy()
