"""The braking certificate against points: as `braking_certificate`, but with every hit at every sample of the motion.

The certified region requires that the robot's centre stays in line of sight of where the last scan was taken; a motion
along a curved gap between obstacles may be safe without it. Here a motion passes if the robot's disc keeps a margin to
each hit of the last scans along the whole motion. The area that the disc sweeps must therefore have been visible in one
of those scans, which adds to the assumptions of `braking_certificate` (5) every obstacle in the way of the motion (at
most one period of driving and one braking distance long) was hit by one of the remembered scans. The range within which
the last scan's hits are known is no assumption: everything beyond it counts as an obstacle, and where the lidar does
not look the centre stays where an earlier scan certified it. Between two samples, s
apart, the clearance of a disc of radius R dips by less than s^2/(8 R): 0.04 mm for the smallest robots of interest.
"""

import math
from dataclasses import dataclass
from functools import cached_property
from typing import NamedTuple

import numpy as np
from numba import njit

from drake_starnav.control.motion import Motion
from drake_starnav.regions.safe_region import CertifiedRegion
from drake_starnav.regions.separation import ESCAPE_CLEARANCE


class Hits(NamedTuple):
    """The obstacles that a motion must stay clear of.

    Attributes:
        points: shape (n, 2), W, m.
        needed: shape (n,), how far the robot's centre must stay from each, m; see `needed_distances`.
        center: shape (2,), W, m.
        room: within this distance of `center` the robot is clear of everything beyond the known hits, m.
    """

    points: np.ndarray
    needed: np.ndarray
    center: np.ndarray
    room: float


@dataclass(frozen=True)
class PointCertificate:
    """Accepts motions that keep a margin to each hit of the last scans.

    A robot that is nearer to one than the margin must not come nearer to any than it is now.

    Attributes:
        star: what the last scans certify, with their hits.
        margin: m.
        radius: of the robot, m.
    """

    star: CertifiedRegion
    margin: float
    radius: float

    @cached_property
    def hits(self) -> Hits:
        """What the motions must stay clear of."""
        star = self.star
        needed = needed_distances(star.half_gaps, self.radius)
        return Hits(star.hits, needed, star.center, float(star.reach - self.radius))

    def accepts(self, motion: Motion) -> bool:
        """Whether the motion keeps clear of all hits and of what was not looked at; without a scan none does."""
        seen = self.star.seen and self.star.looked_at(motion.position)
        return bool(seen) and _keeps_clear(motion.position, self.hits, self.margin)


def needed_distances(half_gaps: np.ndarray, radius: float) -> np.ndarray:
    """How far the centre of a disc must stay from each hit to stay off the surface between hits, shape (n,), m.

    Args:
        half_gaps: shape (n,), half the chord to the neighbouring hit on the same surface, m.
        radius: of the disc, m.
    """
    return np.sqrt(radius * radius + half_gaps * half_gaps)


@njit(cache=True)
def _keeps_clear(position, hits, margin):
    """Whether places (n, 2) keep the margin, or the clearance that the first one has, to hits and unknown space.

    A place is skipped while the robot cannot have used up the clearance that the last checked one had to spare.
    """
    points, needed, center, room = hits
    enough, spare = margin, 0.0
    for k in range(len(position)):
        x, y = position[k]
        if k > 0:
            spare -= math.hypot(x - position[k - 1, 0], y - position[k - 1, 1])
        if spare > 0.0:
            continue
        clearance = np.inf  # the least distance to a hit beyond what it needs
        for j in range(len(points)):
            dx, dy = points[j, 0] - x, points[j, 1] - y
            clearance = min(clearance, math.sqrt(dx * dx + dy * dy) - needed[j])
        if k == 0:
            enough = max(min(margin, clearance), ESCAPE_CLEARANCE)
        spare = min(clearance, room - math.hypot(x - center[0], y - center[1])) - enough
        if spare < 0.0:
            return False
    return True
