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


@njit(cache=True)
def even_points(polygon, count):
    """Points spread evenly in a polygon, star-shaped about the origin, shape (count, 2), m; none if it is flat."""
    n = len(polygon)
    area = np.zeros(n + 1)
    for j in range(n):
        ax, ay = polygon[j]
        bx, by = polygon[j + 1 if j + 1 < n else 0]
        area[j + 1] = area[j] + max(ax * by - ay * bx, 0.0)
    if area[n] <= 0.0:
        return np.empty((0, 2))
    points, j = np.empty((count, 2)), 0
    for i in range(count):
        wanted = (i + 0.5) / count * area[n]
        while area[j + 1] <= wanted:
            j += 1
        t = (wanted - area[j]) / (area[j + 1] - area[j])
        outward = math.sqrt((0.5 + i * GOLDEN) % 1.0)  # the root: as much area below as the share says
        points[i] = outward * ((1.0 - t) * polygon[j] + t * polygon[j + 1 if j + 1 < n else 0])
    return points
