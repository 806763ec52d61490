"""A polygon of few edges inside a star-shaped boundary of many samples.

Its edges are the longest that stay between the boundary and a copy of it scaled down by `TOLERANCE`, found ray by ray
as the cone of directions that pass all gaps between the two. Source of the cone: Sklansky and Gonzalez, "Fast polygonal
approximation of digitized curves", 1980.
"""

import math

import numpy as np
from numba import njit

TOLERANCE = 0.004
"""An edge lies within the boundary by at most this share of the distance from the centre."""
LEAP = 0.5
"""Where the squared reach changes by more than this share of its mean, the polygon has an edge along the ray."""
GOLDEN = 0.5 * (math.sqrt(5.0) - 1.0)


@njit(cache=True)
def inner_polygon(rays, reach):
    """Vertices about the centre, counter-clockwise, shape (n, 2), m.

    Args:
        rays: unit vectors at even bearings all around, shape (M, 2).
        reach: how far all is inside between a ray and the next, shape (M,), m.
    """
    samples = len(reach)
    leap = LEAP * np.mean(reach * reach)
    first = np.argmax(np.abs(reach - np.roll(reach, 1)))
    vertices = np.empty((2 * samples, 2))
    n, k, radius, leapt = 0, 0, 0.0, True
    while k < samples:
        if leapt:
            radius = reach[(first + k) % samples]
            vertices[n] = radius * rays[(first + k) % samples]
            n += 1
        k, radius, leapt = _edge(rays, reach, (first, k), radius, leap)
        vertices[n] = radius * rays[(first + k) % samples]
        n += 1
    return vertices[:n]


@njit(cache=True)
def _edge(rays, reach, start, radius, leap):
    """The longest edge from a point of a ray: the ray and the radius where it ends, and whether the reach leaps there.

    Args:
        rays, reach: as for `inner_polygon`.
        start: ray 0 of the polygon, and the number of the ray after it at which the edge starts.
        radius: at which it starts, m.
        leap: change of the squared reach at which it has to end, m^2.
    """
    samples = len(reach)
    first, k = start
    px, py = radius * rays[(first + k) % samples, 0], radius * rays[(first + k) % samples, 1]
    right_x = right_y = left_x = left_y = 0.0
    end, stop, leaps = k, radius, False
    while end < samples and not leaps and end - k < max(samples // 6, 1):
        i = (first + end + 1) % samples
        before, after = reach[i - 1], reach[i]
        leaps = end + 1 == samples or abs(before * before - after * after) > leap
        outer = before if leaps else min(before, after)
        inner = (1.0 - TOLERANCE) * outer
        cx, cy = rays[i]
        outer_x, outer_y, inner_x, inner_y = outer * cx - px, outer * cy - py, inner * cx - px, inner * cy - py
        if end == k or right_x * outer_y - right_y * outer_x > 0.0:
            right_x, right_y = outer_x, outer_y
        if end == k or left_x * inner_y - left_y * inner_x < 0.0:
            left_x, left_y = inner_x, inner_y
        if end > k and right_x * left_y - right_y * left_x < 0.0:  # at the first ray only by rounding
            return end, stop, False
        # the outermost direction that is left meets the ray here
        across = right_x * cy - right_y * cx
        stop = outer if abs(across) < 1e-15 else min((right_x * py - right_y * px) / across, outer)
        end += 1
    return end, stop, leaps


def even_points(polygon: np.ndarray, count: int) -> np.ndarray:
    """Points spread evenly in a polygon, star-shaped about the origin, shape (count, 2), m; none if it is flat."""
    following = np.roll(polygon, -1, axis=0)
    doubled = np.maximum(polygon[:, 0] * following[:, 1] - polygon[:, 1] * following[:, 0], 0.0)
    area = np.append(0.0, doubled.cumsum())
    if area[-1] <= 0.0:
        return np.empty((0, 2))
    wanted = (np.arange(count) + 0.5) / count * area[-1]
    j = np.searchsorted(area, wanted, side="right") - 1
    t = ((wanted - area[j]) / doubled[j])[:, None]
    outward = np.sqrt((0.5 + np.arange(count) * GOLDEN) % 1.0)  # the root: as much area below as the share says
    return outward[:, None] * ((1.0 - t) * polygon[j] + t * following[j])
