"""The scans of lidars anywhere on the robot as one scan about its axis, and their hits as points.

What one lidar sees is the polygon of its beam ends: the space on the near side of it is free, or was when the scan was
taken. A ray from the robot's axis is free as far as it stays in the union of these polygons. It ends at an obstacle
where it crosses the chord between two connected hits, and at unknown space where it leaves the union through the edge
of a shadow or of a field of view. Such an edge is not radial: a robot beside the ray could enter what is behind it.
Such a ray is stored as a lost beam with its own bound; regions are eroded by it as by a hit.
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
from drake_starnav.lidar.field_of_view import TURN, FieldOfView
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
from drake_starnav.surroundings.bearing_hits import CONNECTED_CHORD
from drake_starnav.surroundings.chords import ROUNDING
from drake_starnav.surroundings.erosion import BEARINGS
from drake_starnav.surroundings.recent_hits import Hits
from drake_starnav.surroundings.view import UNSMOOTHED, View, make_hits, smooth_hits

CROSSINGS = 64
"""Edges of views that a ray is followed across; along a rough wall it may cross more, and ends at the last of these."""
BODY_SLACK = 0.001
"""A ray may cross unknown space up to this far outside the footprint, m: within the margin, numerics."""
PARALLEL = 1e-9
"""Sine of the angle up to which an edge counts as lying on a ray."""
OPEN, FREE = 4, 5
"""Where a ray ends, beside the motions of what it hits (`lidar.laser_scan`): at unknown space, and at full range."""
MOST_LIDARS = 6
"""Lidars of a robot at most: each view in an image takes one of 63 bits, and there are up to ten views of each lidar
and one of the initial disc."""
PlacedBeams = tuple[Beams, np.ndarray]
"""Beams of a view, and its pose (x, y, yaw) in the robot's frame B."""


def make_polar_image(
    views: Sequence[View], footprint: Footprint, past_beams: Sequence[PlacedBeams] = (), *, confirmed: bool = False
) -> LaserScan:
    """Return one scan about the robot's axis: the nearest hit, or where unknown space begins, on each bearing.

    That of a single lidar on the axis is its scan as it is.

    Args:
        views: of all lidars, from one robot pose.
        footprint: of the robot: what is inside it is the robot itself.
        past_beams: what was seen before, beams and their poses (x, y, yaw) in B.
        confirmed: whether it is made of the confirmed scans, for the roadmap.
    """
    scans = [view.confirmed_scan if confirmed else view.scan for view in views]
    mounts = [view.mount for view in views]
    if len(scans) == 1 and mounts[0].offset == 0.0:
        return scans[0]
    outer_range = _own_reach(footprint) + BODY_SLACK
    distance, kind, farthest_range = _follow_rays(scans, mounts, outer_range, past_beams)
    for scan, mount in zip(scans, mounts, strict=True):
        kinds = np.where(scan.mappable, np.where(scan.may_leave, STANDING, STATIC), UNKNOWN)
        _add_thin_obstacles(distance, kind, smooth_hits(scan, mount), kinds[scan.hits])
    if past_beams:
        past_hits = find_past_hits(views, past_beams)
        _add_thin_obstacles(distance, kind, past_hits, np.full(len(past_hits.points), STATIC))
    ranges = np.where(kind <= UNKNOWN, distance, np.where(kind == FREE, math.inf, math.nan))
    has_motion = any(scan.motion is not None for scan in scans)
    motion = np.where(kind <= DYNAMIC, kind, STATIC) if has_motion else None
    return LaserScan(
        scans[0].time, -math.pi, TURN / BEARINGS, 0.0, farthest_range, ranges, lost_beams=True, free=distance,
        scan_time=scans[0].scan_time, cover_radius=scans[0].cover_radius, motion=motion,
    )  # fmt: skip


def find_past_hits(views: Sequence[View], past_beams: Sequence[PlacedBeams]) -> Hits:
    """Return hits of past beams, not on moving obstacles, in B, where no lidar looks now.

    The arguments are those of `make_polar_image`; there is at least one past view.
    """
    hits = [make_hits(beams, UNSMOOTHED, 0.0, 0.0) for beams, _ in past_beams]
    is_kept = np.concatenate([beams.kinds[beams.kinds & HIT != 0] & MAPPABLE != 0 for beams, _ in past_beams])
    points = np.vstack(
        [transform_points(pose, end_points) for (_, pose), (end_points, _) in zip(past_beams, hits, strict=True)]
    )
    for view in views:
        is_kept &= ~looks_at(view.scan.field_of_view, view.mount, points)
    return Hits(points[is_kept], np.concatenate([gaps for _, gaps in hits])[is_kept])


def looks_at(field_of_view: FieldOfView, mount: Mount, points: np.ndarray) -> np.ndarray:
    """Return whether a lidar looks into the directions of points (n, 2) in B, shape (n,)."""
    bearing = np.arctan2(points[:, 1] - mount.y, points[:, 0] - mount.x)
    return np.mod(bearing - field_of_view.angle_min, TURN) <= (
        TURN if field_of_view.full_circle else field_of_view.span
    )


def _follow_rays(
    scans: Sequence[LaserScan],
    mounts: Sequence[Mount],
    outer_range: np.ndarray,
    past_beams: Sequence[PlacedBeams] = (),
) -> tuple[np.ndarray, np.ndarray, float]:
    """Return how far each ray is free, shape (BEARINGS,), m, and where it ends; and how far any ray is followed, m.

    Up to `outer_range`, of the same shape, m, it may be outside all views.
    """
    crossings = _Crossings(
        np.empty((BEARINGS, CROSSINGS)),
        np.empty((BEARINGS, CROSSINGS), np.int64),
        np.empty((BEARINGS, CROSSINGS), np.int8),
        np.zeros(BEARINGS, np.int64),
        np.zeros(BEARINGS, np.int64),
    )
    farthest_range, bit = 0.0, 1
    for scan, mount in zip(scans, mounts, strict=True):
        _cross_view(crossings, scan.beams, (mount.x, mount.y, 1.0, 0.0), HIT, math.inf, bit)
        farthest_range, bit = max(farthest_range, find_view_range(scan, mount)), bit << 1
    for beams, (x, y, yaw) in past_beams:
        frame = x, y, math.cos(yaw), math.sin(yaw)
        _cross_view(crossings, beams, frame, HIT | MAPPABLE, beams.certain_range, bit)
        bit <<= 1
    return *_walk_rays(crossings, outer_range, farthest_range, (1 << len(scans)) - 1), farthest_range


def covers_full_circle(views: Sequence[View], footprint: Footprint) -> bool:
    """Return whether the views, in an empty world, meet all around the robot as far as each sees."""
    if len(views) == 1 and views[0].scan.full_circle:
        return True
    fields = tuple((*view.scan.field_of_view, view.scan.range_max) for view in views)
    return _covers_full_circle(fields, tuple(view.mount for view in views), footprint)


@lru_cache(maxsize=16)
def _covers_full_circle(
    views: tuple[tuple[float, float, int, float], ...], mounts: tuple[Mount, ...], body: Footprint
) -> bool:
    """Return whether blank scans of these first bearings, steps, numbers of beams and ranges see all around."""
    blank = [
        LaserScan(0.0, first, step, 0.0, farthest_range, np.full(beams, math.inf))
        for first, step, beams, farthest_range in views
    ]
    distance, kind, _ = _follow_rays(blank, mounts, _own_reach(body) + BODY_SLACK)
    least = min(map(find_view_range, blank, mounts))
    return not ((kind == OPEN) & (distance < least)).any()


def find_view_range(scan: LaserScan, mount: Mount) -> float:
    """Return the distance from the robot's axis up to which a view without hits reaches, between beams as well, m."""
    return scan.range_max * math.cos(0.5 * scan.field_of_view.widest_gap) - mount.offset - ROUNDING


@lru_cache(maxsize=16)
def _own_reach(body: Footprint) -> np.ndarray:
    """Return how far the robot reaches along each ray, shape (BEARINGS,), m."""
    if body.is_disc:
        return np.full(BEARINGS, body.radius)
    bearing = TURN / BEARINGS * np.arange(BEARINGS) - math.pi
    rays = np.column_stack((np.cos(bearing), np.sin(bearing)))
    _, normals, offsets, part_ends = body.polygons
    own_reach, begin = np.zeros(BEARINGS), 0
    for end in part_ends.tolist():
        outward, offset_of_edge = rays @ normals[begin:end].T, offsets[begin:end]
        begin = end
        if (offset_of_edge > 0.0).all():  # the axis is inside
            leaving_range = np.where(outward > PARALLEL, offset_of_edge / np.maximum(outward, PARALLEL), np.inf)
            own_reach = np.maximum(own_reach, leaving_range.min(axis=1))
    return own_reach


class _Crossings(NamedTuple):
    """Where the ray of each bearing first crosses edges of views, by distance.

    Attributes:
        distance: shape (BEARINGS, CROSSINGS), m.
        view: bit of the lidar whose view the edge bounds, of that shape.
        kind: STATIC, STANDING, UNKNOWN, DYNAMIC or OPEN, of that shape.
        number: of all crossings of each ray, shape (BEARINGS,), also of those that are too far away to be kept.
        start_views: bits of the views in which each ray begins, of that shape: those whose edges it crosses an odd
            number of times.
    """

    distance: np.ndarray
    view: np.ndarray
    kind: np.ndarray
    number: np.ndarray
    start_views: np.ndarray


@kernel
def _cross_view(crossings, beams, frame, hit_bits, sight, bit):
    """Add the edges of the view of one lidar to the crossings; `frame` is x, y, cosine and sine of its yaw.

    `hit_bits` are bits of all beams that hit a surface, `sight` is how far it sees, m.

    Between two connected hits the edge is their chord. Between other beams the view ends at the nearer one, and the
    edge of a shadow lies on the farther one.
    """
    distance, directions = beams.distances, beams.directions
    hits = (beams.kinds & hit_bits == hit_bits) & (distance <= sight)
    x, y, cosine_yaw, sine_yaw = frame
    n, full, cosine = len(distance), beams.seam < np.inf, math.cos(beams.increment)
    seam = math.cos(beams.seam) if full else cosine
    cells, connected_chord = n if full else n - 1, CONNECTED_CHORD * beams.cover_radius
    vertices, kinds = np.empty((2 * cells + 1, 2)), np.full(2 * cells + 1, OPEN, np.int8)
    for i in range(cells):
        j = (i + 1) % n
        a, b = distance[i], distance[j]
        if hits[i] and hits[j] and compute_third_side(a, b, seam if j == 0 else cosine) < connected_chord:
            both = beams.kinds[i] & beams.kinds[j]
            kinds[2 * i] = UNKNOWN if not both & MAPPABLE else STANDING if both & MAY_LEAVE else STATIC
        else:
            kinds[2 * i] = DYNAMIC if (beams.kinds[i] if a < b else beams.kinds[j]) & MOVING else OPEN
            a = b = min(a, b, sight)
        for k, d, m in ((2 * i, a, i), (2 * i + 1, b, j)):
            vertices[k, 0] = x + d * (cosine_yaw * directions[m, 0] - sine_yaw * directions[m, 1])
            vertices[k, 1] = y + d * (sine_yaw * directions[m, 0] + cosine_yaw * directions[m, 1])
    vertices[2 * cells, 0], vertices[2 * cells, 1] = (vertices[0, 0], vertices[0, 1]) if full else (x, y)
    last_vertex = len(vertices) - 1
    ax = ay = 0.0
    start_cell = -1.0  # its bearing as a real number of rays; -1 on the axis, where all rays begin
    for k in range(-1, last_vertex + 1):  # the edge that leads to each vertex
        bx, by, bearing_cell = vertices[k, 0], vertices[k, 1], -1.0
        if bx * bx + by * by > 1e-18:
            bearing_cell = (math.atan2(by, bx) + math.pi) * (BEARINGS / TURN)
        if start_cell >= 0.0 and bearing_cell >= 0.0:
            _cross_edge(crossings, (ax, ay, start_cell), (bx, by, bearing_cell), kinds[k - 1], bit)
        ax, ay, start_cell = bx, by, bearing_cell


@kernel
def _cross_edge(crossings, start, end, kind, bit):
    """Add an edge to the rays that cross it. One through an end belongs to the edge that begins there on its left."""
    distance, view, kinds, count, start_views = crossings
    (ax, ay, a), (bx, by, b) = start, end
    low_cell, high_cell = (a, b) if a < b else (b, a)
    first_cell, last_cell = int(math.ceil(low_cell)), int(math.ceil(high_cell))
    if high_cell - low_cell > 0.5 * BEARINGS:
        first_cell, last_cell = last_cell, first_cell + BEARINGS
    ex, ey = bx - ax, by - ay
    for n in range(first_cell, last_cell):
        k = n % BEARINGS
        bearing = k * (TURN / BEARINGS) - math.pi
        across = math.cos(bearing) * ey - math.sin(bearing) * ex
        t, largest_t = math.hypot(ax, ay), math.hypot(bx, by)
        t, largest_t = min(t, largest_t), max(t, largest_t)
        if abs(across) > PARALLEL * (abs(ex) + abs(ey)):
            t = min(max((ax * ey - ay * ex) / across, 0.0), largest_t)
        start_views[k] ^= bit
        i = min(count[k], CROSSINGS - 1)
        count[k] += 1
        if count[k] > CROSSINGS and t >= distance[k, i]:
            continue
        while i > 0 and distance[k, i - 1] > t:
            distance[k, i], view[k, i], kinds[k, i] = distance[k, i - 1], view[k, i - 1], kinds[k, i - 1]
            i -= 1
        distance[k, i], view[k, i], kinds[k, i] = t, bit, kind


@kernel
def _walk_rays(crossings, own_reach, farthest_range, current_views):
    """Return how far each ray is free, m, up to `farthest_range`, and where it ends.

    Within `own_reach` (m) it needs no view; `current_views` are bits. A surface in a past view counts where no later
    one sees through it.
    """
    distance, view, kinds, count, start_views = crossings
    free_range, end_kind = np.full(len(count), farthest_range), np.full(len(count), FREE, np.int8)
    for k in range(len(count)):
        is_inside, reached_range = start_views[k], own_reach[k]
        for i in range(min(count[k], CROSSINGS)):
            t = distance[k, i]
            if is_inside == 0 and t > own_reach[k]:
                break
            if t >= farthest_range:
                reached_range = farthest_range
                break
            if kinds[k, i] <= UNKNOWN and (view[k, i] <= current_views or is_inside & (view[k, i] - 1) == 0):
                reached_range, end_kind[k] = t, kinds[k, i]
                break
            is_inside ^= view[k, i]
            if t >= own_reach[k] and (is_inside == 0 or i == CROSSINGS - 1):
                reached_range, end_kind[k] = t, DYNAMIC if kinds[k, i] == DYNAMIC else OPEN
                break
        free_range[k] = reached_range
        if reached_range < farthest_range and end_kind[k] == FREE:
            end_kind[k] = OPEN
    return free_range, end_kind


def _add_thin_obstacles(distance: np.ndarray, end_kind: np.ndarray, hits: Hits, kinds: np.ndarray) -> None:
    """Let rays end at hits that they may pass beside: those whose chords are no longer than rays are apart there."""
    points, half_chords = hits
    thin_range, bearing = np.hypot(*points.T), np.arctan2(points[:, 1], points[:, 0])
    thin = 2.0 * half_chords <= thin_range * (TURN / BEARINGS)
    thin_range, ray = thin_range[thin], np.rint((bearing[thin] + math.pi) * (BEARINGS / TURN)).astype(int) % BEARINGS
    order = np.argsort(-thin_range)
    order = order[thin_range[order] < distance[ray[order]]]  # of several on one ray the nearest is written last
    distance[ray[order]], end_kind[ray[order]] = thin_range[order], kinds[thin][order]
