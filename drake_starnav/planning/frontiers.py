"""Frontiers: places at the boundary of a star-shaped region from which the robot could observe more."""

import math
from dataclasses import dataclass

import numpy as np
from numba import njit

from drake_starnav.regions.star_region import StarRegion

JUMP = 0.2
"""A step of the free range that makes an edge frontier, m: the clearances of both its ends fit in."""
SPACING = 0.25
"""Distance between frontier points, m."""
PROBE_DISTANCE = 0.1
"""Distance of a frontier's probe inside unknown space, m."""
ARRIVAL_DISTANCE = 0.12
"""A frontier this near counts as reached, m: half a robot's radius away, its scan shows what lies beyond."""
PROBE_REACHED = 0.6
"""A region that ends before a probe by at most this share of the probe distance counts as covering it."""
EDGE_CLEARANCE = 0.12
"""Edge frontiers keep this distance from both ends of the jump, m."""
RIM_INSET = 0.02
"""Frontier points on an arc at maximum range lie this far inside it, m."""


@dataclass(frozen=True)
class Frontiers:
    """Open frontier points of the roadmap. Immutable; all in W, m.

    Attributes:
        viewpoint: shape (n, 2), position of the robot at the frontier, inside the owner's region.
        probe: shape (n, 2), a place in unknown space just beyond; once a region covers it, the frontier is explored.
        owner: shape (n,), index of the region that it belongs to.
    """

    viewpoint: np.ndarray
    probe: np.ndarray
    owner: np.ndarray

    @staticmethod
    def none() -> "Frontiers":
        """No frontiers."""
        return Frontiers(np.zeros((0, 2)), np.zeros((0, 2)), np.zeros(0, np.int64))

    def __len__(self) -> int:
        return len(self.owner)

    def where(self, chosen: np.ndarray) -> "Frontiers":
        """Those that a boolean mask of shape (n,) or indices choose."""
        rows = np.flatnonzero(chosen) if chosen.dtype == bool else chosen
        # `take`, as `[rows]` of two columns takes ten times as long
        return Frontiers(self.viewpoint.take(rows, axis=0), self.probe.take(rows, axis=0), self.owner.take(rows))

    def joined(self, *others: "Frontiers") -> "Frontiers":
        """These frontiers followed by the others."""
        parts = (self, *others)
        return Frontiers(
            np.vstack([part.viewpoint for part in parts]),
            np.vstack([part.probe for part in parts]),
            np.concatenate([part.owner for part in parts]),
        )


def edge_frontiers(region: StarRegion, owner: int) -> Frontiers:
    """Frontiers at jumps of the free range and along arcs at maximum range.

    At a jump, viewpoints lie along the ray of the jump, one sample beside it, and probes lie across it, behind the
    nearer surface. On an arc at maximum range, viewpoints lie just inside and probes just outside.
    """
    rows = _edge_points(region.center, region.bearing_0, region.free_range, region.boundary.values, region.limit)
    return Frontiers(rows[:, :2].copy(), rows[:, 2:].copy(), np.full(len(rows), owner))


@njit(cache=True)
def _edge_points(center, bearing_0, free, fitted, limit):
    """Viewpoints and probes of `edge_frontiers` of a region with these fields, shape (n, 4), W, m."""
    count = len(free)
    step = 2.0 * math.pi / count
    out = np.empty((4096, 4))
    n = 0
    along_arc = np.inf
    for i in range(count):
        j = (i + 1) % count
        if abs(free[i] - free[j]) > JUMP:
            near, far, side = (i, j, -1.0) if free[i] < free[j] else (j, i, 1.0)
            beside = int(far - side) % count  # one sample beside the jump a viewpoint is inside the region
            theta = bearing_0 + far * step
            low = free[near]
            at_limit = free[far] >= limit[far] - RIM_INSET
            high = min(fitted[far], fitted[beside]) - (RIM_INSET if at_limit else EDGE_CLEARANCE)
            r = low + EDGE_CLEARANCE
            if r > high:
                r = 0.5 * (low + high)
            while high - low >= 0.04 and r <= high and n < len(out):
                if r > ARRIVAL_DISTANCE:
                    across = theta + side * max(1.5 * step, PROBE_DISTANCE / r)
                    out[n, 0] = center[0] + r * math.cos(theta - side * step)
                    out[n, 1] = center[1] + r * math.sin(theta - side * step)
                    out[n, 2] = center[0] + r * math.cos(across)
                    out[n, 3] = center[1] + r * math.sin(across)
                    n += 1
                r += SPACING
        if limit[i] > 0.0 and free[i] >= limit[i] - RIM_INSET:
            along_arc += step * free[i]
            r = fitted[i] - RIM_INSET
            if along_arc > SPACING and r > ARRIVAL_DISTANCE and n < len(out):
                along_arc = 0.0
                theta = bearing_0 + i * step
                out[n, 0] = center[0] + r * math.cos(theta)
                out[n, 1] = center[1] + r * math.sin(theta)
                out[n, 2] = center[0] + (free[i] + PROBE_DISTANCE) * math.cos(theta)
                out[n, 3] = center[1] + (free[i] + PROBE_DISTANCE) * math.sin(theta)
                n += 1
        else:
            along_arc = np.inf
    return out[:n].copy()
