"""The braking certificate against points: as `braking_certificate`, but with every hit at every sample of the motion.

The safety star requires that the robot's centre stays in line of sight of where the last scan was taken; a motion along
a curved gap between obstacles may be safe without it. Here a motion passes if the robot's disc keeps a margin to each
hit of the last scans along the whole motion. The area that the disc sweeps must therefore have been visible in one of
those scans, which adds to the assumptions of `braking_certificate`
 (5) every obstacle in the way of the motion (at most one period of driving and one braking distance long) was hit by
     one of the remembered scans.
The range within which the last scan's hits are known is no assumption: everything beyond it counts as an obstacle.
Between two samples, s apart, the clearance of a disc of radius R dips by less than s^2/(8 R): 0.04 mm for the smallest
robots of interest.
"""

import math
from typing import NamedTuple

import numpy as np
from numba import njit

from drake_starnav.control.braking_certificate import AT_REST, BRAKING, DELAYED, braking_motion
from drake_starnav.control.heading_controller import slides

ESCAPE_CLEARANCE = 0.002
"""A move that begins within the margin may come no nearer than this, m."""


class KnownHits(NamedTuple):
    """The obstacles that a motion must stay clear of, as compiled functions take them.

    Attributes:
        hits: shape (n, 2), W, m.
        needed: shape (n,), how far the robot's centre must stay from each, m; see `needed_distances`.
        center: shape (2,), W, m.
        room: within this distance of `center` the robot is clear of everything beyond the known hits, m.
    """

    hits: np.ndarray
    needed: np.ndarray
    center: np.ndarray
    room: float


def needed_distances(half_gaps: np.ndarray, radius: float) -> np.ndarray:
    """How far the centre of a disc must stay from each hit to stay off the surface between hits, shape (n,), m.

    Args:
        half_gaps: shape (n,), half the chord to the neighbouring hit on the same surface, m.
        radius: of the disc, m.
    """
    return np.sqrt(radius * radius + half_gaps * half_gaps)


@njit(cache=True)
def clearance_at(x, y, hits, needed):
    """Least distance to a hit beyond what it needs, m; infinite without hits."""
    least = np.inf
    for k in range(len(hits)):
        dx, dy = hits[k, 0] - x, hits[k, 1] - y
        least = min(least, math.sqrt(dx * dx + dy * dy) - needed[k])
    return least


@njit(cache=True)
def keeps_clear(x, y, yaw, v, omega, want_v, want_omega, hold, delay, limits, known, enough):
    """Whether a twist, held for `hold` seconds after the delay and followed by full braking, keeps a clearance, m.

    Everything beyond the known hits counts as an obstacle. A sample is skipped while the robot cannot have used up the
    clearance beyond `enough` that the last checked sample had.
    """
    spare = _known_clearance(x, y, known) - enough
    if spare < 0.0:
        return False
    motion = braking_motion(x, y, yaw, v, omega, want_v, want_omega, hold, delay, limits)
    for next_x, next_y, _, now_v, now_omega, _, phase in motion:
        if phase != DELAYED and slides(now_v, now_omega, limits):
            return False
        spare -= math.hypot(next_x - x, next_y - y)
        x, y = next_x, next_y
        stopped = phase == BRAKING and abs(now_v) < AT_REST
        if spare <= 0.0 or stopped:
            clearance = _known_clearance(x, y, known)
            if stopped or clearance < enough:
                return clearance >= enough
            spare = clearance - enough
    return True


@njit(cache=True)
def _known_clearance(x, y, known):
    """Clearance to the known hits and to what lies beyond them, m."""
    off_the_unknown = known.room - math.hypot(x - known.center[0], y - known.center[1])
    return min(clearance_at(x, y, known.hits, known.needed), off_the_unknown)
