"""From a laser scan to the free range of the robot's centre: erosion by the robot's disc in polar coordinates.

A bearing grid of M samples covers the full turn, sample i at bearing `bearing_0 + 2 pi i / M`.
"""

import math
from dataclasses import dataclass
from functools import lru_cache
from typing import NamedTuple

import numpy as np
from numba import njit
from scipy.ndimage import gaussian_filter1d

from drake_starnav.lidar.laser_scan import LaserScan, chord
from drake_starnav.regions.parameters import StarParameters

CONNECTED_CHORD = 0.15
"""Neighbouring hits nearer than this belong to one surface: no robot passes between them, m."""
SMOOTHING_JUMP = 0.12
"""Range step between beams at which smoothing stops, m."""
SMOOTHING_LIMIT = 0.04
"""A smoothed range that differs by more than this from the measured one is refused, m."""
PASSAGE_DEPTH = 0.2
"""A passage leads at least so much farther than what is free without it, m."""
SHUT = 0.5
"""A passage is shut to a robot that gets no farther than this, m: whoever gets farther looks again from there."""
MARGIN_STEPS = 2
"""Margins that are tried in a passage, from the wider to the narrower."""
PAPER_GAUSSIAN_SAMPLES = 10
"""Width of the paper's Gaussian filter: standard deviation of a quarter of it, so 10 samples hold 95 %."""


@dataclass(frozen=True)
class BearingHits:
    """The nearest hit in each sample of a bearing grid; all arrays have shape (M,).

    Attributes:
        distance: m; infinity where the sample has no hit.
        half_gap: half the chord to the neighbouring hit on the same surface, m.
        offset: how far the hit's bearing may lie from the sample's, rad.
    """

    distance: np.ndarray
    half_gap: np.ndarray
    offset: np.ndarray


class FreeRange(NamedTuple):
    """How far the robot's centre can move straight out; sample 0 is at the first beam.

    Attributes:
        values: shape (M,), m.
        limit: what they could have been at most, 0 where the scan did not look, shape (M,), m.
        margin: the least that was kept beyond the robot's radius, m.
    """

    values: np.ndarray
    limit: np.ndarray
    margin: float


def smoothed_distances(scan: LaserScan, parameters: StarParameters) -> np.ndarray:
    """Ranges with less noise, shape (n,), m; corners and separate surfaces stay as they are."""
    distance = scan.distances
    if parameters.range_clip < scan.range_max:
        distance = np.where(distance > parameters.range_clip, scan.range_max, distance)
    if parameters.smoothing == "moving_average":
        return _moving_average(
            distance, scan.range_max, parameters.smoothing_beams, parameters.smoothing_slack, scan.full_circle
        )
    if parameters.smoothing == "gaussian":
        clipped = np.minimum(distance, parameters.range_clip)
        smooth = gaussian_filter1d(clipped, PAPER_GAUSSIAN_SAMPLES / 4, mode="wrap" if scan.full_circle else "nearest")
        return np.where(distance >= min(scan.range_max, parameters.range_clip), distance, smooth)
    return distance


def half_gaps(scan: LaserScan, distance: np.ndarray) -> np.ndarray:
    """Half the longer chord from each hit to a neighbouring hit of the same surface, shape (n,), m.

    A disc of radius sqrt(R^2 + gap^2) about each hit covers every point within R of the chord between
    connected hits, so that no slit is left between consecutive beams. Beams that say nothing of what stays are skipped.
    """
    return _half_gaps(distance, scan.silent, scan.range_max, scan.angle_increment, scan.full_circle)


def bearing_count(scan: LaserScan, parameters: StarParameters) -> int:
    """Number of samples M: a multiple of the beams of a full-circle scan, so that samples lie on beams."""
    if not scan.full_circle:
        return parameters.bearings
    beams = len(scan.ranges)
    return beams * math.ceil(parameters.bearings / beams)


def scan_hits(scan: LaserScan, distance: np.ndarray, half_gap: np.ndarray, samples: int) -> BearingHits:
    """The scan's hits on a bearing grid whose sample 0 is the first beam; what moves is left out."""
    if scan.motion is not None:
        distance = np.where(scan.moving, scan.range_max, distance)
    return BearingHits(*_scan_to_bearings(distance, half_gap, scan.range_max, scan.angle_increment, samples))


def free_limit(scan: LaserScan, samples: int, looked: float, radius: float, side: float = 0.0) -> np.ndarray:
    """How far the centre of a disc could move at most at each bearing and still end in what was seen, shape (M,), m.

    Args:
        scan: whose field of view counts; outside it the limit is 0.
        samples: M.
        looked: how far the scan looked, m.
        radius: of the disc with its margin, m.
        side: bearings nearer than this to an edge of the field of view count as outside, rad.
    """
    if scan.full_circle:
        first, last = 0.0, 2.0 * math.pi
    else:
        first, last = side, scan.angle_increment * (len(scan.ranges) - 1) + 1e-9 - side
    return _limit(samples, first, last, max(looked - radius, 0.0))


def sight_limit(scan: LaserScan, limit: np.ndarray, radius: float) -> np.ndarray:
    """The limit of `free_limit`, lower where something that moves hides what lies behind it, shape (M,), m.

    Nothing is eroded about such hits: they will have left, and until then whoever moves keeps clear of them otherwise.
    """
    if scan.motion is None or not scan.moving.any():
        return limit
    seen = np.maximum(scan.distances - radius, 0.0)
    return np.minimum(limit, _sight(seen, scan.moving, scan.angle_increment, scan.full_circle, len(limit)))


def point_hits(
    points: np.ndarray, half_gap: np.ndarray, center: np.ndarray, bearing_0: float, reach: float, samples: int
) -> BearingHits:
    """The nearest of many points in each bearing sample as seen from `center`.

    Args:
        points: shape (n, 2), frame W, m.
        half_gap: shape (n,), m, as from `half_gaps`.
        center: shape (2,), frame W, m.
        bearing_0: bearing of sample 0 in W, rad.
        reach: points farther than this are left out, m.
        samples: M.
    """
    return BearingHits(*_points_to_bearings(points, half_gap, center[0], center[1], bearing_0, reach, samples))


def eroded_range(hits: BearingHits, radius: float, limit: np.ndarray) -> np.ndarray:
    """How far the centre of a disc can move straight out at each bearing, shape (M,), m.

    With the hits q_j at distance d_j and bearing theta_j,
        Phi_r(theta) = min_j [ d_j cos(D) - sqrt(R_j^2 - d_j^2 sin^2(D)) ],   D = theta - theta_j,
    over |D| < asin(R_j/d_j), and 0 where d_j <= R_j and |D| <= pi/2. A hit that lies off its sample's bearing
    by at most delta gets R_j + d_j delta. Between two samples the true free range is at least the smaller of both.

    Args:
        hits: on M bearings.
        radius: R, of the disc with its margin, m.
        limit: shape (M,), how far it could at most, as from `free_limit`, m.
    """
    cosine, sine_squared = _tables(len(hits.distance))
    return _erode(hits.distance, hits.half_gap, hits.offset, radius, limit, cosine, sine_squared)


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
def _half_gaps(distance, lost, range_max, increment, wrap):
    n = len(distance)
    out = np.zeros(n)
    for i in range(n):
        steps = 1
        while steps < n and lost[(i + steps) % n]:
            steps += 1
        j = (i + steps) % n
        if lost[i] or (j <= i and not wrap):
            continue
        a, b = distance[i], distance[j]
        if a >= range_max or b >= range_max:
            continue
        cosine = math.cos(steps * increment)
        apart = chord(a, b, cosine)
        if apart < CONNECTED_CHORD:
            out[i] = max(out[i], 0.5 * apart)
            out[j] = max(out[j], 0.5 * apart)
    return out


@njit(cache=True)
def _scan_to_bearings(beam_distance, beam_gap, range_max, increment, samples):
    distance = np.full(samples, np.inf)
    gap = np.zeros(samples)
    offset = np.zeros(samples)
    step = 2.0 * math.pi / samples
    for i in range(len(beam_distance)):
        if beam_distance[i] >= range_max:
            continue
        position = i * increment / step
        k = int(math.floor(position + 0.5))
        delta = abs(position - k) * step
        k %= samples
        distance[k] = min(distance[k], beam_distance[i])
        gap[k] = max(gap[k], beam_gap[i])
        if delta > 1e-9:
            offset[k] = max(offset[k], delta)
    return distance, gap, offset


@njit(cache=True)
def _sight(seen, moving, increment, wrap, samples):
    """What the moving beams saw, for all samples from the beam before to the beam after each."""
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
def _points_to_bearings(points, point_gap, cx, cy, bearing_0, reach, samples):
    distance = np.full(samples, np.inf)
    gap = np.zeros(samples)
    offset = np.zeros(samples)
    step = 2.0 * math.pi / samples
    for i in range(len(points)):
        dx = points[i, 0] - cx
        dy = points[i, 1] - cy
        squared = dx * dx + dy * dy
        if squared > reach * reach:
            continue
        position = (math.atan2(dy, dx) - bearing_0) / step
        nearest = math.floor(position + 0.5)
        k = int(nearest) % samples
        distance[k] = min(distance[k], math.sqrt(squared))
        gap[k] = max(gap[k], point_gap[i])
        offset[k] = max(offset[k], abs(position - nearest) * step)
    return distance, gap, offset


@njit(cache=True)
def _erode(distance, gap, offset, radius, limit, cosine, sine_squared):
    samples = len(distance)
    reach = samples // 4 + 1  # no disc covers more than a quarter turn to either side
    line = np.full(samples + 2 * reach, np.inf)  # the turn unrolled with an overlap, so that inner loops have no seam
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


def free_range(scan: LaserScan, distance: np.ndarray, radius: float, parameters: StarParameters) -> FreeRange:
    """Free range of the robot's centre at every bearing, as the planner uses it.

    It keeps `margin`, and in passages that this would shut as much less as opens them, down to `least_margin`.

    Args:
        scan: in the sensor frame S at the robot's centre.
        distance: shape (n,), the scan's `smoothed_distances`, m.
        radius: of the robot, without margin, m.
        parameters: margin, least_margin, erosion.

    Source: paper, section III-A, with the erosion that it leaves to the controller.
    """
    samples = bearing_count(scan, parameters)
    inflated = radius + parameters.margin
    reach = min(scan.range_max, parameters.range_clip)
    if parameters.erosion == "disc":
        hits = scan_hits(scan, distance, half_gaps(scan, distance), samples)
        limit = free_limit(scan, samples, reach, inflated)
        sight = sight_limit(scan, limit, inflated)
        free, margin = eroded_range(hits, inflated, sight), parameters.margin
        least = min(parameters.least_margin, margin)
        narrowest = eroded_range(hits, radius + least, sight)
        if least < margin and _with_passages(free, narrowest)[1]:
            for step in range(1, MARGIN_STEPS + 1):
                tried = margin + (least - margin) * step / MARGIN_STEPS
                wider = narrowest if step == MARGIN_STEPS else eroded_range(hits, radius + tried, sight)
                free, opened = _with_passages(free, wider)
                margin = tried if opened else margin
        return FreeRange(free, limit, margin)
    shrink = inflated if parameters.erosion == "radial" else 0.0
    beam = np.rint(2.0 * math.pi / samples * np.arange(samples) / scan.angle_increment).astype(int)
    beam = beam % len(distance) if scan.full_circle else np.minimum(beam, len(distance) - 1)
    limit = free_limit(scan, samples, reach, shrink)
    return FreeRange(np.clip(distance[beam] - shrink, 0.0, limit), limit, parameters.margin)


@njit(cache=True)
def _with_passages(free, narrow):
    """The free range with the passages that only a narrower robot sees, and whether there are any.

    A passage is a run of bearings in which the narrower robot gets farther by more than PASSAGE_DEPTH, and the wider
    one nowhere farther than SHUT, nor at either end of the run: the narrower one would only cut a corner there.
    """
    n = len(free)
    out = free.copy()
    deeper = narrow > free + PASSAGE_DEPTH
    opened = False
    start = 0
    while start < n and deeper[start]:
        start += 1
    if start == n:  # all around: the wider robot cannot move at all
        return narrow.copy(), True
    k = start
    while k < start + n:
        if not deeper[k % n]:
            k += 1
            continue
        first = k
        reached = free[(first - 1) % n]
        while deeper[k % n]:
            reached = max(reached, free[k % n])
            k += 1
        reached = max(reached, free[k % n])
        if reached < SHUT:
            opened = True
            for i in range(first, k):
                out[i % n] = narrow[i % n]
    return out, opened
