"""Places that a scan shows to be impassable: its hits, and gaps between them that are too narrow for the robot."""

import itertools
import math

import numpy as np

from drake_starnav.geometry.compiled import kernel
from drake_starnav.lidar.laser_scan import MAPPABLE, place_ends
from drake_starnav.surroundings.erosion import smooth_distances
from drake_starnav.surroundings.margins import Margins
from drake_starnav.surroundings.observation import Observation

BRIDGE_SPACING = 0.2
"""Spacing of the points between two hits that the robot does not fit between, as a share of its diameter."""


def bridge_observed_hits(observation: Observation, margins: Margins, cover_radius: float) -> np.ndarray:
    """Return hits, and points between neighbouring hits that are closer than the robot's diameter; shape (n, 2).

    In W, m. A wall seen at a grazing angle thus remains closed although its hits are far apart. Only beams that
    are MAPPABLE count.

    Args:
        observation: the scan and its pose.
        margins: how the ranges are smoothed.
        cover_radius: m.
    """
    x, y, yaw = observation.pose
    distance = smooth_distances(observation.scan, margins.smoothing_slack)
    return bridge_hits(observation.scan.beams, distance, (x, y, math.cos(yaw), math.sin(yaw)), 2.0 * cover_radius)


@kernel
def bridge_hits(beams, distance, frame, diameter):
    """As `bridge_observed_hits`, of distances along some `Beams` of a lidar with the frame (x, y, cosine and sine of
    its yaw)."""
    (x, y, cosine, sine), spacing = frame, BRIDGE_SPACING * diameter
    mappable, wrap = beams.kinds & MAPPABLE != 0, beams.seam < np.inf
    points = place_ends(beams.directions, distance, mappable, x, y, cosine, sine)
    hit = distance[mappable] < beams.range_max
    count = len(points)
    parts = np.zeros(count, np.int64)  # of the chord from each hit to the next
    wide = np.empty(count, np.int64)  # hits from which a chord has more than one part
    hits = chords = between = 0
    for i in range(count):
        if hit[i]:
            hits += 1
            j = i + 1 if i + 1 < count else 0
            if hit[j] and (j > 0 or wrap):
                dx, dy = points[j, 0] - points[i, 0], points[j, 1] - points[i, 1]
                chord = math.sqrt(dx * dx + dy * dy)
                if spacing < chord < diameter:
                    parts[i] = math.ceil(chord / spacing)
                    between += parts[i] - 1
                    wide[chords] = i
                    chords += 1
    bridged_points = np.empty((hits + between, 2))
    n = 0
    for i in range(count):  # all hits first, then the first point of each chord, and so on
        if hit[i]:
            bridged_points[n, 0], bridged_points[n, 1] = points[i, 0], points[i, 1]
            n += 1
    k = 1
    while n < len(bridged_points):
        for i in wide[:chords]:
            if k < parts[i]:
                j = i + 1 if i + 1 < count else 0
                share = k / parts[i]
                bridged_points[n, 0] = points[i, 0] + (points[j, 0] - points[i, 0]) * share
                bridged_points[n, 1] = points[i, 1] + (points[j, 1] - points[i, 1]) * share
                n += 1
        k += 1
    return bridged_points


def find_narrowest_gap(points: np.ndarray, way: np.ndarray, widest_gap: float) -> np.ndarray | None:
    """Return the two of some points (n, 2), shape (2, 2), that are nearest to each other across a way (k, 2).

    None if no two on both sides of the way are nearer than `widest_gap`. All in m, in one frame.
    """
    nearest, least_squared = None, widest_gap * widest_gap
    for start, end in itertools.pairwise(way):
        is_around = (points > np.minimum(start, end) - widest_gap) & (points < np.maximum(start, end) + widest_gap)
        close = points[is_around.all(axis=1)]
        (along_x, along_y), (x, y) = end - start, (close - start).T
        is_left = along_x * y - along_y * x > 0.0
        ours, theirs = close[is_left], close[~is_left]
        to_x, to_y = (theirs[None, :] - ours[:, None]).transpose(2, 0, 1)
        across = _turns_left(to_x, to_y, start - ours) != _turns_left(to_x, to_y, end - ours)
        squared = np.where(across, to_x * to_x + to_y * to_y, np.inf)
        if squared.size and squared.min() < least_squared:
            i, j = divmod(int(squared.argmin()), len(theirs))
            nearest, least_squared = np.stack((ours[i], theirs[j])), float(squared[i, j])
    return nearest


def _turns_left(to_x: np.ndarray, to_y: np.ndarray, to_end: np.ndarray) -> np.ndarray:
    """Return whether a way's end, seen from points (n, 2), lies left of the lines to others (n, m)."""
    return to_x * to_end[:, 1:] - to_y * to_end[:, :1] > 0.0
