"""Ranges averaged over the remembered scans, which reduces the certificate's error and nearly removes its bias.

Of all hits that several scans leave on a wall, the nearest bounds the certified region; its error is about three
standard deviations. But the scans measure the same surfaces. The range of a beam of the latest scan is estimated from
an earlier scan where the beam crosses the chord between two neighbouring hits of that scan.
"""

import dataclasses
import itertools
import math
from collections.abc import Sequence

import numpy as np
from numba import njit

from drake_starnav.lidar.laser_scan import LaserScan
from drake_starnav.regions.bearing_hits import CONNECTED_CHORD
from drake_starnav.regions.observation import Observation
from drake_starnav.regions.safe_region import ScanMemory

SAME_SURFACE = 0.04
"""Ranges that differ by no more than this belong to one surface, m: four standard deviations of 1 cm."""


def averaged(memory: ScanMemory, scan: LaserScan, pose: np.ndarray, reach: float) -> tuple[ScanMemory, LaserScan]:
    """The memory without the hits on surfaces that the latest scan sees, and that scan with averaged ranges.

    The range of a beam within reach becomes the mean of its measurement and of its estimates from the remembered scans
    that see the same surface. An earlier hit stays in the memory if the latest scan does not see its surface. Only for
    static worlds: an approaching surface is detected two scan periods late.

    Args:
        memory: earlier scans, as measured.
        scan: the latest, in S.
        pose: (x, y, yaw) of S in W when it was taken.
        reach: hits farther than this are not averaged, m.
    """
    if not memory.counts:
        return memory, scan
    points, ends = memory.points, np.cumsum(memory.counts)
    hits = scan.hits & (scan.ranges < reach)
    mean, _ = _averaged_ranges(scan, pose, hits, points, ends, reach)
    again = _seen_again(scan, mean, points, pose, reach + SAME_SURFACE)
    kept = np.cumsum(np.append(0, ~again))
    counts = tuple(np.diff(kept[ends], prepend=0).tolist())
    memory = dataclasses.replace(memory, points=points[~again], half_gaps=memory.half_gaps[~again], counts=counts)
    return memory, dataclasses.replace(scan, ranges=np.where(hits, mean, scan.ranges))


def mean_scan(observations: Sequence[Observation], reach: float) -> tuple[LaserScan, np.ndarray]:
    """The last of several scans with averaged ranges, and of how many scans the range of each beam is the mean.

    Args:
        observations: the scans with their poses, oldest first; at least two.
        reach: hits farther than this are left out, m.

    Returns:
        A scan in which all other beams have no return, and shape (n,).
    """
    *before, last = observations
    earlier = [seen.scan.points_at(seen.scan.distances, seen.scan.mappable_hits, seen.pose) for seen in before]
    ends = np.cumsum([len(each) for each in earlier])
    hits = last.scan.mappable_hits & (last.scan.ranges < reach)
    mean, count = _averaged_ranges(last.scan, last.pose, hits, np.concatenate(earlier), ends, reach)
    return dataclasses.replace(last.scan, ranges=mean), count


def _averaged_ranges(
    scan: LaserScan, pose: np.ndarray, hits: np.ndarray, points: np.ndarray, ends: np.ndarray, reach: float
) -> tuple[np.ndarray, np.ndarray]:
    """The mean ranges of the `hits` (n,) of a scan taken at a pose, and of how many scans each is the mean.

    Of earlier scans by their hits (k, 2), W, m, and where those of each scan `ends`; those beyond `reach` are left out.
    """
    measured = np.where(hits, scan.ranges, np.inf)
    rays = scan.points_at(np.ones(len(hits)), np.full(len(hits), True), (0.0, 0.0, pose[2]))
    place = float(pose[0]), float(pose[1]), float(pose[2]) + scan.angle_min
    total, count = measured.copy(), np.ones(len(measured))
    for begin, end in itertools.pairwise((0, *ends.tolist())):
        _add_estimates(measured, rays, points[begin:end], scan.beams, place, reach + SAME_SURFACE, total, count)
    return total / count, count


def _seen_again(scan: LaserScan, ranges: np.ndarray, points: np.ndarray, pose: np.ndarray, reach: float) -> np.ndarray:
    """Points on surfaces that the scan sees: at the range of a neighbouring beam, or between those of both."""
    distance, beam = scan.polar(points, pose)
    left = beam.astype(int)
    wraps = left + 1 >= len(ranges)
    left = np.where(wraps, len(ranges) - 1, left)
    one, other = ranges[left], ranges[np.where(wraps, 0, left + 1)]
    near, far = np.minimum(one, other), np.maximum(one, other)
    between = (near < distance) & (distance < far) & (far < near + CONNECTED_CHORD)
    beside = np.minimum(np.abs(distance - near), np.abs(distance - far)) < SAME_SURFACE
    within = (np.abs(points - pose[:2]).max(axis=1) <= reach) & (scan.full_circle | ~wraps)
    return within & (between | beside)


@njit(cache=True)
def _beam(dx, dy, first, increment):
    """The real-valued index of the beam towards (dx, dy) from the sensor; `first` is the bearing of beam 0."""
    return ((math.atan2(dy, dx) - first) % (2.0 * math.pi)) / increment


@njit(cache=True)
def _add_estimates(measured, rays, points, beams, place, reach, total, count):
    """Add to each beam's total its crossing with a chord of an earlier scan, the one nearest to its measured range."""
    x, y, first = place
    increment, full_circle, number = beams.increment, beams.seam < np.inf, len(measured)
    turn = 2.0 * math.pi / increment
    nearest = np.full(number, np.inf)
    last, beam = -2, 0.0  # the hit whose beam was computed last
    for i in range(len(points)):
        px, py = points[i - 1, 0] - x, points[i - 1, 1] - y  # in a full circle the last hit is next to the first
        qx, qy = points[i, 0] - x, points[i, 1] - y
        ex, ey = qx - px, qy - py
        if max(abs(qx), abs(qy)) > reach or ex * ex + ey * ey > CONNECTED_CHORD * CONNECTED_CHORD:
            continue
        after = _beam(qx, qy, first, increment)
        before = _beam(px, py, first, increment) if last != i - 1 else beam
        last, beam = i, after
        low, high = min(before, after), max(before, after)
        if high - low > 0.5 * turn:  # the chord crosses the bearing of beam 0
            low, high = high - turn, low
        for n in range(int(math.ceil(low)), int(math.floor(high)) + 1):
            k = n % number if full_circle else n
            if k < 0 or k >= number or measured[k] == np.inf:
                continue
            across = rays[k, 0] * ey - rays[k, 1] * ex
            if abs(across) < 1e-12:
                continue
            crossing = (px * ey - py * ex) / across
            if abs(crossing - measured[k]) < min(SAME_SURFACE, abs(nearest[k] - measured[k])):
                nearest[k] = crossing
    for k in range(number):
        if nearest[k] < np.inf:
            total[k] += nearest[k]
            count[k] += 1.0
