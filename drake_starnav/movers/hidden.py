"""Where no beam has looked: places from which something may come."""

import math

import numpy as np
from numba import njit

from drake_starnav.scan import STAYS, LaserScan

HIDDEN_JUMP = 0.45
"""Where the ranges of neighbouring beams differ by more, something may hide behind the nearer surface, m."""
HIDDEN_REACH = 3.0
HIDDEN_INSET = 0.1
HIDDEN_SPACING = 0.15
"""Hidden places are noted up to this range, m, from so far behind the nearer surface on, and so far apart."""


def hidden_places(scan: LaserScan, motion: np.ndarray, pose: np.ndarray) -> np.ndarray:
    """Places along the rays past the edges of what stays, behind which nobody has looked, shape (n, 2), W, m.

    What moves does not count as such an edge: it hides others for a moment only, and mostly from where it goes.

    Args:
        scan: in S.
        motion: shape (n,), as from `MotionGrid.told`.
        pose: (x, y, yaw) of S in W.
    """
    bearing_0 = float(pose[2]) + scan.angle_min
    stays = motion == STAYS
    return _hidden(scan.distances, stays, scan.angle_increment, scan.full_circle, *pose[:2], bearing_0)


@njit(cache=True)
def _hidden(distance, stays, increment, wrap, x, y, bearing_0):
    n = len(distance)
    places = []
    for k in range(n if wrap else n - 1):
        a, b = distance[k], distance[(k + 1) % n]
        if abs(a - b) < HIDDEN_JUMP or not stays[k if a < b else (k + 1) % n]:
            continue
        theta = bearing_0 + (k + 0.5) * increment
        r, end = min(a, b) + HIDDEN_INSET, min(max(a, b), HIDDEN_REACH)
        while r < end:
            places.append((x + r * math.cos(theta), y + r * math.sin(theta)))
            r += HIDDEN_SPACING
    out = np.empty((len(places), 2))
    for k in range(len(places)):
        out[k, 0], out[k, 1] = places[k]
    return out
