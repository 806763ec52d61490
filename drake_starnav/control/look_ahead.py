"""The look-ahead point: how far along a path the robot may aim without cutting corners too closely."""

import math

import numpy as np
from numba import njit

from drake_starnav.control.point_certificate import clearance_at

CLEAR = 0.10
"""A chord with this clearance is never too close, m."""
CORNER_CUT = 0.015
"""A chord may have this much less clearance than the path it replaces, m."""
SPACING = 0.10
"""The path is sampled this finely, m."""
NEAREST = 0.08
"""A look-ahead point nearer than this is not used, m."""


def look_ahead(
    position: np.ndarray, path: np.ndarray, hits: np.ndarray, needed: np.ndarray, distance: float, least: float
) -> tuple[np.ndarray, float, bool]:
    """The farthest point of the path within `distance` to which the straight line stays clear.

    The line must keep min(CLEAR, max(clearance of the path up to there - CORNER_CUT, `least`)).

    Args:
        position: of the robot, shape (2,), W, m.
        path: shape (k, 2), way points ahead, W, m.
        hits: shape (n, 2), W, m.
        needed: shape (n,), distance to keep from each at least, m; see `needed_distances`.
        distance: how far away the point may be, m.
        least: clearance that every line must have, m.

    Returns:
        The point, shape (2,); the clearance of the line, m, exact up to CLEAR; whether it is the end of the path.
    """
    within = np.hypot(hits[:, 0] - position[0], hits[:, 1] - position[1]) < distance + needed.max(initial=0.0) + CLEAR
    x, y, clear, last = _look_ahead(position[0], position[1], path, hits[within], needed[within], distance, least)
    return np.array((x, y)), clear, last


@njit(cache=True)
def _sampled(x, y, path, distance):
    """Points along the path, at most SPACING apart, for about 20 times `distance`; and whether they reach its end."""
    points = [(x, y)]
    points.pop()
    for k in range(len(path)):
        length = math.hypot(path[k, 0] - x, path[k, 1] - y)
        count = max(int(math.ceil(length / SPACING)), 1)
        for n in range(1, count + 1):
            points.append((x + (path[k, 0] - x) * n / count, y + (path[k, 1] - y) * n / count))
        x, y = path[k, 0], path[k, 1]
        if len(points) > 20.0 * distance / SPACING:
            return points, False
    return points, True


@njit(cache=True)
def _line_clearance(x, y, end_x, end_y, hits, needed, enough):
    """Clearance of a straight line, or any value below `enough` if it is less than that."""
    ex, ey = end_x - x, end_y - y
    squared = ex * ex + ey * ey
    least = np.inf
    for k in range(len(hits)):
        dx, dy = hits[k, 0] - x, hits[k, 1] - y
        share = min(max((dx * ex + dy * ey) / squared, 0.0), 1.0) if squared > 0.0 else 0.0
        dx -= share * ex
        dy -= share * ey
        least = min(least, math.sqrt(dx * dx + dy * dy) - needed[k])
        if least < enough:
            break
    return least


@njit(cache=True)
def _look_ahead(x, y, path, hits, needed, distance, least):
    points, whole = _sampled(x, y, path, distance)
    count = 0
    while count < len(points) and math.hypot(points[count][0] - x, points[count][1] - y) <= distance:
        count += 1
    count = max(count, 1)
    on_path = np.empty(count)
    lowest = np.inf
    for k in range(count):
        lowest = min(lowest, clearance_at(points[k][0], points[k][1], hits, needed))
        on_path[k] = lowest
    for k in range(count - 1, -1, -1):
        px, py = points[k]
        if math.hypot(px - x, py - y) < NEAREST and k > 0:
            continue
        enough = min(CLEAR, max(on_path[k] - CORNER_CUT, least))
        clear = _line_clearance(x, y, px, py, hits, needed, enough)
        if clear >= enough:
            return px, py, clear, whole and k == len(points) - 1
    k = min(2, count - 1)
    return points[k][0], points[k][1], on_path[k], whole and k == len(points) - 1
