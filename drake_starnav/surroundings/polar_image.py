"""The scans of lidars anywhere on the robot as one scan about its axis: the nearest hit, or unknown, by bearing.

What one lidar sees is the polygon of its beam ends: the space on the near side of it is free, or was when the scan was
taken. A ray from the robot's axis is followed through one of these polygons to where it leaves it, from there through
another, until none holds it. It ends there, at unknown space, or before where it crosses the chord between two
connected hits. The edge of a shadow or of a field of view, behind which space is unknown, is not radial: a robot beside
the ray could enter what is behind it. Such a ray is stored as a lost beam with its own bound; regions are eroded by it
as by a hit.
"""

import math
from collections.abc import Sequence
from functools import lru_cache
from typing import NamedTuple

import numpy as np

from drake_starnav.geometry.compiled import kernel
from drake_starnav.geometry.footprint import Footprint
from drake_starnav.geometry.polyline import compute_third_side
from drake_starnav.geometry.se2 import transform_points
from drake_starnav.lidar.field_of_view import TURN
from drake_starnav.lidar.laser_scan import (
    DYNAMIC,
    HIT,
    MAPPABLE,
    MAY_LEAVE,
    MOVING,
    STANDING,
    STATIC,
    UNKNOWN,
    Beams,
    LaserScan,
)
from drake_starnav.lidar.mounts import Mount
from drake_starnav.surroundings.bearing_hits import CONNECTED_CHORD, measure_half_chords
from drake_starnav.surroundings.chords import ROUNDING
from drake_starnav.surroundings.erosion import BEARINGS
from drake_starnav.surroundings.view import NEAREST, View

BODY_SLACK = 0.001
"""A ray may cross unknown space up to this far outside the footprint, m: within the margin, numerics."""
OPEN, FREE = 4, 5
"""Where a ray ends, beside the motions of what it hits (`lidar.laser_scan`): at unknown space, and at full range. They
are ordered by how little is known, from STATIC to FREE."""
_RAY_BEARINGS = TURN / BEARINGS * np.arange(BEARINGS) - math.pi
RAY_DIRECTIONS = np.column_stack((np.cos(_RAY_BEARINGS), np.sin(_RAY_BEARINGS)))
"""Unit vectors along the rays, B, shape (BEARINGS, 2); the first points backwards."""
PlacedBeams = tuple[Beams, np.ndarray]
"""Beams of a view, and its pose (x, y, yaw) in the robot's frame B."""


class Crossings(NamedTuple):
    """Where rays meet edges or hits of a view, in no order, shape (n,) each.

    Attributes:
        rays: their numbers.
        distances: from the axis, m.
        ends: what is there: the motion of what was hit, see `lidar.laser_scan`, or OPEN.
    """

    rays: np.ndarray
    distances: np.ndarray
    ends: np.ndarray


def make_polar_image(
    views: Sequence[View], footprint: Footprint, past_beams: Sequence[PlacedBeams] = (), *, confirmed: bool = False
) -> LaserScan:
    """Return one scan about the robot's axis: the nearest hit, or where unknown space begins, on each bearing.

    That of a single lidar on the axis is its scan as it is.

    Args:
        views: of all lidars, from one robot pose.
        footprint: of the robot: what is inside it is the robot itself.
        past_beams: what was seen before, the newest first, beams and their poses (x, y, yaw) in B.
        confirmed: whether it is made of the confirmed scans, for the roadmap.
    """
    scans = [view.confirmed_scan if confirmed else view.scan for view in views]
    mounts = [view.mount for view in views]
    if len(scans) == 1 and mounts[0].offset == 0.0:
        return scans[0]
    farthest_range = max(map(find_view_range, scans, mounts))
    beams = [(scan.beams, np.array((mount.x, mount.y, 0.0))) for scan, mount in zip(scans, mounts, strict=True)]
    distance, end = _trace_rays(beams, past_beams, _find_own_reach(footprint), farthest_range)
    ranges = np.where(end <= UNKNOWN, distance, np.where(end == FREE, math.inf, math.nan))
    has_motion = any(scan.motion is not None for scan in scans)
    return LaserScan(
        scans[0].time, -math.pi, TURN / BEARINGS, 0.0, farthest_range, ranges, lost_beams=True, free=distance,
        scan_time=scans[0].scan_time, cover_radius=scans[0].cover_radius,
        motion=np.where(end <= DYNAMIC, end, STATIC) if has_motion else None,
    )  # fmt: skip


def find_view_range(scan: LaserScan, mount: Mount) -> float:
    """Return the distance from the robot's axis up to which a view without hits reaches, between beams as well, m."""
    return scan.range_max * math.cos(0.5 * scan.field_of_view.widest_gap) - mount.offset - ROUNDING


@lru_cache(maxsize=16)
def _find_own_reach(footprint: Footprint) -> np.ndarray:
    """Return how far each ray needs no view, shape (BEARINGS,), m: to the robot's own outline, and the slack."""
    if footprint.is_disc:
        return np.full(BEARINGS, footprint.radius + BODY_SLACK)
    outlines = [_cross_edges(part, np.full(len(part), OPEN, np.int8)) for part in footprint.parts]
    return _follow_rays(outlines, np.full(BEARINGS, ROUNDING)) + BODY_SLACK


def _trace_rays(
    current_beams: Sequence[PlacedBeams],
    past_beams: Sequence[PlacedBeams],
    own_reach: np.ndarray,
    farthest_range: float,
) -> tuple[np.ndarray, np.ndarray]:
    """Return how far each ray is free, up to `farthest_range`, m, and what ends it, shape (BEARINGS,) each.

    Up to `own_reach`, of the same shape, m, it needs no view. A surface of a past view, the newest first, counts only
    from where rays that are followed through newer views end: what one of these sees only farther out does not count.
    """
    distance, end = np.full(BEARINGS, farthest_range), np.full(BEARINGS, FREE, np.int8)
    followed_range = np.zeros(BEARINGS)
    outlines: list[Crossings] = []
    for count, (beams, pose) in enumerate((*current_beams, *past_beams), 1):
        outline, thin_obstacles = _cross_view(beams, pose, is_past=count > len(current_beams))
        outlines.append(outline)
        _stop_rays(outline, UNKNOWN, followed_range, distance, end)
        _stop_rays(thin_obstacles, UNKNOWN, followed_range, distance, end)
        if count >= len(current_beams):
            followed_range = _follow_rays(outlines, np.maximum(followed_range, own_reach))
    for outline in outlines:  # a moving obstacle ends a ray only where no view sees on
        _stop_rays(outline, DYNAMIC, followed_range, distance, end)
    return np.minimum(followed_range, distance), np.where(followed_range < distance, OPEN, end)


def _cross_view(beams: Beams, pose: np.ndarray, *, is_past: bool) -> tuple[Crossings, Crossings]:
    """Return where rays cross the outline of what was seen from a pose in B, and the hits that they may pass beside.

    The latter are hits whose chords are no longer than rays are apart there; each counts on the nearest ray. What may
    have moved since a past view, or was too far away to be told for certain, is no hit.
    """
    kinds, distances = beams.kinds, np.maximum(beams.distances, np.where(beams.kinds & HIT != 0, NEAREST, 0.0))
    motions = np.where(kinds & MAPPABLE == 0, UNKNOWN, np.where(kinds & MAY_LEAVE != 0, STANDING, STATIC))
    ends = np.where(kinds & HIT != 0, motions, np.where(kinds & MOVING != 0, DYNAMIC, OPEN)).astype(np.int8)
    if is_past:
        ends[(ends == UNKNOWN) | ((ends <= STANDING) & (distances > beams.certain_range))] = OPEN
        distances = np.minimum(distances, beams.certain_range)
    vertices, edge_ends = _outline_view(beams, distances, ends)
    x, y = transform_points(pose, beams.directions * distances[:, None]).T
    range_on_ray, half_chords = np.hypot(x, y), measure_half_chords(distances, beams)
    is_thin = (ends <= UNKNOWN) & (2.0 * half_chords <= range_on_ray * (TURN / BEARINGS))
    rays = np.rint((np.arctan2(y, x)[is_thin] + math.pi) * (BEARINGS / TURN)).astype(int) % BEARINGS
    thin_obstacles = Crossings(rays, range_on_ray[is_thin], ends[is_thin])
    return _cross_edges(transform_points(pose, vertices), edge_ends), thin_obstacles


@kernel
def _outline_view(beams, distances, beam_ends):
    """Return vertices (n, 2) of what a view saw, m, in its frame, and what ends it between each and the next.

    Between two connected hits the edge is their chord. Between other beams the view ends at the nearer one, and the
    edge of a shadow lies on the farther one.
    """
    n, is_full, directions = len(distances), beams.seam < np.inf, beams.directions
    size = 2 * n if is_full else 2 * n - 1  # the last vertex is the lidar
    vertices, edge_ends = np.zeros((size, 2)), np.full(size, OPEN, np.int8)
    for i in range(size // 2):
        j = (i + 1) % n
        a, b, lesser_known = distances[i], distances[j], max(beam_ends[i], beam_ends[j])
        chord = compute_third_side(a, b, math.cos(beams.increment if j > 0 else beams.seam))
        if lesser_known <= UNKNOWN and chord < CONNECTED_CHORD * beams.cover_radius:
            # it may leave if both hits may
            edge_ends[2 * i] = UNKNOWN if lesser_known == UNKNOWN else min(beam_ends[i], beam_ends[j])
        else:
            edge_ends[2 * i] = DYNAMIC if beam_ends[i if a < b else j] == DYNAMIC else OPEN
            a = b = min(a, b)
        for axis in range(2):
            vertices[2 * i, axis], vertices[2 * i + 1, axis] = a * directions[i, axis], b * directions[j, axis]
    return vertices, edge_ends


@kernel
def _cross_edges(vertices, ends):
    """Return where rays cross the edges of a polygon of vertices (n, 2); `ends` are of the edges that begin there.

    A ray through a vertex belongs to the edge that lies on its right, so that it crosses one of two.
    """
    starts = (np.arctan2(vertices[:, 1], vertices[:, 0]) + math.pi) * (BEARINGS / TURN)  # real numbers of rays
    stops = np.roll(starts, -1)
    first_rays, last_rays = np.ceil(np.minimum(starts, stops)), np.ceil(np.maximum(starts, stops))
    for k in range(len(vertices)):
        if abs(stops[k] - starts[k]) > 0.5 * BEARINGS:
            first_rays[k], last_rays[k] = last_rays[k], first_rays[k] + BEARINGS
    count, i = int((last_rays - first_rays).sum()), 0
    rays, distances, crossed_ends = np.empty(count, np.int64), np.empty(count), np.empty(count, np.int8)
    for k in range(len(vertices)):
        (ax, ay), (bx, by) = vertices[k], vertices[(k + 1) % len(vertices)]
        for ray in range(int(first_rays[k]), int(last_rays[k])):
            x, y = RAY_DIRECTIONS[ray % BEARINGS]
            a, b = x * ay - y * ax, x * by - y * bx  # how far the vertices are to the left of the ray
            share = min(max(a / (a - b), 0.0), 1.0) if a != b else 0.0
            distances[i] = x * (ax + share * (bx - ax)) + y * (ay + share * (by - ay))
            rays[i], crossed_ends[i] = ray % BEARINGS, ends[k]
            i += 1
    return Crossings(rays, distances, crossed_ends)


@kernel
def _stop_rays(crossings, last_end, least_distance, distance, end):
    """Let rays end where they meet something up to `last_end`, no nearer than a least distance; shape (BEARINGS,)."""
    for ray, crossing_distance, crossed_end in zip(crossings.rays, crossings.distances, crossings.ends):  # noqa: B905
        if crossed_end <= last_end and least_distance[ray] <= crossing_distance < distance[ray]:
            distance[ray], end[ray] = crossing_distance, crossed_end


def _follow_rays(outlines: Sequence[Crossings], start: np.ndarray) -> np.ndarray:
    """Return how far rays are inside any outline, from a start on, both of shape (BEARINGS,), m."""
    reached_range = start.copy()
    while any([_follow_through(outline, reached_range) for outline in outlines]):
        pass
    return reached_range


@kernel
def _follow_through(outline, reached_range):
    """Let each ray that is inside an outline go on to where it leaves it. Return whether one does.

    A ray is inside if it crosses the outline an odd number of times farther on.
    """
    is_inside, next_range, has_advanced = np.zeros(BEARINGS, np.bool_), np.full(BEARINGS, np.inf), False
    for ray, distance in zip(outline.rays, outline.distances):  # noqa: B905 - Numba's
        if distance > reached_range[ray]:
            is_inside[ray], next_range[ray] = not is_inside[ray], min(distance, next_range[ray])
    for ray in range(BEARINGS):
        if is_inside[ray]:
            reached_range[ray], has_advanced = next_range[ray], True
    return has_advanced
