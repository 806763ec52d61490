"""From a laser scan to the free range of the robot's centre: erosion by the robot's disc in polar coordinates.

For the bearing grid see `bearing_hits`.
"""

import math
from functools import lru_cache
from typing import NamedTuple

import numpy as np

from drake_starnav.geometry.compiled import find_largest, kernel
from drake_starnav.lidar.field_of_view import TURN
from drake_starnav.lidar.laser_scan import LOST, MOVING, Beams, LaserScan
from drake_starnav.surroundings.bearing_hits import convert_beams_to_bearings, measure_half_chords
from drake_starnav.surroundings.margins import Margins
from drake_starnav.surroundings.passages import MARGIN_STEPS, PASSAGE_DEPTH, SHUT, add_passages
from drake_starnav.surroundings.piecewise_cubic import JUMP

BEARINGS = 720
"""Samples of a region's boundary, rounded up to whole samples a beam: 20 mm apart at 2.3 m; rays of a merged scan."""
SMOOTHING_BEAMS = 3
"""Half width of the moving average over the planner's ranges, in beams."""
SAME_SURFACE = 0.16
"""Ranges that differ by no more than this belong to one surface, in radii of the body: for 0.25 m four standard
deviations of 1 cm. A smoothed range that differs by more from the measured one is rejected."""


class FreeRange(NamedTuple):
    """Distance that the robot's centre can move along each bearing; sample 0 is at the first beam.

    Attributes:
        values: shape (M,), m.
        limit: upper bounds of the values, 0 outside the field of view, shape (M,), m.
        margin: smallest clearance kept beyond the robot's radius, m.
        radius: of the robot, m.
    """

    values: np.ndarray
    limit: np.ndarray
    margin: float
    radius: float


class DiscInView(NamedTuple):
    """A disc that moves within what a scan saw, for compiled functions.

    Attributes:
        beams: of the scan.
        limit: as of `compute_free_limit`, shape (M,), m.
        radius: of the disc without margin, m.
        margins: margin and least margin, m.
        tables: as of `make_bearing_tables`.
        is_merged: whether the scan is `merged`: what is unknown then ends rays, but is no wall.
    """

    beams: Beams
    limit: np.ndarray
    radius: float
    margins: tuple[float, float]
    tables: tuple[np.ndarray, np.ndarray]
    is_merged: bool

    @staticmethod
    def of(
        scan: LaserScan,
        radius: float,
        margins: tuple[float, float] = (0.0, 0.0),
        reach: float = math.inf,
        samples: int = 0,
    ) -> "DiscInView":
        """Return one that moves up to `reach`, m, with `samples` M; 0: as many as suit the scan."""
        samples, reach_of_disc = samples or count_bearings(scan), radius + margins[0]
        limit = compute_free_limit(
            find_field_of_view(scan), samples, max(min(scan.range_max, reach + reach_of_disc) - reach_of_disc, 0.0)
        )
        return DiscInView(scan.beams, limit, radius, margins, make_bearing_tables(samples), scan.merged)


def smooth_distances(scan: LaserScan, slack: float = 0.0, beams: int = SMOOTHING_BEAMS) -> np.ndarray:
    """Return smoothed ranges, shape (n,), m; corners and separate surfaces are preserved.

    Args:
        scan: the ranges.
        slack: additional range step within a surface, and additional change, m.
        beams: half width of the moving average.
    """
    return average_neighbours(scan.beams, beams, slack)


def count_bearings(scan: LaserScan) -> int:
    """Return the number of samples M: a multiple of the steps of a full-circle scan, so that samples lie on beams."""
    if not scan.full_circle:
        return BEARINGS
    steps = round(TURN / scan.angle_increment)
    return steps * math.ceil(BEARINGS / steps)


@lru_cache(maxsize=16)
def compute_free_limit(view: tuple[float, float], samples: int, farthest: float) -> np.ndarray:
    """Return how far a disc's centre can move at most, shape (M,), m: `farthest`, and 0 outside the field of view."""
    bearing = 2.0 * math.pi / samples * np.arange(samples)
    return np.where((view[0] <= bearing) & (bearing <= view[1]), farthest, 0.0)


def find_field_of_view(scan: LaserScan) -> tuple[float, float]:
    """Return the first and last bearing from the first beam on, rad."""
    return (0.0, TURN) if scan.full_circle else (0.0, scan.field_of_view.span + 1e-9)


def compute_free_range(
    scan: LaserScan, distance: np.ndarray, radius: float, margins: Margins, samples: int = 0
) -> FreeRange:
    """Return the free range of the robot's centre at every bearing, as the planner uses it.

    The clearance is `preferred`. Passages that it would close get a smaller one, down to `least`.

    Args:
        scan: in the sensor frame S at the robot's centre.
        distance: shape (n,), the scan's `smooth_distances`, m.
        radius: of the robot, without margin, m.
        margins: preferred and least.
        samples: M; 0: as many as suit the scan.

    Source: this project; in the paper the radius enters with Eq. (15) only.
    """
    disc = DiscInView.of(scan, radius, (margins.preferred, margins.least), samples=samples)
    values, limit, margin = compute_disc_range(distance, disc)
    return FreeRange(values, limit, margin, radius)


@lru_cache(maxsize=16)
def make_bearing_tables(samples: int) -> tuple[np.ndarray, np.ndarray]:
    """Return cos and sin^2 of every difference of two bearings."""
    angle = 2.0 * math.pi / samples * np.arange(samples)
    return np.cos(angle), np.sin(angle) ** 2


@kernel
def compute_disc_range(distance, disc):
    """Return values, limit and margin of a `FreeRange` for smoothed distances (n,), m, and a `DiscInView`."""
    beams, limit, radius, (cosine, squares) = disc.beams, disc.limit, disc.radius, disc.tables
    margin, least = disc.margins
    samples, inflated_radius, shut = len(cosine), radius + margin, SHUT * radius
    if disc.is_merged and samples == len(distance):
        limit, distance = limit.copy(), distance.copy()
        for i in range(samples):
            if beams.kinds[i] & LOST:
                limit[i] = min(limit[i], max(distance[i] - inflated_radius, 0.0))
                distance[i] = beams.range_max
    gap = measure_half_chords(distance, beams)
    hits = convert_beams_to_bearings(distance, gap, beams, samples)
    sight = limit_by_moving_obstacles(limit, beams, inflated_radius)
    free_range = erode(hits[0], hits[1], hits[2], inflated_radius, sight, cosine, squares)
    # First test whether the least margin opens any passage at all; it rarely does.
    tested_range = np.zeros(samples)
    for i in range(samples):
        if free_range[i] < shut:
            tested_range[i] = min(sight[i], shut + 2.0 * PASSAGE_DEPTH * radius)
    if least >= margin or find_largest(tested_range) == 0.0:
        return free_range, limit, margin
    narrowest = erode(hits[0], hits[1], hits[2], radius + least, tested_range, cosine, squares)
    if not add_passages(free_range, narrowest, radius)[1]:
        return free_range, limit, margin
    least_margin = margin
    for step in range(1, MARGIN_STEPS + 1):
        tried_margin = margin + (least - margin) * step / MARGIN_STEPS
        narrow = erode(hits[0], hits[1], hits[2], radius + tried_margin, sight, cosine, squares)
        free_range, has_passages = add_passages(free_range, narrow, radius)
        if has_passages:
            least_margin = tried_margin
    return free_range, limit, least_margin


@kernel
def average_neighbours(beams, half_width, slack):
    """Return the loop of `smooth_distances`: of some `Beams`, over `half_width` of them to each side."""
    distance, range_max, wrap = beams.distances, beams.range_max, beams.seam < np.inf
    n = len(distance)
    jump, limit = JUMP * beams.cover_radius + slack, SAME_SURFACE * beams.cover_radius + slack
    smoothed_distance = distance.copy()
    for i in range(n):
        if distance[i] >= range_max:
            continue
        width = min(half_width, (n - 1) // 2) if wrap else min(half_width, i, n - 1 - i)
        distance_sum = beams_before = beams_after = distance[i]
        count = 0
        for k in range(1, width + 1):  # grow a symmetric window while both sides stay on the surface
            a = distance[i - k]  # a negative index counts from the end
            b = distance[i + k if i + k < n else i + k - n]
            if a >= range_max or b >= range_max:
                break
            if abs(a - beams_before) > jump or abs(b - beams_after) > jump:
                break
            distance_sum += a + b
            beams_before, beams_after = a, b
            count = k
        mean_distance = distance_sum / (2 * count + 1)
        if abs(mean_distance - distance[i]) < limit:
            smoothed_distance[i] = mean_distance
    return smoothed_distance


@kernel
def limit_by_moving_obstacles(limit, beams, radius):
    """Return a free limit (M,), m, reduced where a moving obstacle occludes space, by some `Beams`.

    It occludes from the beam before to the beam after each that hit it. Such hits are not eroded: the obstacle will
    have left, and until then obstacle avoidance keeps clear of it.
    """
    distance, kinds, increment, seam = beams.distances, beams.kinds, beams.increment, beams.seam
    samples, count = len(limit), len(distance)
    wrap = seam < np.inf
    limited_range = limit.copy()
    sample_angle = 2.0 * math.pi / samples
    for i in range(len(distance)):
        if kinds[i] & MOVING:
            seen_range = max(distance[i] - radius, 0.0)
            bearing_before, bearing_after = (i - 1) * increment, (i + 1) * increment
            if wrap and seam != increment:
                bearing_before = -seam if i == 0 else bearing_before
                bearing_after = i * increment + seam if i == count - 1 else bearing_after
            first_sample = int(math.ceil(bearing_before / sample_angle))
            last_sample = int(math.floor(bearing_after / sample_angle))
            for k in range(first_sample, last_sample + 1):
                if wrap or 0 <= k < samples:
                    limited_range[k % samples] = min(limited_range[k % samples], seen_range)
    return limited_range


@kernel
def erode(distance, gap, offset, radius, limit, cosine, sine_squared):
    """Return the distance that a disc's centre can move along each bearing, shape (M,), m.

    With the hits q_j at distance d_j and bearing theta_j,
        Phi_r(theta) = min_j [ d_j cos(D) - sqrt(R_j^2 - d_j^2 sin^2(D)) ],   D = theta - theta_j,
    over |D| < asin(R_j/d_j), and 0 where d_j <= R_j and |D| <= pi/2. A hit that lies off its sample's bearing
    by at most delta gets R_j + d_j delta. Between two samples the true free range is at least the smaller of both.

    Args:
        distance, gap, offset: of the hits on M bearings, as from `convert_points_to_bearings`.
        radius: R, of the disc with its margin, m.
        limit: shape (M,), upper bound, as from `compute_free_limit`, m.
        cosine, sine_squared: as of `make_bearing_tables`.
    """
    samples = len(distance)
    quarter = samples // 4  # no disc covers more than a quarter turn to either side
    padding = quarter + 1
    # The full turn with an overlap, so that inner loops need no wrap-around; `mirrored_line` runs clockwise. Loops get
    # vectorized that run over slices from 0 on.
    line, mirrored_line = np.full(samples + 2 * padding, np.inf), np.full(samples + 2 * padding, np.inf)
    farthest = find_largest(limit)
    half_width = 0  # samples that the disc covers to either side: neighbouring hits differ little
    for j in range(samples):
        d = distance[j]
        if d == np.inf:
            continue
        inflated_radius = radius + d * offset[j]
        if d - inflated_radius - gap[j] >= farthest:
            continue
        squared = inflated_radius * inflated_radius + gap[j] * gap[j]
        center = j + padding
        if d * d <= squared:
            line[center - quarter : center + quarter + 1] = 0.0
            continue
        d_squared = d * d
        while half_width < quarter and d_squared * sine_squared[half_width + 1] <= squared:
            half_width += 1
        while d_squared * sine_squared[half_width] > squared:
            half_width -= 1
        left_window = line[center : center + half_width + 1]
        right_window = mirrored_line[-1 - center + len(line) :][: half_width + 1]
        for i in range(half_width + 1):
            entry = d * cosine[i] - math.sqrt(squared - d_squared * sine_squared[i])
            left_window[i], right_window[i] = min(left_window[i], entry), min(right_window[i], entry)
    line, free_range = np.minimum(line, mirrored_line[::-1]), limit.copy()
    for i in range(samples):
        free_range[i] = min(free_range[i], line[padding + i])
    for i in range(padding):
        free_range[i] = min(free_range[i], line[padding + samples + i])
        free_range[samples - padding + i] = min(free_range[samples - padding + i], line[i])
    return free_range
