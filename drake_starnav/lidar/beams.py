"""What follows from a scan's ranges, beam by beam: derived once, and read by all that works with the scan."""

import math
from typing import NamedTuple

import numpy as np
from numba import njit

LARGEST_UNSEEN = 0.25
"""Between two beams with information, an obstacle of this width is assumed wherever the gap would hide it, m."""
STATIC, UNKNOWN, DYNAMIC = 0, 1, 2
"""What is known about the motion of the obstacle that a beam hit."""


class Beams(NamedTuple):
    """The beams of one scan, for compiled loops as well; unpack what a loop reads before it.

    Attributes:
        directions: unit vector along every beam in S, shape (n, 2).
        range_max: of the sensor, m.
        increment: bearing step between beams, rad.
        seam: angle from the last beam on to the first, rad; infinite if they are no neighbours.
        distances: ranges as plain distances, shape (n,), m: no return is `range_max`, too close is 0. Unless the scan
            says up to where a lost beam is free, it counts as free up to the shorter of the beams on both sides of the
            run of lost beams, and no farther than where an obstacle of width LARGEST_UNSEEN fits between these two.
        hits: beams that hit a static or possibly moving obstacle, shape (n,), bool; includes -inf (too close), not NaN.
        moving: beams on a moving obstacle, shape (n,), bool.
        lost: beams without a measurement (NaN), shape (n,), bool.
        uninformative: beams that tell nothing of static obstacles: lost, or on a moving obstacle; shape (n,), bool.
        mappable: beams to be remembered: neither lost nor on a moving or possibly moving obstacle; shape (n,), bool.
        complete: whether no beam is lost.

    How a beam is classified, by where it ended:

    ```
                                      hits  moving  lost  uninformative  mappable
    static obstacle (STATIC)            x                             x
    possibly moving one (UNKNOWN)      x
    moving obstacle (DYNAMIC)                   x              x
    no return (+inf)                                                 x
    no measurement (NaN)                              x      x
    ```
    """

    directions: np.ndarray
    range_max: float
    increment: float
    seam: float
    distances: np.ndarray
    hits: np.ndarray
    moving: np.ndarray
    lost: np.ndarray
    uninformative: np.ndarray
    mappable: np.ndarray
    complete: bool


@njit(cache=True)
def classified(ranges, motion, free, range_max, increment, seam):
    """The fields of `Beams` from `distances` on; `range_max`, `increment` and `seam` are as there.

    Args:
        ranges: shape (n,), m.
        motion: shape (n,), of the obstacle that each beam hit; empty if everything is static.
        free: shape (n,), up to where lost beams are free, m; empty if their neighbours bound them.
    """
    n = len(ranges)
    distance = np.empty(n)
    hits, moving, lost = np.empty(n, np.bool_), np.zeros(n, np.bool_), np.empty(n, np.bool_)
    uninformative, mappable = np.empty(n, np.bool_), np.empty(n, np.bool_)
    complete = True
    for i in range(n):
        if len(motion):
            moving[i] = motion[i] == DYNAMIC
        lost[i] = math.isnan(ranges[i])
        hits[i] = ranges[i] < range_max and not moving[i]  # never if lost
        uninformative[i] = lost[i] or moving[i]
        mappable[i] = not lost[i] and (len(motion) == 0 or motion[i] == STATIC)
        distance[i] = min(max(ranges[i], 0.0), range_max)
        if lost[i]:
            complete = False
            distance[i] = min(max(free[i], 0.0), range_max) if len(free) else math.nan
    if not complete and len(free) == 0:
        distance = _bounded(distance, range_max, increment, seam)
    return distance, hits, moving, lost, uninformative, mappable, complete


@njit(cache=True)
def _bounded(distance, range_max, increment, seam):
    """The distances with those of lost beams (NaN) bounded by the beams on both sides."""
    n = len(distance)
    wrap = seam < np.inf
    out = distance.copy()
    for i in range(n):
        if not math.isnan(distance[i]):
            continue
        bound, steps, beyond = range_max, 0, 0.0
        sides = 0
        for side in (-1, 1):
            for k in range(1, n):
                j = i + side * k
                if not wrap and not 0 <= j < n:
                    break
                if not math.isnan(distance[j % n]):
                    bound = min(bound, distance[j % n])
                    steps += k
                    beyond += 0.0 if 0 <= j < n else seam - increment
                    sides += 1
                    break
        if sides == 0:
            out[i] = 0.0
        else:
            out[i] = min(bound, LARGEST_UNSEEN / (steps * increment + beyond))
    return out
