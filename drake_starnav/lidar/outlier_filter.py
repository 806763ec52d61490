"""Stray returns told from thin obstacles: a hit without a neighbour counts once two earlier scans confirm it.

What lets a hit count are others near it: of a neighbouring beam of the same scan, or of two of the last scans, since
among the strays of several scans there is often one near. Anything that two neighbouring beams hit is thus never
doubted, a thinner obstacle for two scans only; but what seems to lie inside the robot is a stray, since the robot is
there. A beam whose hit is doubted counts as lost, not as free: its neighbours
bound it, and so what the certificate allows behind it.
"""

import dataclasses
import math

import numpy as np
from numba import njit

from drake_starnav.lidar.laser_scan import LaserScan
from drake_starnav.utils.snapshot import snapshot

NEIGHBOUR_BEAMS = 2
"""Neighbours are looked for so many beams to either side."""
NEIGHBOUR_DISTANCE = 0.05
"""A hit nearer than this to another one of the same scan lies on the same surface, m."""
NEIGHBOUR_CHORDS = 4.0
"""... or nearer than so many times the distance between two beams there."""
CONFIRMING_BEAMS = 1.5
"""A hit of an earlier scan confirms a hit if it lies off its beam by at most so many distances between two beams ..."""
CONFIRMING_DISTANCE = 0.03
"""... and is nearer or farther by at most this, or by so much, m."""
CONFIRMING_SCANS = 4
"""Of so many earlier scans ..."""
CONFIRMATIONS = 2
"""... so many must have hits that confirm a hit."""
INSIDE_DEVIATIONS = 3.0
"""A hit lies inside the robot if it does by more than so many standard deviations of the noise."""


@snapshot
class HitHistory:
    """All hits of the last scans, doubted or not, oldest first. Immutable.

    Attributes:
        points: per scan, shape (n, 2), W, m.
    """

    points: tuple[np.ndarray, ...] = ()

    def remembered(self, points: np.ndarray) -> "HitHistory":
        """The history with the hits (n, 2) of one more scan."""
        return HitHistory((*self.points[-CONFIRMING_SCANS + 1 :], points))


def without_strays(
    scan: LaserScan, pose: np.ndarray, history: HitHistory, noise: float = 0.0, body: float = 0.0
) -> tuple[LaserScan, LaserScan]:
    """The scan with doubted hits lost (NaN): as the certificate may trust it, and as the roadmap should.

    Args:
        scan: in the sensor frame S.
        pose: (x, y, yaw) of S in W when it was taken.
        history: hits of the scans before it.
        noise: standard deviation of the ranges, m.
        body: radius of the robot about the sensor, m.

    Returns:
        without the hits that neither a neighbouring beam nor earlier scans confirm, for the certificate; and without
        those that not both of them confirm (a neighbour does while there are too few earlier scans), for the roadmap,
        which forgets nothing.
    """
    farthest = np.maximum(scan.distances, scan.range_min)  # of what is too close only this is known
    scan = _lost(scan, np.flatnonzero(scan.hits & (farthest < body - INSIDE_DEVIATIONS * noise)))
    index = np.flatnonzero(scan.hits)
    earlier = np.concatenate((np.zeros((0, 2)), *history.points))
    number = np.repeat(np.arange(len(history.points)), [len(points) for points in history.points])
    beside, before = _confirmed(
        scan.points(pose),
        np.array(pose[:2], dtype=float),
        scan.distances[index],
        index,
        earlier,
        number,
        scan.angle_increment,
        len(scan.ranges),
        scan.full_circle,
        2.0 * noise,
    )
    trusted = beside & before if len(history.points) >= CONFIRMATIONS else beside
    return _lost(scan, index[~(beside | before)]), _lost(scan, index[~trusted])


def _lost(scan: LaserScan, beams: np.ndarray) -> LaserScan:
    if not len(beams):
        return scan
    ranges = scan.ranges.copy()
    ranges[beams] = np.nan
    return dataclasses.replace(scan, ranges=ranges, lost_beams=True)


@njit(cache=True)
def _confirmed(points, center, distance, index, earlier, number, increment, beams, wrap, slack):
    n = len(points)
    beside, before = np.zeros(n, np.bool_), np.zeros(n, np.bool_)
    for i in range(n):
        x, y = points[i, 0], points[i, 1]
        reach = max(NEIGHBOUR_DISTANCE, NEIGHBOUR_CHORDS * distance[i] * increment) + slack
        for side in (-1, 1):
            for k in range(1, min(NEIGHBOUR_BEAMS, n - 1) + 1):  # hits are sorted by beam: none farther on is nearer
                j = i + side * k
                if not wrap and not 0 <= j < n:
                    break
                apart = side * (index[j % n] - index[i])
                if wrap:
                    apart %= beams
                if apart > NEIGHBOUR_BEAMS:
                    break
                if math.hypot(points[j % n, 0] - x, points[j % n, 1] - y) <= reach:
                    beside[i] = True
        if distance[i] <= 0.0:
            continue
        # along the beam and across it
        ux, uy = (x - center[0]) / distance[i], (y - center[1]) / distance[i]
        across = CONFIRMING_BEAMS * distance[i] * increment
        along = max(CONFIRMING_DISTANCE, across) + slack
        confirmed, last = 0, -1
        for j in range(len(earlier)):
            if number[j] == last:
                continue
            dx, dy = earlier[j, 0] - x, earlier[j, 1] - y
            if abs(dx * ux + dy * uy) <= along and abs(dy * ux - dx * uy) <= across:
                confirmed, last = confirmed + 1, number[j]
                if confirmed == CONFIRMATIONS:
                    before[i] = True
                    break
    return beside, before
