"""String pulling: paths shortened inside the union of regions."""

import math

import numpy as np
from numba import njit

from drake_starnav.geometry.polyline import subdivided
from drake_starnav.planning.region_index import IndexedRegions, newest_cover, newest_of
from drake_starnav.regions.star_region import LINE_STEP, covers_offset

FORWARD_STEP, BACKWARD_STEP = 0.2, 0.1
"""Spacing of the points that the path may skip to, in the first and in the second pass, m."""

GAP_SAMPLES = 10
"""Length of a gap between regions that is looked at, in samples."""


def string_pulled(path: np.ndarray, position: np.ndarray, regions: IndexedRegions) -> np.ndarray:
    """The path shortened inside the union of regions: from the robot forwards, then, finer, from its end backwards.

    Args:
        path: shape (k, 2), way points after the robot, W, m.
        position: of the robot, shape (2,), W, m.
        regions: whose union bounds the path.

    Returns:
        Shape (m, 2), W, m; ends where the path ends.
    """
    line = np.vstack((position, path))
    forward = _pull(subdivided(line, FORWARD_STEP)[1:], *position, regions)
    line = np.vstack((position, forward))
    backward = _pull(subdivided(line, BACKWARD_STEP)[:-1][::-1].copy(), *line[-1], regions)
    if not len(backward) or np.hypot(*(backward[-1] - position)) > 1e-6:
        return forward
    return np.vstack((backward[:-1][::-1], line[-1:]))


@njit(cache=True)
def last_in_sight(points, first, x, y, regions):
    """Index of the last of points[first:] in line of sight from (x, y), or -1."""
    if newest_cover(regions, x, y) < 0:
        return -1
    blocked = 0.0  # how far from (x, y) the last line left the regions: the next one probably does, too
    for j in range(len(points) - 1, first - 1, -1):
        blocked = blocked_at(regions, x, y, points[j, 0], points[j, 1], blocked)
        if blocked < 0.0:
            return j
    return -1


@njit(cache=True)
def in_sight(regions, x0, y0, x1, y1):
    """Whether the straight segment stays inside the union of the regions, as `segment_covered` with LINE_STEP."""
    return blocked_at(regions, x0, y0, x1, y1, 0.0) < 0.0


@njit(cache=True)
def blocked_at(regions, x0, y0, x1, y1, guess):
    """A place outside the union of the regions on the segment, from its start, m; -1 if `segment_covered`.

    The samples are those of `segment_covered`, first the one at `guess`. Many at once are found in one region, if the
    least of its values between the bearings of the first and the last is no less than the distances of both.
    """
    u = regions
    center, bearing_0, values, reach, marks, corner = u.center, u.bearing_0, u.values, u.reach, u.marks, u.corner
    cell, every = u.cell, u.every
    length = math.hypot(x1 - x0, y1 - y0)
    count = int(length / LINE_STEP) + 1
    if 0.0 < guess < length:
        i = int(guess / length * count + 0.5)
        x, y = x0 + (x1 - x0) * i / count, y0 + (y1 - y0) * i / count
        if newest_of(center, bearing_0, values, reach, marks, corner, cell, x, y, 0.0, -1, every) < 0:
            return max(length * i / count, 1e-9)
    last, i, step = -1, 0, 1
    while i <= count:
        x, y = x0 + (x1 - x0) * i / count, y0 + (y1 - y0) * i / count
        before = last
        if last < 0 or not covers_offset(bearing_0, values, last, x - center[last, 0], y - center[last, 1]):
            last = newest_of(center, bearing_0, values, reach, marks, corner, cell, x, y, 0.0, -1, every)
        if last < 0:
            return max(length * _within_gap(regions, x0, y0, x1, y1, i, count) / count, 1e-9)
        if last != before:
            step = 16
        i += 1
        while step > 1 and i <= count:
            ahead = min(i + step, count)
            far_x, far_y = x0 + (x1 - x0) * ahead / count, y0 + (y1 - y0) * ahead / count
            if _covers_all(center, bearing_0, values, last, x, y, far_x, far_y):
                i = ahead + 1
                x, y = far_x, far_y
                step *= 2
            else:
                step //= 2
    return -1.0


@njit(cache=True)
def _within_gap(regions, x0, y0, x1, y1, first, count):
    """The middle one of some samples of a segment from `first` on that are not covered: most neighbours of the segment
    are not covered there either."""
    u = regions
    center, bearing_0, values, reach, marks, corner = u.center, u.bearing_0, u.values, u.reach, u.marks, u.corner
    i = first + 1
    while i <= min(count, first + GAP_SAMPLES):
        x, y = x0 + (x1 - x0) * i / count, y0 + (y1 - y0) * i / count
        if newest_of(center, bearing_0, values, reach, marks, corner, u.cell, x, y, 0.0, -1, u.every) >= 0:
            break
        i += 1
    return (first + i - 1) // 2


@njit(cache=True)
def _covers_all(center, bearing_0, values, k, x0, y0, x1, y1):
    """Whether region k certainly covers the segment: its values between the bearings of both ends are large enough."""
    ax, ay, bx, by = x0 - center[k, 0], y0 - center[k, 1], x1 - center[k, 0], y1 - center[k, 1]
    if ax * ax + ay * ay < 1e-12:  # no bearing
        ax, ay = bx, by
    farthest = math.sqrt(max(ax * ax + ay * ay, bx * bx + by * by)) + 1e-9
    turn = math.atan2(ax * by - ay * bx, ax * bx + ay * by)
    if not abs(turn) < 3.0:
        return False
    samples = values.shape[1]
    step = 2.0 * math.pi / samples
    begin = math.atan2(ay, ax) - bearing_0[k]
    low, high = min(begin, begin + turn), max(begin, begin + turn)
    for m in range(int(math.floor(low / step - 1e-6)), int(math.floor(high / step + 1e-6)) + 2):
        if values[k, m % samples] < farthest:
            return False
    return True


@njit(cache=True)
def _pull(points, x, y, regions):
    """From (x, y), go repeatedly to the last point in line of sight."""
    count = len(points)
    out = np.empty((count, 2))
    n = 0
    i = np.int64(0)  # a literal would compile `last_in_sight` twice
    while i < count:
        j = max(last_in_sight(points, i, x, y, regions), i)
        x, y = points[j, 0], points[j, 1]
        out[n, 0], out[n, 1] = x, y
        n += 1
        i = j + 1
    return out[:n].copy()
