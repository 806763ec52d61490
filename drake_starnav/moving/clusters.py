"""Clusters of hits that may be of one moving obstacle, and discs that fit them. Lengths are of persons: nature."""

import math

import numpy as np

from drake_starnav.geometry.compiled import kernel
from drake_starnav.lidar.laser_scan import LaserScan
from drake_starnav.moving.surfaces import find_continuing, find_runs, measure_chords

FEWEST_BEAMS = 2
"""Clusters of fewer hits are not tracked."""
PARTING_HEIGHT = 0.08
"""A peak of the range by more than this, m, separates the hits before it from those after it."""
SMALLEST_RADIUS = 0.08
"""Smallest radius of an obstacle, m."""
FIT_ROUNDS = 4
FIT_PRIOR = 0.05
"""Rounds of the fit of a disc to hits, and the weight of the predicted centre in it, in hits."""


def find_clusters(scan: LaserScan, is_doubtful: np.ndarray, may_start: np.ndarray, max_radius: float) -> np.ndarray:
    """Runs of connected hits that may be of one moving obstacle, as from `find_runs`.

    Where two discs touch or overlap, the range has a peak between them: there the run is split. Of a run that is still
    too wide, the hits that certainly stand are left out.

    Args:
        scan: in S.
        is_doubtful, may_start: which of its beams hit what does not certainly stand, or is small enough to move, (n,).
        max_radius: radius of the largest obstacle that moves, m.
    """
    continues_surface = find_continuing(scan, scan.hits)
    runs = split_at_peaks(scan.distances, find_runs((is_doubtful | may_start) & scan.hits, continues_surface))
    too_wide, is_wide = measure_chords(scan, runs) > 2.0 * max_radius, np.zeros(len(is_doubtful), bool)
    for first_beam, beam_count in runs[too_wide].tolist():
        is_wide[(first_beam + np.arange(beam_count)) % len(is_wide)] = True
    parts = split_at_peaks(scan.distances, find_runs(is_doubtful & scan.hits & is_wide, continues_surface))
    clusters = np.vstack((runs[~too_wide], parts[measure_chords(scan, parts) <= 2.0 * max_radius]))
    return clusters[clusters[:, 1] >= FEWEST_BEAMS]


def split_at_peaks(distance: np.ndarray, runs: np.ndarray) -> np.ndarray:
    """Return runs (k, 2), split at the peaks of the range, (n,), m."""
    split_runs, runs_to_split = [], runs[::-1].tolist()
    while runs_to_split:
        first_beam, beam_count = runs_to_split.pop()
        ranges = distance[(first_beam + np.arange(beam_count)) % len(distance)]
        least_before, least_after = np.minimum.accumulate(ranges), np.minimum.accumulate(ranges[::-1])[::-1]
        heights = ranges - np.maximum(least_before, least_after)
        peak = int(heights.argmax())
        if beam_count >= 2 * FEWEST_BEAMS and heights[peak] >= PARTING_HEIGHT:
            runs_to_split.append([(first_beam + peak + 1) % len(distance), beam_count - peak - 1])
            runs_to_split.append([first_beam, peak + 1])
        else:
            split_runs.append([first_beam, beam_count])
    return np.array(split_runs, np.int64).reshape(-1, 2)


@kernel
def estimate_discs(beams, runs, points, sensor_position, max_radius):
    """Return the discs that c clusters show by themselves: centre (c, 2), radius, least range, m, and `is_whole`.

    A disc at least distance d that spans the angle 2 alpha has radius d sin(alpha) / (1 - sin(alpha)). It is whole if
    both its sides are in view: nothing nearer hides them, and they would not be out of the lidar's range.

    Args:
        beams: of a scan taken at `sensor_position`, (x, y), m.
        runs: the clusters, as from `find_clusters`.
        points: where each beam ends, shape (n, 2), m.
        max_radius: greatest radius, m.
    """
    distance, n, c = beams.distances, len(points), len(runs)
    center, radius, least_range, is_whole = np.empty((c, 2)), np.empty(c), np.full(c, np.inf), np.empty(c, np.bool_)
    for k in range(c):
        first_beam, beam_count = runs[k]
        for beam in range(first_beam, first_beam + beam_count):
            least_range[k] = min(least_range[k], distance[beam % n])
        sine = min(math.sin(min(0.5 * beam_count * beams.increment, 1.2)), 0.85)
        radius[k] = min(max(least_range[k] * sine / (1.0 - sine), SMALLEST_RADIUS), max_radius)
        middle_hit = points[(first_beam + (beam_count - 1) // 2) % n]
        other_middle_hit = points[(first_beam + beam_count // 2) % n]
        sight_x = middle_hit[0] + other_middle_hit[0] - 2.0 * sensor_position[0]
        sight_y = middle_hit[1] + other_middle_hit[1] - 2.0 * sensor_position[1]
        sight_length = max(math.hypot(sight_x, sight_y), 1e-9)
        center[k, 0] = sensor_position[0] + (least_range[k] + radius[k]) * (sight_x / sight_length)
        center[k, 1] = sensor_position[1] + (least_range[k] + radius[k]) * (sight_y / sight_length)
        last_beam = (first_beam + beam_count - 1) % n
        is_bare = distance[(first_beam - 1) % n] > distance[first_beam]
        is_bare = is_bare and distance[(first_beam + beam_count) % n] > distance[last_beam]
        is_whole[k] = is_bare and least_range[k] + radius[k] < beams.range_max
    return center, radius, least_range, is_whole


@kernel
def fit_radius(points, start_center, radius, weight):
    """The radius of the disc that fits points on its boundary, by Gauss-Newton from a centre and a radius.

    The start counts as much as FIT_PRIOR hits, the radius as much as `weight` of them: a short arc says little.
    """
    x, y, r = start_center[0], start_center[1], radius
    normal, right_side, row = np.empty((3, 3)), np.empty(3), np.empty(3)
    for _ in range(FIT_ROUNDS):
        normal[:] = 0.0
        normal[0, 0], normal[1, 1], normal[2, 2] = FIT_PRIOR, FIT_PRIOR, weight
        right_side[0], right_side[1] = FIT_PRIOR * (start_center[0] - x), FIT_PRIOR * (start_center[1] - y)
        right_side[2] = weight * (radius - r)
        for k in range(len(points)):
            dx, dy = x - points[k, 0], y - points[k, 1]
            distance = max(math.hypot(dx, dy), 1e-6)
            row[0], row[1], row[2] = dx / distance, dy / distance, -1.0
            for i in range(3):
                right_side[i] -= (distance - r) * row[i]
                for j in range(3):
                    normal[i, j] += row[i] * row[j]
        step = np.linalg.solve(normal, right_side)
        x, y, r = x + step[0], y + step[1], r + step[2]
    return r


@kernel
def fit_center(points, start_center, radius):
    """The centre of the disc of some radius that fits points on its boundary, by Gauss-Newton from `start_center`."""
    x, y = start_center[0], start_center[1]
    for _ in range(FIT_ROUNDS):
        a = b = 0.0
        c = d = FIT_PRIOR
        e = 0.0
        a += FIT_PRIOR * (start_center[0] - x)
        b += FIT_PRIOR * (start_center[1] - y)
        for k in range(len(points)):
            dx, dy = x - points[k, 0], y - points[k, 1]
            distance = max(math.hypot(dx, dy), 1e-6)
            ux, uy = dx / distance, dy / distance
            c += ux * ux
            d += uy * uy
            e += ux * uy
            a -= ux * (distance - radius)
            b -= uy * (distance - radius)
        det = c * d - e * e
        x += (d * a - e * b) / det
        y += (c * b - e * a) / det
    return np.array((x, y))
