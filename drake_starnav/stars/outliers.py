"""Stray returns told from thin obstacles: a hit without a neighbour counts once a second scan confirms it.

What lets a hit count is a second one near it: of a neighbouring beam of the same scan, or of one of the last scans.
Anything that two neighbouring beams hit is thus never doubted, a thinner obstacle for one scan only. A beam whose hit
is doubted counts as lost, not as free: its neighbours bound it, and so what the certificate allows behind it.
"""

import dataclasses
from dataclasses import dataclass

import numpy as np
from numba import njit

from drake_starnav.scan import LaserScan

NEIGHBOUR_BEAMS = 2
"""Neighbours are looked for so many beams to either side."""
NEIGHBOUR_DISTANCE = 0.10
"""A hit nearer than this to another one of the same scan lies on the same surface, m."""
NEIGHBOUR_CHORDS = 4.0
"""... or nearer than so many times the distance between two beams there."""
CONFIRMING_DISTANCE = 0.04
"""A hit of an earlier scan nearer than this confirms a hit, m."""
CONFIRMING_CHORDS = 1.0
"""... or nearer than so many times the distance between two beams there."""
CONFIRMING_SCANS = 4
"""So many earlier scans may confirm a hit."""


@dataclass(frozen=True)
class HitHistory:
    """All hits of the last scans, doubted or not, oldest first. Immutable.

    Attributes:
        points: per scan, shape (n, 2), W, m.
    """

    points: tuple[np.ndarray, ...] = ()

    def __deepcopy__(self, memo: dict) -> "HitHistory":
        return self

    def remembered(self, points: np.ndarray) -> "HitHistory":
        """The history with the hits (n, 2) of one more scan."""
        return HitHistory((*self.points[-CONFIRMING_SCANS + 1 :], points))


def without_strays(scan: LaserScan, pose: np.ndarray, history: HitHistory, slack: float = 0.0) -> LaserScan:
    """The scan with every hit lost (NaN) that neither a neighbouring beam nor an earlier scan confirms.

    Args:
        scan: in the sensor frame S.
        pose: (x, y, yaw) of S in W when it was taken.
        history: hits of the scans before it.
        slack: how much farther apart two hits of one surface may lie because of noise, m.
    """
    index = np.flatnonzero(scan.hits)
    points = scan.points(pose)
    earlier = np.concatenate((np.zeros((0, 2)), *history.points))
    reach = scan.distances[index] * scan.angle_increment
    doubted = _doubted(
        points,
        index,
        np.maximum(NEIGHBOUR_DISTANCE, NEIGHBOUR_CHORDS * reach) + slack,
        earlier,
        np.maximum(CONFIRMING_DISTANCE, CONFIRMING_CHORDS * reach) + slack,
        len(scan.ranges),
        scan.full_circle,
    )
    if not doubted.any():
        return scan
    ranges = scan.ranges.copy()
    ranges[index[doubted]] = np.nan
    return dataclasses.replace(scan, ranges=ranges, lost_beams=True)


@njit(cache=True)
def _doubted(points, index, beside, earlier, before, beams, wrap):
    n = len(points)
    out = np.ones(n, np.bool_)
    for i in range(n):
        x, y = points[i, 0], points[i, 1]
        for side in (-1, 1):
            for k in range(
                1, min(NEIGHBOUR_BEAMS, n - 1) + 1
            ):  # hits are sorted by beam: no more than these can be near
                j = i + side * k
                if not wrap and not 0 <= j < n:
                    break
                apart = side * (index[j % n] - index[i])
                if wrap:
                    apart %= beams
                if apart > NEIGHBOUR_BEAMS:
                    break
                dx, dy = points[j % n, 0] - x, points[j % n, 1] - y
                if dx * dx + dy * dy <= beside[i] * beside[i]:
                    out[i] = False
        if out[i]:
            for j in range(len(earlier)):
                dx, dy = earlier[j, 0] - x, earlier[j, 1] - y
                if dx * dx + dy * dy <= before[i] * before[i]:
                    out[i] = False
                    break
    return out
