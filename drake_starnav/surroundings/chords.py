"""Hits as chords: the stretches of surface between neighbouring hits, what hides space, and how far a lidar saw."""

import math
from typing import NamedTuple

import numpy as np

from drake_starnav.geometry.compiled import kernel
from drake_starnav.geometry.polyline import point_to_segment_squared
from drake_starnav.lidar.field_of_view import TURN
from drake_starnav.lidar.laser_scan import HIT, LOST, MOVING
from drake_starnav.surroundings.bearing_hits import CONNECTED_CHORD

BINS = 360
"""Bearings of a look: it saw as far in each as in the worst direction within it."""
BLIND_WEDGE, AT_LIDAR = math.radians(85.0), 0.001
"""What a lidar does not look at is hidden by chords of at most this angle at this distance of it, m: numerics."""
ROUNDING = 1e-6
"""Far more than bins are rounded by."""


class Chords(NamedTuple):
    """Surfaces that scans have hit, and what the last one could not see; W, m.

    Attributes:
        ends: shape (k, 4): x, y of both ends; the same twice for a hit without a neighbour on its surface.
        solid: shape (k,), whether there is a surface.
        shades: shape (k,), whether it hid all that lies behind it, as seen from `center`.
        center: place of the lidar at the last scan, shape (2,).
    """

    ends: np.ndarray
    solid: np.ndarray
    shades: np.ndarray
    center: np.ndarray


@kernel
def surfaces(hits, own, place, body):
    """Hits (n, 2) as chords (k, 4), and which of them shade: those between an own pair of the last scan's.

    `body` is as of `Beams`.

    Neighbours on one surface are joined: the own ones in the order of their bearings, the others in their own order.
    """
    begin, end = own
    n, count = len(hits), end - begin
    order = np.empty(n, np.int64)
    bearing = np.empty(count)
    for k in range(count):
        bearing[k] = math.atan2(hits[begin + k, 1] - place[1], hits[begin + k, 0] - place[0])
    by_bearing = np.argsort(bearing, kind="mergesort")
    for k in range(n):  # an assignment to a slice takes Numba 2 s to compile
        order[k] = by_bearing[k] + begin if k < count else k - count if k < count + begin else k
    ends, shades, m = np.empty((n, 4)), np.zeros(n, np.bool_), 0
    for group in range(2):
        first, last = (0, count) if group == 0 else (count, n)
        before = group == 0 and count > 1 and _joined(hits, order[count - 1], order[0], body)
        for k in range(first, last):
            i = order[k]
            j = order[k + 1] if k + 1 < last else order[first]
            joined = (k + 1 < last or (group == 0 and count > 1)) and _joined(hits, i, j, body)
            if joined or not before:
                j = j if joined else i
                ends[m, 0], ends[m, 1], ends[m, 2], ends[m, 3] = hits[i, 0], hits[i, 1], hits[j, 0], hits[j, 1]
                shades[m] = group == 0 and joined
                m += 1
            before = joined
    return ends[:m], shades[:m]


@kernel
def _joined(hits, i, j, body):
    return (hits[j, 0] - hits[i, 0]) ** 2 + (hits[j, 1] - hits[i, 1]) ** 2 < (CONNECTED_CHORD * body) ** 2


@kernel
def hides(beams, place):
    """Chords (k, 4) behind which some `Beams` saw nothing, beside what joined hits of theirs hide; W, m.

    A lost beam, and one that met what moves, from the beam before to the one after; a hit without a neighbour on its
    surface, half way to them; and the bearings at which the lidar does not look.
    """
    distance, kinds, directions = beams.distances, beams.kinds, beams.directions
    n, full = len(distance), beams.seam < np.inf
    wedges = 0 if full else int(math.ceil((TURN - (n - 1) * beams.increment) / BLIND_WEDGE))
    ends, m = np.empty((n + wedges, 4)), 0
    for i in range(n):
        if distance[i] >= beams.range_max or kinds[i] & (HIT | LOST | MOVING) == 0:
            continue
        h, j = (i - 1, (i + 1) % n) if full else (max(i - 1, 0), min(i + 1, n - 1))
        d, share = max(distance[i], AT_LIDAR), 1.0
        if kinds[i] & (LOST | MOVING) == 0:
            if _neighbours(beams, h, i) or _neighbours(beams, i, j):
                continue
            share = 0.5
        for k, side in ((0, h), (2, j)):
            x = directions[i, 0] + share * (directions[side, 0] - directions[i, 0])
            y = directions[i, 1] + share * (directions[side, 1] - directions[i, 1])
            size = d / math.sqrt(x * x + y * y)
            ends[m, k], ends[m, k + 1] = size * x, size * y
        m += 1
    if wedges > 0:
        first = math.atan2(directions[n - 1, 1], directions[n - 1, 0])
        wide = (TURN - (n - 1) * beams.increment) / wedges
        for k in range(wedges):
            a, b = first + k * wide, first + (k + 1) * wide
            ends[m, 0], ends[m, 1] = AT_LIDAR * math.cos(a), AT_LIDAR * math.sin(a)
            ends[m, 2], ends[m, 3] = AT_LIDAR * math.cos(b), AT_LIDAR * math.sin(b)
            m += 1
    cosine, sine = math.cos(place[2]), math.sin(place[2])
    for k in range(m):
        for c in (0, 2):
            x, y = ends[k, c], ends[k, c + 1]
            ends[k, c], ends[k, c + 1] = place[0] + cosine * x - sine * y, place[1] + sine * x + cosine * y
    return ends[:m]


@kernel
def _neighbours(beams, i, j):
    """Whether two beams hit one surface."""
    if i == j or beams.kinds[i] & HIT == 0 or beams.kinds[j] & HIT == 0:
        return False
    dx = beams.distances[i] * beams.directions[i, 0] - beams.distances[j] * beams.directions[j, 0]
    dy = beams.distances[i] * beams.directions[i, 1] - beams.distances[j] * beams.directions[j, 1]
    return dx * dx + dy * dy < (CONNECTED_CHORD * beams.body) ** 2


@kernel
def profile(ends, place, reach):
    """`Look.free` of chords (k, 4), in W: in each bin the nearest place of any counts."""
    out, step = np.full(BINS, reach), TURN / BINS
    for k in range(len(ends)):
        ax, ay, bx, by = ends[k, 0] - place[0], ends[k, 1] - place[1], ends[k, 2] - place[0], ends[k, 3] - place[1]
        near = math.sqrt(point_to_segment_squared(0.0, 0.0, ax, ay, bx, by))
        if near >= reach:
            continue
        if ax * by - ay * bx < 0.0:
            ax, ay, bx, by = bx, by, ax, ay
        cross, size = ax * by - ay * bx, math.hypot(bx - ax, by - ay)
        low = math.atan2(ay, ax) - place[2]
        high = low + math.atan2(cross, ax * bx + ay * by)
        away = cross / max(size, ROUNDING)  # of the line through both ends, and at which bearing
        foot = low - math.atan2((ax * (bx - ax) + ay * (by - ay)) / max(size, ROUNDING), away)
        for b in range(int(math.floor(low / step - ROUNDING)), int(math.floor(high / step + ROUNDING)) + 1):
            bearing = min(max(foot, low, b * step), high, (b + 1) * step)
            there = away / math.cos(bearing - foot) if away > ROUNDING else near
            out[b % BINS] = min(out[b % BINS], max(there, near))
    return out
