"""Frontiers: runs of the boundary of a region beyond which nothing is known that stops the robot.

The exit of a route is one of their points: where the path leaves the regions.
"""

import math
from typing import NamedTuple

import numpy as np

from drake_starnav.geometry.compiled import kernel
from drake_starnav.geometry.polyline import measure_arc_lengths
from drake_starnav.planning.grid import HIT_ERROR, measure_distance_at
from drake_starnav.planning.roadmap import CLOSURE_RADIUS, StarRoadmap
from drake_starnav.surroundings.region_union import RegionUnion, find_covering_region

STEP, BEYOND, COVER_SLACK, LEAST = 0.4, 0.4, 0.2, 0.8
"""In radii of the robot: largest step along a boundary; how far beyond it a probe tells whether it is open; up to which
distance from a region a probe counts as covered; and the shortest run that is no noise."""


class Frontier(NamedTuple):
    """An open run of the boundary of a region.

    Attributes:
        boundary: shape (k, 2), points along the boundary, W, m.
        probes: shape (k, 2), the places beyond them, in the unknown, W, m.
    """

    boundary: np.ndarray
    probes: np.ndarray


def find_region_frontiers(roadmap: StarRoadmap, cover_radius: float, owner: int) -> list[Frontier]:
    """Return the frontiers of one region: where no region, no hit and no closure is beyond its boundary.

    Args:
        roadmap: with the region.
        cover_radius: m.
        owner: index of the region.
    """
    boundary, probes, is_open = _sample_boundary(
        roadmap.union, owner, roadmap.closures.failed_places, roadmap.grid.arrays, cover_radius
    )
    first_closed = int(np.argmin(is_open))  # no run goes on from the last point to the first
    boundary, probes, is_open = (np.roll(each, -first_closed, axis=0) for each in (boundary, probes, is_open))
    run_ends = np.flatnonzero(np.diff(np.concatenate(([0], is_open.astype(np.int8), [0])))).reshape(-1, 2)
    begin, end = measure_arc_lengths(boundary)[run_ends - (0, 1)].T
    return [Frontier(boundary[a:b], probes[a:b]) for a, b in run_ends[end - begin >= LEAST * cover_radius].tolist()]


def find_frontiers(roadmap: StarRoadmap, cover_radius: float) -> list[Frontier]:
    """Return the frontiers of all regions; arguments as for `find_region_frontiers`."""
    return [each for owner in range(len(roadmap)) for each in find_region_frontiers(roadmap, cover_radius, owner)]


@kernel
def _sample_boundary(union: RegionUnion, owner, failed_places, grid, radius):
    """Return points along a region's boundary (n, 2), the places beyond them (n, 2), whether these are open (n,)."""
    center, bearing_0, values = union.center[owner], union.bearing_0[owner], union.values[owner]
    samples, probe_distance, count = len(values), BEYOND * radius, 0
    sample_angle = 2.0 * math.pi / samples
    corners = np.empty((samples + 1, 2))
    parts = np.empty(samples, np.int64)
    for i in range(samples + 1):
        bearing = bearing_0 + sample_angle * i
        corners[i, 0] = center[0] + values[i % samples] * math.cos(bearing)
        corners[i, 1] = center[1] + values[i % samples] * math.sin(bearing)
    for i in range(samples):
        length = math.hypot(corners[i + 1, 0] - corners[i, 0], corners[i + 1, 1] - corners[i, 1])
        parts[i] = max(int(math.ceil(length / (STEP * radius))), 1)
        count += parts[i]
    boundary, probes, is_open = np.empty((count, 2)), np.empty((count, 2)), np.empty(count, np.bool_)
    n = 0
    for i in range(samples):
        dx, dy = corners[i + 1, 0] - corners[i, 0], corners[i + 1, 1] - corners[i, 1]
        length = max(math.hypot(dx, dy), 1e-9)
        for k in range(parts[i]):
            share = (k + 0.5) / parts[i]
            x, y = corners[i, 0] + share * dx, corners[i, 1] + share * dy
            u, v = x + probe_distance * dy / length, y - probe_distance * dx / length
            boundary[n, 0], boundary[n, 1], probes[n, 0], probes[n, 1] = x, y, u, v
            is_open[n] = measure_distance_at(grid, u, v) > radius - HIT_ERROR * radius
            for j in range(len(failed_places)):
                is_open[n] &= math.hypot(u - failed_places[j, 0], v - failed_places[j, 1]) > CLOSURE_RADIUS * radius
            is_open[n] = is_open[n] and find_covering_region(union, u, v, COVER_SLACK * radius) < 0
            n += 1
    return boundary, probes, is_open
