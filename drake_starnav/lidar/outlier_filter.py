"""Outliers distinguished from thin obstacles: a hit without a neighbour counts once two earlier scans confirm it.

A hit is confirmed by other hits near it: by one of a neighbouring beam in the same scan, or by hits in two of the last
scans, since one outlier among several scans is often near. Hence an obstacle that two neighbouring beams hit is never
doubted, and a thinner one only for two scans. A hit inside the robot's own footprint is always an outlier. A beam whose
hit is doubted counts as lost, not as free: its neighbours bound it, and thus what the certificate allows behind it.
"""

import dataclasses
import math
from collections.abc import Callable, Sequence
from typing import NamedTuple

import numpy as np

from drake_starnav.geometry.compiled import kernel
from drake_starnav.lidar.laser_scan import LaserScan
from drake_starnav.utils.snapshot import snapshot

NEIGHBOUR_BEAMS = 2
"""Neighbours are searched among this many beams to each side."""
SAME_SURFACE = 0.05
"""Hits nearer than this to each other lie on the same surface, m."""
CONFIRMING_SCANS = 4
"""Number of earlier scans that are compared."""
CONFIRMATIONS = 2
"""Number of these that must confirm a hit."""


@snapshot
class HitHistory:
    """All hits of the last scans, including doubted ones, oldest first; per scan, shape (n, 2), W, m. Immutable."""

    points: tuple[np.ndarray, ...] = ()

    def add_scan(self, points: np.ndarray) -> "HitHistory":
        """Return the history with the hits (n, 2) of one more scan."""
        return HitHistory((*self.points[-CONFIRMING_SCANS + 1 :], points))


class FilteredScan(NamedTuple):
    """A scan without doubted hits.

    Attributes:
        scan: for the certificate.
        confirmed_scan: for the roadmap, which keeps all hits it is given.
        history: hits of this scan and of those before.
    """

    scan: LaserScan
    confirmed_scan: LaserScan
    history: HitHistory


ScanFilter = Callable[[LaserScan, np.ndarray, HitHistory, float], FilteredScan]
"""What discards doubted hits: `remove_lone_close_hits`, or `remove_outliers` with a noise."""


def remove_outliers(
    scan: LaserScan, pose: np.ndarray, history: HitHistory, body: float = 0.0, noise: float = 0.0
) -> FilteredScan:
    """Return a scan in which doubted hits are lost (NaN).

    For the certificate, those are hits that neither a neighbouring beam nor earlier scans confirm. For the roadmap,
    those that are not confirmed by both; while there are too few earlier scans, a neighbouring beam suffices.

    Args:
        scan: in the sensor frame S.
        pose: (x, y, yaw) of S in W when it was taken.
        history: hits of the scans before it.
        body: radius of the robot about the sensor, m.
        noise: standard deviation of the ranges, m.
    """
    next_history = history.add_scan(scan.points(pose))
    farthest_distances = np.maximum(scan.distances, scan.range_min)  # a hit that is too close lies within range_min
    scan = lose_beams(scan, np.flatnonzero(scan.hits & (farthest_distances < body - 3.0 * noise)))
    hit_beams = np.flatnonzero(scan.hits)
    earlier_hits = np.concatenate((np.zeros((0, 2)), *history.points))
    scan_numbers = np.repeat(np.arange(len(history.points)), [len(points) for points in history.points])
    has_neighbour, seen_before = _find_confirmed(
        scan.points(pose),
        np.array(pose[:2], dtype=float),
        scan.distances[hit_beams],
        hit_beams,
        earlier_hits,
        scan_numbers,
        scan.beams,
        2.0 * noise,
    )
    is_trusted = has_neighbour & seen_before if len(history.points) >= CONFIRMATIONS else has_neighbour
    doubted, unconfirmed = hit_beams[~(has_neighbour | seen_before)], hit_beams[~is_trusted]
    return FilteredScan(lose_beams(scan, doubted), lose_beams(scan, unconfirmed), next_history)


def find_lone_close_hits(scan: LaserScan, body: float) -> np.ndarray:
    """Return the beams whose hits are errors, though no outliers are declared: nearer than all that can be near.

    Such a hit is nearer than `range_min` or inside the robot, and NEIGHBOUR_BEAMS to each side all see farther, so that
    what it hits would have to be narrower than two beams are apart there. `body` is as of `remove_outliers`.
    """
    nearest_range, n, wraps = max(scan.range_min, body), len(scan.ranges), scan.full_circle
    close_beams = np.flatnonzero(scan.ranges < nearest_range)
    if not len(close_beams):
        return close_beams
    beam_steps = np.array([k for k in range(-NEIGHBOUR_BEAMS, NEIGHBOUR_BEAMS + 1) if k])
    neighbour_beams = close_beams[:, None] + beam_steps
    sees_farther = scan.ranges[neighbour_beams % n] > nearest_range + SAME_SURFACE
    return close_beams[(sees_farther & (wraps | (neighbour_beams >= 0) & (neighbour_beams < n))).all(axis=1)]


def remove_lone_close_hits(scan: LaserScan, pose: np.ndarray, history: HitHistory, body: float) -> FilteredScan:
    """Return a scan with its `find_lone_close_hits` lost; a `ScanFilter` that needs neither pose nor history."""
    scan = lose_beams(scan, find_lone_close_hits(scan, body))
    return FilteredScan(scan, scan, history)


def lose_beams(scan: LaserScan, beams: Sequence[int] | np.ndarray) -> LaserScan:
    """Return a scan in which beams of these indices, shape (k,), have no measurement."""
    if not len(beams):
        return scan
    ranges = scan.ranges.copy()
    ranges[beams] = np.nan
    return dataclasses.replace(scan, ranges=ranges, lost_beams=True)


@kernel
def _find_confirmed(points, center, distance, index, earlier, number, beams, slack):
    """Which hits a neighbouring beam confirms, and which earlier scans do, shape (n,) each.

    The hits are points (n, 2), W, m, at a distance (n,), m, from the sensor's center, with the index of their beams;
    those of earlier scans (k, 2), with the number of the scan. Within `slack`, m, hits count as near.
    """
    n, increment, wrap = len(points), beams.increment, beams.seam < np.inf
    has_neighbour, seen_before = np.zeros(n, np.bool_), np.zeros(n, np.bool_)
    for i in range(n):
        x, y = points[i, 0], points[i, 1]
        chord = distance[i] * increment  # between two beams at its range
        reach = max(SAME_SURFACE, 4.0 * chord) + slack  # hits nearer than this to each other lie on the same surface
        for side in (-1, 1):
            for k in range(1, min(NEIGHBOUR_BEAMS, n - 1) + 1):  # hits are sorted by beam
                j = i + side * k
                if not wrap and not 0 <= j < n:
                    break
                beams_apart = side * (index[j % n] - index[i])
                if wrap:
                    beams_apart %= len(beams.distances)
                if beams_apart > NEIGHBOUR_BEAMS:
                    break
                if math.hypot(points[j % n, 0] - x, points[j % n, 1] - y) <= reach:
                    has_neighbour[i] = True
        if distance[i] <= 0.0:
            continue
        # along the beam and across it, by how much a confirming hit may be off
        ux, uy = (x - center[0]) / distance[i], (y - center[1]) / distance[i]
        across = 1.5 * distance[i] * increment
        allowed_along = max(0.03, across) + slack
        confirmations, last = 0, -1
        for j in range(len(earlier)):
            if number[j] == last:
                continue
            dx, dy = earlier[j, 0] - x, earlier[j, 1] - y
            if abs(dx * ux + dy * uy) <= allowed_along and abs(dy * ux - dx * uy) <= across:
                confirmations, last = confirmations + 1, number[j]
                if confirmations == CONFIRMATIONS:
                    seen_before[i] = True
                    break
    return has_neighbour, seen_before
