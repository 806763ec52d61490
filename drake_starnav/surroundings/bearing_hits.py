"""The nearest hits on a bearing grid, from one scan or from points in the plane.

A bearing grid of M samples covers the full turn, sample i at bearing `bearing_0 + 2 pi i / M`.
"""

import math

import numpy as np

from drake_starnav.geometry.compiled import kernel
from drake_starnav.geometry.polyline import compute_third_side
from drake_starnav.lidar.laser_scan import LOST, MOVING

CONNECTED_CHORD = 0.6
"""Neighbouring hits nearer than this belong to one surface, in cover radii: no robot fits between them."""


@kernel
def measure_half_chords(distance, beams):
    """Return half the longer chord from each hit to a neighbouring hit of the same surface, shape (n,), m.

    A disc of radius sqrt(R^2 + gap^2) about each hit covers every point within R of the chord between
    connected hits, so that no slit is left between consecutive beams. Beams that carry no information about static
    obstacles are skipped. Distances, shape (n,), m, are along some `Beams`.
    """
    n, silent = len(distance), beams.kinds & (MOVING | LOST) != 0
    range_max, increment, seam = beams.range_max, beams.increment, beams.seam
    connected_chord = CONNECTED_CHORD * beams.cover_radius
    half_chords = np.zeros(n)
    neighbouring = math.cos(increment)
    for i in range(n):
        if silent[i]:
            continue
        steps, j = 1, i + 1 if i + 1 < n else 0
        while steps < n and silent[j]:
            steps, j = steps + 1, j + 1 if j + 1 < n else 0
        if j <= i and seam == np.inf:
            continue
        a, b = distance[i], distance[j]
        if a >= range_max or b >= range_max:
            continue
        angle = steps * increment if j > i else (steps - 1) * increment + seam
        length = compute_third_side(a, b, neighbouring if angle == increment else math.cos(angle))
        if length < connected_chord:
            half_chords[i] = max(half_chords[i], 0.5 * length)
            half_chords[j] = max(half_chords[j], 0.5 * length)
    return half_chords


@kernel
def convert_beams_to_bearings(beam_distance, beam_gap, beams, samples):
    """Return the nearest hit in each sample of a bearing grid, of distances and half chords along some `Beams`.

    Sample 0 is at the first beam. Hits on moving obstacles are skipped; a lost beam counts as a hit at
    its bound.

    Returns:
        Its distance, m, infinity without a hit; half the chord to the neighbouring hit on the same surface, m; and the
        largest difference between the bearings of a hit and its sample, rad; all of shape (samples,).
    """
    kinds, range_max, increment = beams.kinds, beams.range_max, beams.increment
    distance = np.full(samples, np.inf)
    gap = np.zeros(samples)
    offset = np.zeros(samples)
    sample_angle = 2.0 * math.pi / samples
    for i in range(len(beam_distance)):
        if kinds[i] & MOVING or beam_distance[i] >= range_max:
            continue
        position = i * increment / sample_angle
        k = int(math.floor(position + 0.5))
        delta = abs(position - k) * sample_angle
        k %= samples
        distance[k] = min(distance[k], beam_distance[i])
        gap[k] = max(gap[k], beam_gap[i])
        if delta > 1e-9:
            offset[k] = max(offset[k], delta)
    return distance, gap, offset


@kernel
def convert_points_to_bearings(points, point_gap, cx, cy, bearing_0, reach, samples):
    """Return the nearest of points (n, 2) in W with half chords (n,), m, in each sample, seen from (cx, cy).

    The samples begin at `bearing_0`; distances, half chords and offsets are as of `convert_beams_to_bearings`.

    Points farther than `reach` (m) are left out.
    """
    distance = np.full(samples, np.inf)
    gap = np.zeros(samples)
    offset = np.zeros(samples)
    sample_angle = 2.0 * math.pi / samples
    for i in range(len(points)):
        dx = points[i, 0] - cx
        dy = points[i, 1] - cy
        squared = dx * dx + dy * dy
        if squared > reach * reach:
            continue
        position = (math.atan2(dy, dx) - bearing_0) / sample_angle
        nearest = math.floor(position + 0.5)
        k = int(nearest) % samples
        distance[k] = min(distance[k], math.sqrt(squared))
        gap[k] = max(gap[k], point_gap[i])
        offset[k] = max(offset[k], abs(position - nearest) * sample_angle)
    return distance, gap, offset
