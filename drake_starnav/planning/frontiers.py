"""Frontiers are gaps: runs of the boundary of a region beyond which nothing is known that stops the robot."""

import math
from typing import NamedTuple

import numpy as np

from drake_starnav.geometry.compiled import kernel
from drake_starnav.geometry.polyline import measure_arc_lengths
from drake_starnav.planning.closed_places import CLOSURE_RADIUS
from drake_starnav.planning.grid import HIT_ERROR, measure_distance_at
from drake_starnav.planning.roadmap import StarRoadmap
from drake_starnav.surroundings.region_union import RegionUnion, find_cover

STEP, BEYOND, COVER_SLACK, LEAST = 0.4, 0.4, 0.2, 0.8
"""In radii of the robot: largest step along a boundary; how far beyond it a probe tells whether it is open; up to which
distance from a region a probe counts as covered; and the shortest run that is no noise."""


class Gap(NamedTuple):
    """A frontier.

    Attributes:
        line: shape (k, 2), points along the boundary, W, m.
        probe: shape (k, 2), the places beyond them, in the unknown, W, m.
    """

    line: np.ndarray
    probe: np.ndarray


def find_gaps(roadmap: StarRoadmap, robot_radius: float, owner: int) -> list[Gap]:
    """Return the gaps of one region: where no region, no hit and no closure is beyond its boundary.

    Args:
        roadmap: with the region.
        robot_radius: m.
        owner: index of the region.
    """
    line, probe, is_open = _sample_boundary(
        roadmap.union, owner, roadmap.closures.failed, roadmap.grid.arrays, robot_radius
    )
    first = int(np.argmin(is_open))  # no run goes on from the last point to the first
    line, probe, is_open = (np.roll(each, -first, axis=0) for each in (line, probe, is_open))
    gap_ends = np.flatnonzero(np.diff(np.concatenate(([0], is_open.astype(np.int8), [0])))).reshape(-1, 2)
    first, last = measure_arc_lengths(line)[gap_ends - (0, 1)].T
    return [Gap(line[a:b], probe[a:b]) for a, b in gap_ends[last - first >= LEAST * robot_radius].tolist()]


def find_all_gaps(roadmap: StarRoadmap, robot_radius: float) -> list[Gap]:
    """Return the gaps of all regions; arguments as for `find_gaps`."""
    return [gap for owner in range(len(roadmap)) for gap in find_gaps(roadmap, robot_radius, owner)]


@kernel
def _sample_boundary(union: RegionUnion, owner, closures, hits, radius):
    """Return points along a region's boundary (n, 2), the places beyond them (n, 2), whether these are open (n,)."""
    center, bearing_0, values = union.center[owner], union.bearing_0[owner], union.values[owner]
    samples, probe_distance, count = len(values), BEYOND * radius, 0
    step = 2.0 * math.pi / samples
    corners = np.empty((samples + 1, 2))
    parts = np.empty(samples, np.int64)
    for i in range(samples + 1):
        bearing = bearing_0 + step * i
        corners[i, 0] = center[0] + values[i % samples] * math.cos(bearing)
        corners[i, 1] = center[1] + values[i % samples] * math.sin(bearing)
    for i in range(samples):
        length = math.hypot(corners[i + 1, 0] - corners[i, 0], corners[i + 1, 1] - corners[i, 1])
        parts[i] = max(int(math.ceil(length / (STEP * radius))), 1)
        count += parts[i]
    line, probe, is_open = np.empty((count, 2)), np.empty((count, 2)), np.empty(count, np.bool_)
    n = 0
    for i in range(samples):
        dx, dy = corners[i + 1, 0] - corners[i, 0], corners[i + 1, 1] - corners[i, 1]
        length = max(math.hypot(dx, dy), 1e-9)
        for k in range(parts[i]):
            share = (k + 0.5) / parts[i]
            x, y = corners[i, 0] + share * dx, corners[i, 1] + share * dy
            u, v = x + probe_distance * dy / length, y - probe_distance * dx / length
            line[n, 0], line[n, 1], probe[n, 0], probe[n, 1] = x, y, u, v
            is_open[n] = measure_distance_at(hits, u, v) > radius - HIT_ERROR * radius
            for j in range(len(closures)):
                is_open[n] &= math.hypot(u - closures[j, 0], v - closures[j, 1]) > CLOSURE_RADIUS * radius
            is_open[n] = is_open[n] and find_cover(union, u, v, COVER_SLACK * radius) < 0
            n += 1
    return line, probe, is_open
