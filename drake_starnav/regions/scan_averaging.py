"""Ranges averaged over the remembered scans, which reduces the certificate's error and nearly removes its bias.

Of all hits that several scans leave on a wall, the nearest bounds the certified region; its error is about three
standard deviations. But the scans measure the same surfaces. The range of a beam of the latest scan is estimated from
an earlier scan where the beam crosses the chord between two neighbouring hits of that scan.
"""

import dataclasses
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
    place = float(pose[0]), float(pose[1]), float(pose[2]) + scan.angle_min
    again = _seen_again(mean, points, scan.beams, place, reach + SAME_SURFACE)
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
    """As `_averaged`, for the `hits` (n,) of a scan taken at a pose."""
    measured = np.where(hits, scan.ranges, np.inf)
    rays = scan.points_at(np.ones(len(hits)), np.full(len(hits), True), (0.0, 0.0, pose[2]))
    place = float(pose[0]), float(pose[1]), float(pose[2]) + scan.angle_min
    return _averaged(measured, rays, points, ends, scan.beams, place, reach + SAME_SURFACE)


@njit(cache=True)
def _averaged(measured, rays, points, ends, beams, place, reach):
    """The mean ranges, and of how many scans each is the mean.

    Args:
        measured: ranges of the hits to average, shape (n,), m; infinite for all other beams.
        rays: directions of the beams in W, shape (n, 2).
        points, ends: hits of earlier scans, shape (k, 2), W, m, and where those of each scan end.
        beams: of the scan.
        place: x, y of the sensor, m, and the bearing of its first beam in W, rad.
        reach: farther points are left out, m.
    """
    total, count = measured.copy(), np.ones(len(measured))
    begin = 0
    for end in ends:
        _add_estimates(measured, rays, points[begin:end], beams, place, reach, total, count)
        begin = end
    return total / count, count


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


@njit(cache=True)
def _seen_again(ranges, points, beams, place, reach):
    """Points on surfaces that the scan sees: at the range of a neighbouring beam, or between those of both."""
    x, y, first = place
    increment, full_circle, number = beams.increment, beams.seam < np.inf, len(ranges)
    out = np.zeros(len(points), np.bool_)
    for i in range(len(points)):
        dx, dy = points[i, 0] - x, points[i, 1] - y
        if max(abs(dx), abs(dy)) > reach:
            continue
        left = int(_beam(dx, dy, first, increment))
        right = left + 1
        if full_circle and right >= number:
            left, right = number - 1, 0
        elif right >= number:
            continue
        distance = math.hypot(dx, dy)
        near, far = min(ranges[left], ranges[right]), max(ranges[left], ranges[right])
        between = near < distance < far < near + CONNECTED_CHORD
        out[i] = between or min(abs(distance - near), abs(distance - far)) < SAME_SURFACE
    return out
