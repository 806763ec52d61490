"""Convex sets inside a star-shaped region that together cover nearly all of it.

Many sets are grown and few are chosen. A set grows from a point as in IRIS: half-planes tangent to ellipses about the
point part it from the region's boundary, the nearest edge first, and then once more about the ellipse of the set found.
Points that are not covered yet are grown from, and the set that adds most is chosen, until all is covered.
The first set contains the region's centre and each other one overlaps an earlier one, so that the sets are connected.

Source of IRIS: Deits and Tedrake, "Computing large convex regions of obstacle-free space through semidefinite
programming", 2014.
"""

import math
from typing import NamedTuple

import numpy as np
from numba import njit

from drake_starnav.errors import StarnavError
from drake_starnav.regions.inner_polygon import even_points, inner_polygon
from drake_starnav.regions.star_region import StarRegion

POINTS = 400
"""Points at which area is measured."""
SEEDS = 8
"""Points from which sets grow before each choice."""
GROWTHS = 2
"""Times that a set is grown: first about a circle, then about the ellipse of the set found."""
SPARE = 1e-6
"""A half-plane lies nearer than what it touches by this share of the distance."""
MOST_PLANES = 40
"""Half-planes of a set."""


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

    The first contains the region's centre, unless the centre lies on the boundary; each other overlaps an earlier one.

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
    polygon = inner_polygon(rays, reach)
    points = np.vstack((np.zeros((1, 2)), even_points(polygon, POINTS)))
    planes, used = _cover(polygon, points, count)
    return [
        HalfPlanes(rows[:n, :2].copy(), rows[:n, 2] + rows[:n, :2] @ region.center)
        for rows, n in zip(planes, used, strict=True)
    ]


@njit(cache=True)
def _cover(polygon, points, count):
    """Half-planes (normal, offset) about the centre of each set, shape (k, MOST_PLANES, 3), and how many each has."""
    most = (count * SEEDS + 1) * GROWTHS
    planes, used = np.empty((most, MOST_PLANES, 3)), np.zeros(most, np.int64)
    holds, gains, overlaps = np.zeros((most, len(points)), np.bool_), np.zeros(most), np.zeros(most, np.bool_)
    covered = np.zeros(len(points), np.bool_)
    covered[0] = True  # the centre: the first set is to overlap it
    chosen, grown = np.empty(count, np.int64), 0
    for made in range(count):
        left = np.flatnonzero(~covered)
        seeds = left[made % max(len(left) // SEEDS, 1) :: max(len(left) // SEEDS, 1)][:SEEDS]
        if made == 0:
            seeds = np.append(seeds, 0)
        for i in seeds:
            ellipse = (points[i, 0], points[i, 1], 1.0, 0.0, 1.0)
            for _ in range(GROWTHS):
                n = _grown(polygon, ellipse, planes[grown])
                if n == 0:
                    break
                used[grown] = n
                holds[grown] = True
                for nx, ny, offset in planes[grown, :n]:
                    holds[grown] &= nx * points[:, 0] + ny * points[:, 1] <= offset
                gains[grown] = np.sum(holds[grown] & ~covered)
                overlaps[grown] = np.any(holds[grown] & covered)
                ellipse = _inertia(planes[grown, :n], polygon)
                grown += 1
        allowed = overlaps[:grown] | (made == 0 and not overlaps[:grown].any())
        best = np.argmax(np.where(allowed, gains[:grown], 0.0)) if grown else 0
        if not (grown and allowed[best] and gains[best] > 0.0):
            return planes[chosen[:made]], used[chosen[:made]]
        chosen[made] = best
        for p in np.flatnonzero(holds[best]):
            for k in range(grown):
                if holds[k, p]:
                    overlaps[k] = True
                    gains[k] -= not covered[p]
            covered[p] = True
    return planes[chosen], used[chosen]


@njit(cache=True)
def _grown(polygon, ellipse, rows):
    """Fill `rows` with the half-planes of the set around a point; returns how many, or 0 if the point is not inside.

    Args:
        polygon: around the point, shape (n, 2), m.
        ellipse: x, y of the point, and xx, xy, yy of the matrix by which distances from it are measured.
        rows: normal and offset of each half-plane, shape (most, 3).
    """
    px, py, xx, xy, yy = ellipse
    count = len(polygon)
    near, distance, left = np.empty((count, 2)), np.empty(count), np.arange(count)
    nearest = 0
    for i in range(count):
        ax, ay = polygon[i, 0] - px, polygon[i, 1] - py
        following = i + 1 if i + 1 < count else 0
        ex, ey = polygon[following, 0] - polygon[i, 0], polygon[following, 1] - polygon[i, 1]
        fx, fy = xx * ex + xy * ey, xy * ex + yy * ey
        squared = ex * fx + ey * fy
        t = min(max(-(ax * fx + ay * fy) / squared, 0.0), 1.0) if squared > 1e-18 else 0.0
        ax, ay = ax + t * ex, ay + t * ey
        near[i, 0], near[i, 1] = ax, ay
        distance[i] = ax * (xx * ax + xy * ay) + ay * (xy * ax + yy * ay)
        if distance[i] < distance[nearest]:
            nearest = i
    n = 0
    while count > 0:
        if n == len(rows) or not distance[nearest] > 1e-12:  # nor NaN, of an ellipse that is flat
            return 0
        qx, qy = near[nearest]
        nx, ny = xx * qx + xy * qy, xy * qx + yy * qy  # the tangent of the ellipse there
        length = math.hypot(nx, ny)
        nx, ny = nx / length, ny / length
        offset = (1.0 - SPARE) * (nx * qx + ny * qy) + nx * px + ny * py
        rows[n, 0], rows[n, 1], rows[n, 2] = nx, ny, offset
        n += 1
        kept, following_nearest = 0, -1
        for i in left[:count]:
            following = i + 1 if i + 1 < len(polygon) else 0
            low = min(nx * polygon[i, 0] + ny * polygon[i, 1], nx * polygon[following, 0] + ny * polygon[following, 1])
            if i != nearest and low < offset:  # not beyond the half-plane
                left[kept] = i
                kept += 1
                if following_nearest < 0 or distance[i] < distance[following_nearest]:
                    following_nearest = i
        count, nearest = kept, following_nearest
    return n


@njit(cache=True)
def _inertia(planes, polygon):
    """Centroid x, y of a set, and xx, xy, yy of its inverse covariance of determinant 1; zeros if it is flat."""
    corners = _corners(planes, 2.0 * np.abs(polygon).max())
    area = cx = cy = xx = xy = yy = 0.0
    for i in range(len(corners)):
        ax, ay = corners[i - 1]
        bx, by = corners[i]
        cross = ax * by - bx * ay
        area += 0.5 * cross
        cx += (ax + bx) * cross / 6.0
        cy += (ay + by) * cross / 6.0
        xx += (ax * ax + ax * bx + bx * bx) * cross / 12.0
        yy += (ay * ay + ay * by + by * by) * cross / 12.0
        xy += (2.0 * ax * ay + ax * by + bx * ay + 2.0 * bx * by) * cross / 24.0
    if area <= 0.0:
        return 0.0, 0.0, 0.0, 0.0, 0.0
    cx, cy = cx / area, cy / area
    xx, xy, yy = xx / area - cx * cx, xy / area - cx * cy, yy / area - cy * cy
    root = math.sqrt(max(xx * yy - xy * xy, 0.0))
    if root <= 0.0:
        return 0.0, 0.0, 0.0, 0.0, 0.0
    return cx, cy, yy / root, -xy / root, xx / root


@njit(cache=True)
def _corners(planes, extent):
    """Corners of a set within a square of twice `extent` about the origin, counter-clockwise, shape (n, 2)."""
    corners, cut = np.empty((len(planes) + 4, 2)), np.empty((len(planes) + 4, 2))
    corners[:4] = extent * np.array([(-1.0, -1.0), (1.0, -1.0), (1.0, 1.0), (-1.0, 1.0)])
    n = 4
    for nx, ny, offset in planes:
        kept = crossings = 0
        for i in range(n):
            ax, ay = corners[i - 1] if i > 0 else corners[n - 1]
            bx, by = corners[i]
            a, b = nx * ax + ny * ay - offset, nx * bx + ny * by - offset
            if (a < 0.0) != (b < 0.0) and crossings < 2:  # more only by rounding; then `cut` would overflow
                crossings += 1
                t = a / (a - b)
                cut[kept, 0], cut[kept, 1] = ax + t * (bx - ax), ay + t * (by - ay)
                kept += 1
            if b < 0.0:
                cut[kept, 0], cut[kept, 1] = bx, by
                kept += 1
        corners, cut, n = cut, corners, kept
    return corners[:n]
