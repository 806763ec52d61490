"""From a laser scan to the free range of the robot's centre: erosion by the robot's disc in polar coordinates.

For the bearing grid see `bearing_hits`.
"""

import math
from functools import lru_cache
from typing import NamedTuple

import numpy as np
from numba import njit

from drake_starnav.lidar.laser_scan import LaserScan
from drake_starnav.regions.bearing_hits import BearingHits, half_gaps, scan_hits
from drake_starnav.regions.parameters import StarParameters
from drake_starnav.regions.passages import opened_passages

SMOOTHING_JUMP = 0.12
"""Range step between beams at which smoothing stops, m."""
SMOOTHING_LIMIT = 0.04
"""A smoothed range that differs by more than this from the measured one is rejected, m."""


class FreeRange(NamedTuple):
    """Distance that the robot's centre can move along each bearing; sample 0 is at the first beam.

    Attributes:
        values: shape (M,), m.
        limit: upper bounds of the values, 0 outside the field of view, shape (M,), m.
        margin: smallest clearance kept beyond the robot's radius, m.
    """

    values: np.ndarray
    limit: np.ndarray
    margin: float


def smoothed_distances(scan: LaserScan, parameters: StarParameters) -> np.ndarray:
    """Smoothed ranges, shape (n,), m; corners and separate surfaces are preserved."""
    beams, slack = parameters.smoothing_beams, parameters.smoothing_slack
    return _moving_average(scan.distances, scan.range_max, beams, slack, scan.full_circle)


def bearing_count(scan: LaserScan, parameters: StarParameters) -> int:
    """Number of samples M: a multiple of the beams of a full-circle scan, so that samples lie on beams."""
    if not scan.full_circle:
        return parameters.bearings
    beams = len(scan.ranges)
    return beams * math.ceil(parameters.bearings / beams)


def free_limit(scan: LaserScan, samples: int, view_range: float, radius: float, side: float = 0.0) -> np.ndarray:
    """Upper bound of the distance that a disc's centre can move within observed space, shape (M,), m.

    Args:
        scan: defines the field of view, outside which the limit is 0.
        samples: M.
        view_range: range up to which the scan observes, m.
        radius: of the disc with its margin, m.
        side: bearings nearer than this to an edge of the field of view count as outside, rad.
    """
    if scan.full_circle:
        first, last = 0.0, 2.0 * math.pi
    else:
        first, last = side, scan.angle_increment * (len(scan.ranges) - 1) + 1e-9 - side
    return _limit(samples, first, last, max(view_range - radius, 0.0))


def sight_limit(scan: LaserScan, limit: np.ndarray, radius: float) -> np.ndarray:
    """The limit of `free_limit`, reduced where a moving obstacle occludes the space behind it, shape (M,), m.

    Such hits are not eroded: the obstacle will have left, and until then obstacle avoidance keeps clear of it.
    """
    if scan.motion is None or not scan.moving.any():
        return limit
    seen = np.maximum(scan.distances - radius, 0.0)
    return np.minimum(limit, _sight(seen, scan.moving, scan.angle_increment, scan.full_circle, len(limit)))


def eroded_range(hits: BearingHits, radius: float, limit: np.ndarray) -> np.ndarray:
    """Distance that a disc's centre can move along each bearing, shape (M,), m.

    With the hits q_j at distance d_j and bearing theta_j,
        Phi_r(theta) = min_j [ d_j cos(D) - sqrt(R_j^2 - d_j^2 sin^2(D)) ],   D = theta - theta_j,
    over |D| < asin(R_j/d_j), and 0 where d_j <= R_j and |D| <= pi/2. A hit that lies off its sample's bearing
    by at most delta gets R_j + d_j delta. Between two samples the true free range is at least the smaller of both.

    Args:
        hits: on M bearings.
        radius: R, of the disc with its margin, m.
        limit: shape (M,), upper bound, as from `free_limit`, m.
    """
    cosine, sine_squared = _tables(len(hits.distance))
    return _erode(hits.distance, hits.half_gap, hits.offset, radius, limit, cosine, sine_squared)


def free_range(scan: LaserScan, distance: np.ndarray, radius: float, parameters: StarParameters) -> FreeRange:
    """Free range of the robot's centre at every bearing, as the planner uses it.

    The clearance is `margin`. Passages that this margin would close get a smaller one, down to `least_margin`.

    Args:
        scan: in the sensor frame S at the robot's centre.
        distance: shape (n,), the scan's `smoothed_distances`, m.
        radius: of the robot, without margin, m.
        parameters: margin, least_margin, bearings.

    Source: paper, section III-A; the erosion, which the paper leaves to the controller: this project.
    """
    samples, margin = bearing_count(scan, parameters), parameters.margin
    hits = scan_hits(scan, distance, half_gaps(scan, distance), samples)
    limit = free_limit(scan, samples, scan.range_max, radius + margin)
    sight = sight_limit(scan, limit, radius + margin)

    def eroded(margin: float) -> np.ndarray:
        return eroded_range(hits, radius + margin, sight)

    free, margin = opened_passages(eroded(margin), margin, parameters.least_margin, eroded)
    return FreeRange(free, limit, margin)


@lru_cache(maxsize=16)
def _tables(samples: int) -> tuple[np.ndarray, np.ndarray]:
    """cos and sin^2 of every difference of two bearings."""
    angle = 2.0 * math.pi / samples * np.arange(samples)
    return np.cos(angle), np.sin(angle) ** 2


@lru_cache(maxsize=16)
def _limit(samples: int, first: float, last: float, most: float) -> np.ndarray:
    """`most` at the bearings from `first` to `last`, else 0."""
    bearing = 2.0 * math.pi / samples * np.arange(samples)
    limit = np.where((bearing >= first) & (bearing <= last), most, 0.0)
    limit.flags.writeable = False
    return limit


@njit(cache=True)
def _moving_average(distance, range_max, half_width, slack, wrap):
    n = len(distance)
    jump, limit = SMOOTHING_JUMP + slack, SMOOTHING_LIMIT + slack
    out = distance.copy()
    for i in range(n):
        if distance[i] >= range_max:
            continue
        width = min(half_width, (n - 1) // 2) if wrap else min(half_width, i, n - 1 - i)
        total = before = after = distance[i]
        count = 0
        for k in range(1, width + 1):  # grow a symmetric window while both sides stay on the surface
            a = distance[i - k]  # a negative index counts from the end
            b = distance[i + k if i + k < n else i + k - n]
            if a >= range_max or b >= range_max:
                break
            if abs(a - before) > jump or abs(b - after) > jump:
                break
            total += a + b
            before, after = a, b
            count = k
        mean = total / (2 * count + 1)
        if abs(mean - distance[i]) < limit:
            out[i] = mean
    return out


@njit(cache=True)
def _sight(seen, moving, increment, wrap, samples):
    """Range of the moving beams, for all samples from the beam before to the beam after each; infinity elsewhere."""
    out = np.full(samples, np.inf)
    step = 2.0 * math.pi / samples
    for i in range(len(seen)):
        if moving[i]:
            first, last = int(math.ceil((i - 1) * increment / step)), int(math.floor((i + 1) * increment / step))
            for k in range(first, last + 1):
                if wrap or 0 <= k < samples:
                    out[k % samples] = min(out[k % samples], seen[i])
    return out


@njit(cache=True)
def _erode(distance, gap, offset, radius, limit, cosine, sine_squared):
    samples = len(distance)
    reach = samples // 4 + 1  # no disc covers more than a quarter turn to either side
    line = np.full(
        samples + 2 * reach, np.inf
    )  # the full turn with an overlap, so that inner loops need no wrap-around
    entry = np.empty(reach + 1)
    farthest = limit.max()
    for j in range(samples):
        d = distance[j]
        if d == np.inf:
            continue
        inflated = radius + d * offset[j]
        if d - inflated - gap[j] >= farthest:
            continue
        squared = inflated * inflated + gap[j] * gap[j]
        center = j + reach
        if d * d <= squared:
            line[center - samples // 4 : center + samples // 4 + 1] = 0.0
            continue
        width = int(math.asin(math.sqrt(squared) / d) * samples / (2.0 * math.pi))
        d_squared = d * d
        for i in range(width + 1):
            entry[i] = d * cosine[i] - math.sqrt(max(squared - d_squared * sine_squared[i], 0.0))
        for i in range(width + 1):
            line[center + i] = min(line[center + i], entry[i])
        for i in range(width + 1):
            line[center - i] = min(line[center - i], entry[i])
    out = limit.copy()
    for i in range(samples):
        out[i] = min(out[i], line[reach + i])
    for i in range(reach):
        out[i] = min(out[i], line[reach + samples + i])
        out[samples - reach + i] = min(out[samples - reach + i], line[i])
    return out
