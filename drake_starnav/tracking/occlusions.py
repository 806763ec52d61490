"""Occlusions: places from which something may come."""

import math

import numpy as np
from numba import njit

from drake_starnav.lidar.laser_scan import LaserScan

OCCLUSION_SPACING = 0.15
"""Where the ranges of neighbouring beams differ by more than this, m, something may hide behind the nearer hit. The
places on the ray between the two have this spacing."""


def occlusion_points(scan: LaserScan, pose: np.ndarray) -> np.ndarray:
    """Places along the rays past the edges of occluding surfaces, shape (n, 2), W, m, for a scan at a pose of S in W.

    An obstacle that comes out crosses such a ray, no farther than OCCLUSION_SPACING / 2 from a place or from the edge.
    """
    bearing_0 = float(pose[2]) + scan.angle_min
    return _occlusion_points(scan.distances, scan.angle_increment, scan.full_circle, *pose[:2], bearing_0)


def seen_past(scan: LaserScan, pose: np.ndarray, place: np.ndarray) -> bool:
    """Whether the beam nearest to a place (2,) in W ended behind it, or a scan taken at a pose did not look there."""
    dx, dy = place - pose[:2]
    beam = ((math.atan2(dy, dx) - pose[2] - scan.angle_min) % (2.0 * math.pi)) / scan.angle_increment
    k = int(beam + 0.5) % len(scan.ranges) if scan.full_circle else int(beam + 0.5)
    return k >= len(scan.ranges) or bool(scan.distances[k] > math.hypot(dx, dy))


@njit(cache=True)
def _occlusion_points(distance, increment, wrap, x, y, bearing_0):
    """Points (k, 2) behind the edges between beams of distances (n,), of a sensor at (x, y)."""
    n = len(distance)
    places = []
    for k in range(n if wrap else n - 1):
        a, b = distance[k], distance[(k + 1) % n]
        if abs(a - b) < OCCLUSION_SPACING:
            continue
        theta = bearing_0 + (k + 0.5) * increment
        r, end = min(a, b) + OCCLUSION_SPACING, max(a, b)
        while r < end:
            places.append((x + r * math.cos(theta), y + r * math.sin(theta)))
            r += OCCLUSION_SPACING
    out = np.empty((len(places), 2))
    for k in range(len(places)):
        out[k, 0], out[k, 1] = places[k]
    return out
