"""Surfaces too large to move: the scan is split into convex surfaces, and the width of each is measured.

A disc shows the lidar one convex arc. Connected hits are therefore split wherever their outline has a notch: where a
disc stands against a wall, in the corner of a room, between two discs. The outline is the polygon that the
Douglas-Peucker algorithm leaves of the hits; they run counter-clockwise about the robot, so that a notch is where it
turns to the left. A surface wider than the largest dynamic obstacle is static.
"""

import math

import numpy as np
from numba import njit

from drake_starnav.lidar.laser_scan import LaserScan
from drake_starnav.tracking.occupancy_history import connected

FLATNESS = 0.05
NOISES = 5.0
"""A notch of less than this between two things is not seen, m; nor one of less than so many standard deviations of the
range error."""
WIDEST_SPACING = 0.05
"""Farther than where two beams are this far apart, m, nothing is known to be large: the notches between discs of 0.15 m
or more that stand side by side, seen from any side, show only nearer than that."""


def on_large_surfaces(scan: LaserScan, width: float, range_deviation: float) -> np.ndarray:
    """Which hits are on a convex surface that is wider than `width`, shape (n,), bool.

    Lost beams do not split surfaces.

    Args:
        scan: in S.
        width: m.
        range_deviation: declared standard deviation of the range error, m. That of the scan itself is no measure: the
            rims of discs side by side bend as much as a noisy wall.
    """
    out = np.zeros(len(scan.ranges), bool)
    said = np.flatnonzero(~scan.lost)
    distance = scan.distances[said]
    hit = (scan.ranges[said] < scan.range_max) & (distance * scan.angle_increment <= WIDEST_SPACING)
    notch = max(FLATNESS, NOISES * range_deviation)
    out[said] = _large(distance, scan.bearings[said], hit, scan.full_circle, width, notch)
    return out


@njit(cache=True)
def _large(distance, bearing, hit, wrap, width, notch):
    """Which hits of beams of distances and bearings (n,) are on a surface wider than `width`, (n,) bool."""
    n = len(distance)
    out = np.zeros(n, np.bool_)
    joined = np.empty(n, np.bool_)  # whether beam k continues the surface of the one before
    for k in range(n):
        angle = bearing[k] - bearing[k - 1] if k else bearing[0] - bearing[n - 1] + 2.0 * math.pi
        joined[k] = (k > 0 or wrap) and connected(distance, hit, k - 1 if k else n - 1, k, angle)
    start = 0
    while start < n and joined[start]:
        start += 1
    if start == n:  # one outline all around is cut open at its farthest corner
        start = int(np.argmax(distance))
    first = start
    while first < start + n:
        last = first
        while last + 1 < start + n and joined[(last + 1) % n]:
            last += 1
        if hit[first % n]:
            _part(distance, bearing, first, last, width, notch, out)
        first = last + 1
    return out


@njit(cache=True)
def _part(distance, bearing, first, last, width, notch, out):
    """Mark which of the connected hits first to last, modulo their number, are on a wide convex surface."""
    n = len(distance)
    count = last - first + 1
    x, y = np.empty(count), np.empty(count)
    for k in range(count):
        b = (first + k) % n
        x[k], y[k] = distance[b] * math.cos(bearing[b]), distance[b] * math.sin(bearing[b])
    corner = _outline(x, y, notch)
    begin = 0  # index of the corner that the present surface begins at
    for i in range(1, len(corner)):
        receding = i == len(corner) - 1
        if not receding:
            a, b, c = corner[i - 1], corner[i], corner[i + 1]
            receding = (x[b] - x[a]) * (y[c] - y[b]) - (y[b] - y[a]) * (x[c] - x[b]) > 0.0
        if not receding:
            continue
        # a hit at a notch may be the neighbour's, across a step
        low = corner[begin] + (1 if begin > 0 else 0)
        high = corner[i] - (1 if i < len(corner) - 1 else 0)
        if _extent(x, y, low, high) > width:
            for k in range(corner[begin], corner[i] + 1):
                out[(first + k) % n] = True
        begin = i


@njit(cache=True)
def _extent(x, y, low, high):
    """Largest distance between two of the points low to high."""
    most = 0.0
    for i in range(low, high + 1):
        for j in range(i + 1, high + 1):
            most = max(most, (x[i] - x[j]) ** 2 + (y[i] - y[j]) ** 2)
    return math.sqrt(most)


@njit(cache=True)
def _outline(x, y, notch):
    """Indices of the corners of a polygon no farther than `notch` from any of the points; the ends are two of them."""
    count = len(x)
    chosen = np.zeros(count, np.bool_)
    chosen[0] = chosen[count - 1] = True
    pending = [(0, count - 1)]
    while len(pending) > 0:
        a, b = pending.pop()
        dx, dy = x[b] - x[a], y[b] - y[a]
        square = max(dx * dx + dy * dy, 1e-12)
        most, farthest = notch, -1
        for k in range(a + 1, b):
            along = min(max(((x[k] - x[a]) * dx + (y[k] - y[a]) * dy) / square, 0.0), 1.0)
            away = math.hypot(x[k] - x[a] - along * dx, y[k] - y[a] - along * dy)
            if away > most:
                most, farthest = away, k
        if farthest >= 0:
            chosen[farthest] = True
            pending.append((a, farthest))
            pending.append((farthest, b))
    return np.flatnonzero(chosen)
