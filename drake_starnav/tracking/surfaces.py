"""Surfaces too large to move: the scan is split into convex surfaces, and the width of each is measured.

A disc shows the lidar one convex arc. Connected hits are therefore split wherever their outline has a notch: where a
disc stands against a wall, in the corner of a room, between two discs. The outline is the polygon that the
Douglas-Peucker algorithm leaves of the hits; they run counter-clockwise about the robot, so that a notch is where it
turns to the left. A surface wider than the largest dynamic obstacle is static.
"""

import itertools
import math

import numpy as np
from numba import njit
from scipy.spatial.distance import pdist

from drake_starnav.geometry.polyline import simplified
from drake_starnav.lidar.laser_scan import LaserScan, third_side

CONNECTED = 0.15
CONNECTED_PER_RANGE = 0.05
"""Consecutive hits are on one surface if nearer than this, m, or this share of their range."""
FLATNESS = 0.05
NOISES = 5.0
"""A notch of less than this between two things is not seen, m; nor one of less than so many standard deviations of the
range error."""
WIDEST_SPACING = 0.05
"""Farther than where two beams are this far apart, m, nothing is known to be large: the notches between discs of 0.15 m
or more that stand side by side, seen from any side, show only nearer than that."""


def on_large_surfaces(scan: LaserScan, width: float, range_deviation: float) -> np.ndarray:
    """Which hits of a scan in S are on a convex surface that is wider than `width`, m, shape (n,), bool.

    Lost beams do not split surfaces. The declared standard deviation of the range error, m, counts: that of the scan
    itself is no measure, as the rims of discs side by side bend as much as a noisy wall.
    """
    out = np.zeros(len(scan.ranges), bool)
    said = np.flatnonzero(~scan.lost)
    distance = scan.distances[said]
    hit = (scan.ranges[said] < scan.range_max) & (distance * scan.angle_increment <= WIDEST_SPACING)
    notch = max(FLATNESS, NOISES * range_deviation)
    bearing = scan.bearings[said]
    ends = distance[:, None] * np.column_stack((np.cos(bearing), np.sin(bearing)))
    continues = joined(distance, hit, np.diff(bearing, prepend=bearing[-1:] - 2.0 * math.pi), scan.full_circle)
    for run in runs(hit, continues):
        whole = np.roll(run, -int(np.argmax(distance))) if continues.all() else run  # is cut at its farthest corner
        out[said[whole]] = _on_wide_surface(ends[whole], width, notch)
    return out


def joined(distance: np.ndarray, hit: np.ndarray, angle: float | np.ndarray, wrap: bool) -> np.ndarray:
    """Which beams hit the surface that the beam before has hit, shape (n,), bool.

    Args:
        distance, hit: shape (n,), m and bool.
        angle: between each beam and the one before, one for all or of shape (n,), rad.
        wrap: whether the last beam is the one before the first.
    """
    return _joined(distance, hit, np.broadcast_to(np.cos(angle), distance.shape), wrap)


@njit(cache=True)
def _joined(distance, hit, cosine, wrap):
    """The loop of `joined`, by the cosine of each angle."""
    n = len(distance)
    out = np.zeros(n, np.bool_)
    for k in range(0 if wrap else 1, n):
        a, b = distance[k - 1], distance[k]
        if hit[k] and hit[k - 1]:
            out[k] = third_side(a, b, cosine[k]) <= max(CONNECTED, CONNECTED_PER_RANGE * min(a, b))
    return out


def runs(chosen: np.ndarray, continues: np.ndarray) -> list[np.ndarray]:
    """Beam numbers of the runs of `chosen` beams (n,) of which each continues the one before, as from `joined`."""
    beams, ends = _runs(chosen, continues)
    return [beams[i:j] for i, j in itertools.pairwise(ends.tolist())]


@njit(cache=True)
def _runs(chosen, continues):
    """The beams of all runs, one after the other, and where each run begins in them and the last ends."""
    n = len(chosen)
    beams, ends, first, count = np.empty(n, np.int64), [0], 0, 0
    while first < n and not (chosen[first] and not (continues[first] and chosen[first - 1])):
        first += 1
    first %= n  # none begins: there is none, or one all around
    for m in range(first, first + n):
        k = m % n
        if chosen[k]:
            beams[count] = k
            count += 1
            after = (k + 1) % n
            if m + 1 == first + n or not (chosen[after] and continues[after]):
                ends.append(count)
    return beams[:count], np.array(ends)


def scan_chord(scan: LaserScan, run: np.ndarray) -> float:
    """Distance between the first and the last hit of a run of beams, m."""
    return third_side(*scan.distances[run[[0, -1]]], math.cos((len(run) - 1) * scan.angle_increment))


def _on_wide_surface(points: np.ndarray, width: float, notch: float) -> np.ndarray:
    """Which of some connected hits, points (k, 2), are on a wide convex surface, shape (k,), bool."""
    out = np.zeros(len(points), bool)
    outline = simplified(points, notch)
    corner = np.flatnonzero((points[:, None] == outline).all(axis=2).any(axis=1))
    begin = 0  # index of the corner that the present surface begins at
    for i in range(1, len(corner)):
        if i < len(corner) - 1:
            (ax, ay), (bx, by) = np.diff(points[corner[i - 1 : i + 2]], axis=0)
            if ax * by - ay * bx <= 0.0:
                continue
        # a hit at a notch may be the neighbour's, across a step
        surface = points[corner[begin] + (begin > 0) : corner[i] + (i == len(corner) - 1)]
        if pdist(surface).max(initial=0.0) > width:
            out[corner[begin] : corner[i] + 1] = True
        begin = i
    return out
