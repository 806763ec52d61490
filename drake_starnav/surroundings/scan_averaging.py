"""Ranges averaged over the recent scans, which reduces the certificate's error and nearly removes its bias.

Of all hits that several scans leave on a wall, the nearest bounds the certified star; its error is about three
standard deviations. But the scans measure the same surfaces. The range of a beam of the latest scan is estimated from
an earlier scan where the beam crosses the chord between two neighbouring hits of that scan.
"""

import dataclasses
import itertools
import math
from collections.abc import Sequence

import numpy as np

from drake_starnav.geometry.compiled import kernel
from drake_starnav.lidar.laser_scan import LaserScan
from drake_starnav.surroundings.bearing_hits import CONNECTED_CHORD
from drake_starnav.surroundings.erosion import SAME_SURFACE
from drake_starnav.surroundings.observation import Observation
from drake_starnav.surroundings.recent_hits import Hits, RecentHits

AVERAGED_WITHIN = 2.0
"""Hits are averaged up to this distance from the robot's hull, in its radii: only these restrict it, and farther away
the beams are too far apart."""


def average_scan(recent: RecentHits, scan: LaserScan, pose: np.ndarray, reach: float) -> tuple[RecentHits, LaserScan]:
    """Return the recent hits without those on surfaces that the latest scan sees, and that scan with averaged ranges.

    The range of a beam within reach becomes the mean of its measurement and of its estimates from the recent scans
    that see the same surface. A recent hit stays if the latest scan does not see its surface. Only for static worlds:
    an approaching surface is detected two scan periods late.

    Args:
        recent: hits of earlier scans, as measured.
        scan: the latest, in S.
        pose: (x, y, yaw) of S in W when it was taken.
        reach: hits farther than this are not averaged, m.
    """
    if not recent.counts:
        return recent, scan
    (points, gaps), hit_ends = recent.hits, np.cumsum(recent.counts)
    hits = scan.hits & (scan.ranges < reach)
    mean, _ = _average_ranges(scan, pose, hits, points, hit_ends, reach)
    rest = ~_find_seen_again(scan, mean, points, pose, reach + SAME_SURFACE * scan.cover_radius)
    counts = tuple(np.diff(np.cumsum(np.append(0, rest))[hit_ends], prepend=0).tolist())
    scan = dataclasses.replace(scan, ranges=np.where(hits, mean, scan.ranges))
    return RecentHits(Hits(points[rest], gaps[rest]), counts), scan


def average_scans(observations: Sequence[Observation], reach: float) -> tuple[LaserScan, np.ndarray]:
    """Return the last of several scans with averaged ranges, and of how many scans the range of each beam is the mean.

    Args:
        observations: the scans with their poses, oldest first; at least two.
        reach: hits farther than this are left out, m.

    Returns:
        A scan in which all other beams have no return, and shape (n,).
    """
    *previous_observations, last_observation = observations
    earlier = [
        observation.scan.points_at(observation.scan.distances, observation.scan.mappable_hits, observation.pose)
        for observation in previous_observations
    ]
    hit_ends = np.cumsum([len(each) for each in earlier])
    hits = last_observation.scan.mappable_hits & (last_observation.scan.ranges < reach)
    mean, count = _average_ranges(
        last_observation.scan, last_observation.pose, hits, np.concatenate(earlier), hit_ends, reach
    )
    return dataclasses.replace(last_observation.scan, ranges=mean), count


def _average_ranges(
    scan: LaserScan, pose: np.ndarray, hits: np.ndarray, points: np.ndarray, hit_ends: np.ndarray, reach: float
) -> tuple[np.ndarray, np.ndarray]:
    """Return the mean ranges of the `hits` (n,) of a scan taken at a pose, and of how many scans each is the mean.

    Earlier scans are given by their hits (k, 2), W, m, and the index where those of each end, `hit_ends`; none beyond
    `reach` counts.
    """
    measured_ranges = np.where(hits, scan.ranges, np.inf)
    rays = scan.points_at(np.ones(len(hits)), np.full(len(hits), True), (0.0, 0.0, pose[2]))
    _, beam = scan.polar(points, pose)
    offset, hit_range = points - pose[:2], reach + SAME_SURFACE * scan.cover_radius
    total, count = measured_ranges.copy(), np.ones(len(measured_ranges))
    for begin, end in itertools.pairwise((0, *hit_ends.tolist())):
        estimates = _estimate_ranges(measured_ranges, rays, offset[begin:end], beam[begin:end], scan.beams, hit_range)
        total, count = total + np.where(estimates < np.inf, estimates, 0.0), count + (estimates < np.inf)
    return total / count, count


def _find_seen_again(
    scan: LaserScan, ranges: np.ndarray, points: np.ndarray, pose: np.ndarray, reach: float
) -> np.ndarray:
    """Return points on surfaces that the scan sees: at the range of a neighbouring beam, or between those of both."""
    distance, beam = scan.polar(points, pose)
    left_beam = beam.astype(int)
    wraps = left_beam + 1 >= len(ranges)
    left_beam = np.where(wraps, len(ranges) - 1, left_beam)
    one, other = ranges[left_beam], ranges[np.where(wraps, 0, left_beam + 1)]
    near_range, far_range = np.minimum(one, other), np.maximum(one, other)
    between = (
        (near_range < distance)
        & (distance < far_range)
        & (far_range < near_range + CONNECTED_CHORD * scan.cover_radius)
    )
    is_beside = (
        np.minimum(np.abs(distance - near_range), np.abs(distance - far_range)) < SAME_SURFACE * scan.cover_radius
    )
    is_in_reach = (np.abs(points - pose[:2]).max(axis=1) <= reach) & (scan.full_circle | ~wraps)
    return is_in_reach & (between | is_beside)


@kernel
def _estimate_ranges(measured_ranges, rays, points, beam, beams, reach):
    """Return each beam's crossing with a chord of an earlier scan, nearest to its measured range, m; or infinity.

    The points (k, 2) of that scan are relative to the sensor in W, m; `beam` (k,) is the real-valued beam towards each.
    """
    full_circle, number = beams.seam < np.inf, len(measured_ranges)
    turn, radius = 2.0 * math.pi / beams.increment, beams.cover_radius
    connected_chord, same_surface = CONNECTED_CHORD * radius, SAME_SURFACE * radius
    nearest = np.full(number, np.inf)
    for i in range(len(points)):
        px, py = points[i - 1]  # in a full circle the last hit is next to the first
        qx, qy = points[i]
        ex, ey = qx - px, qy - py
        if max(abs(qx), abs(qy)) > reach or ex * ex + ey * ey > connected_chord * connected_chord:
            continue
        low, high = min(beam[i - 1], beam[i]), max(beam[i - 1], beam[i])
        if high - low > 0.5 * turn:  # the chord crosses the bearing of beam 0
            low, high = high - turn, low
        for n in range(int(math.ceil(low)), int(math.floor(high)) + 1):
            k = n % number if full_circle else n
            if k < 0 or k >= number or measured_ranges[k] == np.inf:
                continue
            across = rays[k, 0] * ey - rays[k, 1] * ex
            if abs(across) < 1e-12:
                continue
            crossing = (px * ey - py * ex) / across
            if abs(crossing - measured_ranges[k]) < min(same_surface, abs(nearest[k] - measured_ranges[k])):
                nearest[k] = crossing
    return nearest
