"""Convex sets inside a star-shaped region that together cover nearly all of it.

Every set contains the region's centre, so all of them intersect, and along a ray the union is the longest of them.
Each begins as the triangle from the centre into the region that holds most of what is not covered yet. The boundary's
nearest chord gives the half-plane between the two; chords beyond it are done, and the next nearest follows, as in IRIS.

Source of IRIS: Deits and Tedrake, "Computing large convex regions of obstacle-free space through semidefinite
programming", 2014.
"""

import math
from typing import NamedTuple

import numpy as np
from numba import njit

from drake_starnav.errors import StarnavError
from drake_starnav.regions.star_region import StarRegion

RAYS = 120
"""Bearings at which triangles and areas are measured, about."""
HALVES = np.array([1, 2, 3, 5, 7, 10, 14, 19, 25])
"""Half the angles of the triangles that are tried, in rays."""
SHRINKAGE = 0.985
"""Size of the triangle that a set grows from, as a share of the largest that fits."""
SPARE = 0.006
"""A half-plane lies nearer than its chord by this share of the distance, so that a few replace the chords of an arc."""
MOST_PLANES = 60
"""Half-planes of a set."""
NEGLIGIBLE = 1e-3
"""A set that would cover less than this share of the region's area is not made."""


class HalfPlanes(NamedTuple):
    """A convex set: the points p of W with `normals @ p <= offsets`.

    Attributes:
        normals: shape (n, 2), unit vectors.
        offsets: shape (n,), m.
    """

    normals: np.ndarray
    offsets: np.ndarray


def half_plane_cover(region: StarRegion, count: int = 8) -> list[HalfPlanes]:
    """Up to `count` convex sets inside a region, in the order in which each adds most.

    Args:
        region: to cover.
        count: most sets.

    Raises:
        StarnavError: `count` is less than 1.
    """
    if count < 1:
        raise StarnavError(f"convex_cover: count is {count}; allowed: a whole number 1 <= x")
    values = np.ascontiguousarray(region.boundary.values, dtype=float)
    bearings = region.bearing_0 + 2.0 * math.pi / len(values) * np.arange(len(values))
    rays = np.column_stack((np.cos(bearings), np.sin(bearings)))
    reach = np.minimum(values, np.roll(values, -1))  # between two samples the smaller one counts
    planes, used = _cover(rays, reach, count)
    return [
        HalfPlanes(rows[:n, :2].copy(), rows[:n, 2] + rows[:n, :2] @ region.center)
        for rows, n in zip(planes, used, strict=True)
    ]


@njit(cache=True)
def _cover(rays, reach, count):
    """Half-planes (normal, offset) about the centre of each set, shape (k, MOST_PLANES, 3), and how many each has."""
    samples = len(reach)
    every = max(samples // RAYS, 1)
    coarse = samples // every
    least, free, fine = np.empty(coarse), np.empty(coarse), np.empty((coarse, 2))
    for k in range(coarse):  # the least and the mean square of the sectors after the ray
        part = reach[k * every : (k + 1) * every]
        least[k], free[k] = part.min(), np.mean(part * part)
        middle = k * every + every // 2
        fine[k, 0], fine[k, 1] = rays[middle, 0], rays[middle, 1]
    covered = np.zeros(coarse)  # squared distances
    planes, used = np.zeros((count, MOST_PLANES, 3)), np.zeros(count, np.int64)
    spread, separation = 2.0 * math.pi / samples * every, np.empty((samples, 3))
    total = free.sum()
    for made in range(count):
        middle, half, length = _triangle(least, free, covered, spread)
        if length <= 0.0:
            return planes[:made], used[:made]
        # half a sample narrower than what it spans: the chords beside it may end on their common ray
        a, b = (middle - half) % coarse * every, (middle + half) % coarse * every
        corners = np.zeros((3, 2))
        corners[1] = SHRINKAGE * length * 0.5 * (rays[a] + rays[(a + 1) % samples])
        corners[2] = SHRINKAGE * length * 0.5 * (rays[b] + rays[b - 1])
        n = _grown(rays, reach, corners, planes[made], separation)
        gain = 0.0
        for k in range(coarse):
            ray = free[k]
            for q in range(n):
                along = planes[made, q, 0] * fine[k, 0] + planes[made, q, 1] * fine[k, 1]
                if along > 0.0:
                    ray = min(ray, (planes[made, q, 2] / along) ** 2)
            if n > 0 and ray > covered[k]:
                gain += ray - covered[k]
                covered[k] = ray
        if gain < NEGLIGIBLE * total:
            return planes[:made], used[:made]
        used[made] = n
    return planes, used


@njit(cache=True)
def _triangle(least, free, covered, spread):
    """Middle ray, half angle in rays, and leg (m) of the triangle in the region that holds most that is uncovered."""
    coarse = len(least)
    best, middle, half, leg = 0.0, 0, 0, 0.0
    for h in HALVES:
        secant = 1.0 / np.cos((np.arange(2 * h) + 0.5 - h) * spread)  # at the middle of each sector
        widest = 1.0 / np.cos(np.abs(np.arange(2 * h) + 0.5 - h) * spread + 0.5 * spread)
        for k in range(coarse):
            height = np.inf
            for j in range(2 * h):
                i = (k + j - h) % coarse
                height = min(height, least[i] / widest[j])
            gain = 0.0
            for j in range(2 * h):
                i = (k + j - h) % coarse
                gain += max((height * secant[j]) ** 2 - covered[i], 0.0)
            if gain > best:
                best, middle, half, leg = gain, k, h, height / math.cos(h * spread)
    return middle, half, leg


@njit(cache=True)
def _grown(rays, reach, corners, rows, separation):
    """Fill `rows` with the half-planes of the set around a triangle; returns their number, or 0 if it is not inside."""
    samples = len(reach)
    for i in range(samples):
        following = i + 1 if i + 1 < samples else 0
        r = reach[i]
        separation[i] = _separation(
            corners, r * rays[i, 0], r * rays[i, 1], r * rays[following, 0], r * rays[following, 1]
        )
    distance = np.hypot(separation[:, 0], separation[:, 1])
    left = np.ones(samples, np.bool_)
    n = 0
    while True:
        nearest, least = -1, np.inf
        for i in range(samples):
            if left[i] and distance[i] < least:
                nearest, least = i, distance[i]
        if nearest < 0:
            return n
        if n == MOST_PLANES or least < 1e-9:
            return 0
        nx, ny, offset = separation[nearest] / least
        offset -= min(0.5 * least, SPARE * reach[nearest])
        rows[n, 0], rows[n, 1], rows[n, 2] = nx, ny, offset
        n += 1
        for i in range(samples):
            if left[i]:
                following = i + 1 if i + 1 < samples else 0
                low = min(nx * rays[i, 0] + ny * rays[i, 1], nx * rays[following, 0] + ny * rays[following, 1])
                left[i] = low * reach[i] < offset - 1e-12
        left[nearest] = False


@njit(cache=True)
def _separation(corners, ax, ay, bx, by):
    """From the triangle's point nearest to the chord a-b to the chord's nearest: x, y, and its product with the latter.

    The two do not cross, so that a corner of the triangle or an end of the chord is nearest.
    """
    best, x, y, qx, qy = np.inf, 0.0, 0.0, ax, ay
    for k in range(3):
        px, py = corners[k]
        cx, cy = _nearest(ax, ay, bx, by, px, py)
        d = (cx - px) ** 2 + (cy - py) ** 2
        if d < best:
            best, x, y, qx, qy = d, cx - px, cy - py, cx, cy
        ox, oy = corners[(k + 1) % 3]
        for cx, cy in ((ax, ay), (bx, by)):
            ex, ey = _nearest(px, py, ox, oy, cx, cy)
            d = (cx - ex) ** 2 + (cy - ey) ** 2
            if d < best:
                best, x, y, qx, qy = d, cx - ex, cy - ey, cx, cy
    return x, y, x * qx + y * qy


@njit(cache=True)
def _nearest(ax, ay, bx, by, px, py):
    """The point of the segment a-b that is nearest to p."""
    dx, dy = bx - ax, by - ay
    squared = dx * dx + dy * dy
    if squared < 1e-18:
        return ax, ay
    t = min(max(((px - ax) * dx + (py - ay) * dy) / squared, 0.0), 1.0)
    return ax + t * dx, ay + t * dy
