"""Surfaces too large to move: the scan is split into convex surfaces, and the width of each is measured.

A disc shows the lidar one convex arc. Connected hits are therefore split wherever their outline has a notch: where a
disc stands against a wall, in the corner of a room, between two discs. The outline is the polygon that the
Douglas-Peucker algorithm leaves of the hits; they run counter-clockwise about the robot, so that a notch is where it
turns to the left. A surface wider than the largest dynamic obstacle is static. Lengths are of persons: nature.
"""

import math

import numpy as np

from drake_starnav.geometry.compiled import kernel
from drake_starnav.geometry.polyline import compute_third_side, square_segment_distance
from drake_starnav.lidar.laser_scan import LaserScan

CONNECTED_WITHIN = 0.15
CONNECTED_PER_RANGE = 0.05
"""Consecutive hits are on one surface if nearer than this, m, or this share of their range."""
FLATNESS = 0.05
NOISES = 5.0
"""A notch of less than this between two things is not seen, m; nor one of less than this many standard deviations of
the range error."""
WIDEST_SPACING = 0.05
"""Farther than where two beams are this far apart, m, nothing is known to be large: the notches between discs of 0.15 m
or more that stand side by side, seen from any side, show only nearer than that."""


def find_large_surfaces(scan: LaserScan, width: float, range_deviation: float) -> np.ndarray:
    """Which hits of a scan in S are on a convex surface that is wider than `width`, m, shape (n,), bool.

    Lost beams do not split surfaces. The declared standard deviation of the range error, m, counts: that of the scan
    itself is no measure, as the rims of discs side by side bend as much as a noisy wall.
    """
    notch_depth = max(FLATNESS, NOISES * range_deviation)
    valid_beams = np.flatnonzero(~scan.lost)
    on_large_surface, distance, n = np.zeros(len(scan.ranges), bool), scan.distances[valid_beams], len(valid_beams)
    is_hit = (scan.ranges[valid_beams] < scan.range_max) & (distance * scan.angle_increment <= WIDEST_SPACING)
    end_points = distance[:, None] * scan.beams.directions[valid_beams]
    bearings = scan.bearings[valid_beams]
    continues_surface = _find_continuing(distance, is_hit, np.cos(bearings - np.roll(bearings, 1)), scan.full_circle)
    for first_beam, beam_count in find_runs(is_hit, continues_surface).tolist():
        if beam_count == n and continues_surface[first_beam]:
            first_beam = int(np.argmax(distance))  # what is all around is cut at its farthest corner
        run_beams = (first_beam + np.arange(beam_count)) % n
        on_large_surface[valid_beams[run_beams]] = _find_wide_surface(end_points[run_beams], width, notch_depth)
    return on_large_surface


def find_continuing(scan: LaserScan, is_hit: np.ndarray) -> np.ndarray:
    """Return which beams, of those that hit (n,), hit the surface that the beam before has hit, shape (n,), bool."""
    return _find_continuing(scan.distances, is_hit, math.cos(scan.angle_increment), scan.full_circle)


def _find_continuing(
    distance: np.ndarray, is_hit: np.ndarray, cosine: np.ndarray | float, is_full_circle: bool
) -> np.ndarray:
    """Do the same for distances (n,), m, with the cosine of the angle between each beam and the one before."""
    previous_distance = np.roll(distance, 1)
    farthest = np.maximum(CONNECTED_WITHIN, CONNECTED_PER_RANGE * np.minimum(previous_distance, distance))
    is_near = compute_third_side(previous_distance, distance, cosine) <= farthest
    continues_surface = is_near & is_hit & np.roll(is_hit, 1)
    continues_surface[:1] &= is_full_circle
    return continues_surface


def find_runs(is_chosen: np.ndarray, continues_surface: np.ndarray) -> np.ndarray:
    """Return runs of `is_chosen` beams (n,) of which each continues the one before, as from `find_continuing`.

    Returns:
        The first beam of each and how many they are, shape (k, 2); after the last beam of a scan comes the first.
    """
    n, continues_run = len(is_chosen), continues_surface & is_chosen & np.roll(is_chosen, 1)
    if n and continues_run.all():  # one all around
        return np.array(((0, n),))
    first_beams = np.flatnonzero(is_chosen & ~continues_run)
    last_beams = np.flatnonzero(is_chosen & ~np.roll(continues_run, -1))
    if len(last_beams) and last_beams[0] < first_beams[0]:
        last_beams = np.roll(last_beams, -1)
    return np.column_stack((first_beams, (last_beams - first_beams) % max(n, 1) + 1))


def measure_chords(scan: LaserScan, runs: np.ndarray) -> np.ndarray:
    """Return the distances between the first and the last hit of runs of beams (k, 2), shape (k,), m."""
    first_beams, beam_counts = runs.T
    last_beams = (first_beams + beam_counts - 1) % len(scan.ranges)
    cosines = np.array([math.cos(steps * scan.angle_increment) for steps in (beam_counts - 1).tolist()])
    return compute_third_side(scan.distances[first_beams], scan.distances[last_beams], cosines)


def _find_wide_surface(points: np.ndarray, width: float, notch_depth: float) -> np.ndarray:
    """Return which of some connected hits, points (k, 2), are on a wide convex surface, shape (k,), bool."""
    is_wide, corners = np.zeros(len(points), bool), find_corners(points, notch_depth)
    begin = 0  # index of the corner that the present surface begins at
    for i in range(1, len(corners)):
        if i < len(corners) - 1:
            point = points[corners[i]]
            into, onward = point - points[corners[i - 1]], points[corners[i + 1]] - point
            if into[0] * onward[1] - into[1] * onward[0] <= 0.0:
                continue
        # a hit at a notch may be the neighbour's, across a step
        surface = points[corners[begin] + (begin > 0) : corners[i] + (i == len(corners) - 1)]
        if is_wider(surface, width):
            is_wide[corners[begin] : corners[i] + 1] = True
        begin = i
    return is_wide


@kernel
def find_corners(points, tolerance):
    """Indices of the corners that the algorithm of Douglas and Peucker leaves of a polyline (k, 2)."""
    is_corner, waiting = np.zeros(len(points), np.bool_), [(0, len(points) - 1)]
    is_corner[0] = is_corner[-1] = True
    while waiting:
        first_point, last_point = waiting.pop()
        ax, ay = points[first_point]
        bx, by = points[last_point]
        farthest = tolerance * tolerance
        farthest_point = -1
        for k in range(first_point + 1, last_point):
            squared_distance = square_segment_distance(points[k, 0], points[k, 1], ax, ay, bx, by)
            if squared_distance > farthest:
                farthest, farthest_point = squared_distance, k
        if farthest_point >= 0:
            is_corner[farthest_point] = True
            waiting.append((first_point, farthest_point))
            waiting.append((farthest_point, last_point))
    return np.flatnonzero(is_corner)


@kernel
def is_wider(points, width):
    """Whether two of some points (k, 2) are farther apart than `width`, m."""
    for i in range(len(points)):
        for j in range(i):
            if (points[i, 0] - points[j, 0]) ** 2 + (points[i, 1] - points[j, 1]) ** 2 > width * width:
                return True
    return False
