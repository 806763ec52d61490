"""How far a robot is from surfaces that were hit, and whether it stays in space that was seen.

Two convex sets are disjoint if and only if the normal of an edge of one of them separates them; the gap along that
normal is a lower bound of their distance.
"""

import math
from typing import NamedTuple

import numpy as np

from drake_starnav.geometry.compiled import kernel, leaf
from drake_starnav.geometry.footprint import transform_point
from drake_starnav.geometry.polyline import square_segment_distance
from drake_starnav.surroundings.unseen import BodyStep, is_occluded_part_free

ESCAPE_CLEARANCE = 0.002
"""A move that begins within the margin may come no nearer than this, m: what bases stray by nature."""
LOOKAHEAD = 0.03
"""A margin wider by this, m, is asked about at once, for all samples until a point has moved as far: numerics."""


class ClearanceLimits(NamedTuple):
    """What a motion must keep.

    Attributes:
        margin: to surfaces and unknown space, m.
        checked_radius: up to this distance of the robot's centre from the lidar, m, no hit is left out of the chords.
    """

    margin: float
    checked_radius: float


@kernel
def is_collision_free(poses, chords, views, body, limits):
    """Return whether a body keeps a margin to all surfaces, and to unknown space, at all poses of a motion.

    If the first pose is nearer than the margin to a surface, or to an unknown place, the motion need only come no
    nearer to it.

    Args:
        poses: of the samples, shape (n, k), the first three columns x, y, yaw, W.
        chords: `Chords` of the last scan.
        views: other `ViewArrays`; what is occluded in the last scan must be covered by one of them.
        body: of the robot.
        limits: `ClearanceLimits`.
    """
    margin, checked_radius = max(limits.margin, ESCAPE_CLEARANCE), limits.checked_radius
    count, center = len(poses), chords.center
    moved_distance, frames = np.zeros(count), np.empty((count, 4))  # no point of the body has moved farther
    middle_x, middle_y = 0.5 * (poses[0, 0] + poses[-1, 0]), 0.5 * (poses[0, 1] + poses[-1, 1])
    center_reach = middle_reach = 0.0  # the farthest places from the scan's, and from the middle of the way
    for i in range(count):
        x, y, yaw = poses[i, 0], poses[i, 1], poses[i, 2]
        frames[i, 0], frames[i, 1], frames[i, 2], frames[i, 3] = x, y, math.cos(yaw), math.sin(yaw)
        center_reach = max(center_reach, math.hypot(x - center[0], y - center[1]))
        middle_reach = max(middle_reach, math.hypot(x - middle_x, y - middle_y))
        if i > 0:
            way = math.hypot(x - poses[i - 1, 0], y - poses[i - 1, 1])
            moved_distance[i] = moved_distance[i - 1] + way + body.lever * abs(yaw - poses[i - 1, 2])
    if center_reach > checked_radius:
        return False
    center_reach, middle_reach = center_reach + body.radius + margin, middle_reach + body.radius + margin
    is_disc = len(body.polygons.ends) == 0  # else the gap is a bound, which may be less than that of the disc around
    view_queries = np.zeros(2, np.int64)
    for j in range(len(chords.ends)):
        end_points = chords.ends[j]
        center_squared = square_segment_distance(
            center[0], center[1], end_points[0], end_points[1], end_points[2], end_points[3]
        )
        if center_squared > center_reach * center_reach:  # what a chord hides is farther away than the chord
            continue
        middle_squared = square_segment_distance(
            middle_x, middle_y, end_points[0], end_points[1], end_points[2], end_points[3]
        )
        if is_disc and middle_squared > middle_reach * middle_reach and not chords.occludes[j]:
            continue
        if _keeps_clearance(frames, moved_distance, end_points, center, chords.occludes[j], body, margin):
            continue
        if not chords.occludes[j]:
            return False
        if chords.is_surface[j] and not _keeps_clearance(
            frames, moved_distance, end_points, center, np.bool_(False), body, margin
        ):
            return False
        if not _keeps_occluded_part_free(frames, moved_distance, end_points, center, views, body, margin, view_queries):
            return False
    return True


@leaf
def _keeps_clearance(frames, moved_distance, end_points, center, occludes, body, margin):
    """Return whether a body keeps a margin to a chord, with `occludes` to all that it hides as well; m.

    If it begins nearer to the chord alone, it need only come no nearer.
    """
    needed_clearance, i, way = margin, 0, moved_distance[-1]
    while True:
        gap = measure_body_chord_distance(frames[i], end_points, center, occludes, body, needed_clearance + way)
        if i == 0 and gap < needed_clearance and not occludes:
            needed_clearance = max(gap - 1e-9, ESCAPE_CLEARANCE)
        if not gap >= needed_clearance:  # nor is it where a pose is no number
            return False
        reachable_distance = moved_distance[i] + (gap - needed_clearance)  # not less than moved_distance[i]
        if reachable_distance >= way:
            return True
        while moved_distance[i] <= reachable_distance:
            i += 1


@kernel
def _keeps_occluded_part_free(frames, moved_distance, end_points, center, views, body, margin, view_queries):
    """Return whether all that a chord hides of a body with a margin around it is free, or no nearer than at first."""
    i, count = 0, len(moved_distance)
    while i < count:
        gap = measure_body_chord_distance(
            frames[i], end_points, center, np.bool_(True), body, margin + moved_distance[-1]
        )
        if gap < margin:
            gap = margin
            if is_occluded_part_free(
                BodyStep(body, frames[0], frames[i], True), end_points, center, views, margin + LOOKAHEAD, view_queries
            ):
                gap = margin + LOOKAHEAD
            elif i > 0 and not is_occluded_part_free(
                BodyStep(body, frames[0], frames[i], False), end_points, center, views, margin, view_queries
            ):
                return False
        reachable_distance = moved_distance[i] + (gap - margin)
        i += 1
        while i < count and moved_distance[i] <= reachable_distance:
            i += 1
    return True


@leaf
def measure_body_chord_distance(frame, end_points, center, occludes, body, enough_distance):
    """Return a lower bound of the distance of a body from a chord (4,), m, up to `enough_distance`.

    With `occludes` it is also that from all that the chord hides.

    `frame` is the body's: x, y, and cosine and sine of its yaw, W.
    """
    x, y = frame[0], frame[1]  # to unpack an array may raise an error
    if len(body.polygons.ends) == 0:
        return _measure_point_chord_distance(x, y, end_points, center, occludes) - body.radius
    near_distance = body.radius + enough_distance
    if (
        not occludes
        and square_segment_distance(x, y, end_points[0], end_points[1], end_points[2], end_points[3])
        > near_distance * near_distance
    ):
        return enough_distance
    (ax, ay), (bx, by) = (
        transform_point(end_points[0], end_points[1], frame),
        transform_point(end_points[2], end_points[3], frame),
    )
    cx, cy = transform_point(center[0], center[1], frame)
    chord = ax, ay, bx, by
    rays = (ax - cx, ay - cy, bx - cx, by - cy) if occludes else (0.0, 0.0, 0.0, 0.0)
    least, start = np.inf, np.int64(0)
    for end in body.polygons.ends:
        least = min(least, _measure_part_chord_distance(chord, rays, body.polygons, start, end, enough_distance))
        start = end
    return least


@leaf
def _measure_point_chord_distance(x, y, end_points, center, occludes):
    """Return the distance of a place from a chord and, with `occludes`, all that it hides, m; negative within that."""
    distance = math.sqrt(square_segment_distance(x, y, end_points[0], end_points[1], end_points[2], end_points[3]))
    if not occludes:
        return distance
    ax = end_points[0] - center[0]
    ay = end_points[1] - center[1]
    bx = end_points[2] - center[0]
    by = end_points[3] - center[1]
    px, py = x - center[0], y - center[1]
    side = ax * by - ay * bx
    left_of_start, right_of_end = (ax * py - ay * px) * side, (px * by - py * bx) * side
    beyond_chord = ((bx - ax) * (py - ay) - (by - ay) * (px - ax)) * side
    is_inside = left_of_start >= 0.0 and right_of_end >= 0.0 and beyond_chord <= 0.0 and side != 0.0
    for qx, qy in ((ax, ay), (bx, by)):
        t = max((px * qx + py * qy) / max(qx * qx + qy * qy, 1e-18), 1.0)
        distance = min(distance, math.hypot(px - t * qx, py - t * qy))
    return -distance if is_inside else distance


@kernel
def _measure_part_chord_distance(chord, rays, polygons, start, end, enough_distance):
    """Return `measure_body_chord_distance` of the polygon of these vertices, in the robot's frame."""
    ax, ay, bx, by = chord
    best = -np.inf
    for e in range(start, end):
        best = max(
            best, _find_extent_along(polygons.normals[e, 0], polygons.normals[e, 1], chord, rays) - polygons.offsets[e]
        )
        if best >= enough_distance:
            return best
    for dx, dy in ((bx - ax, by - ay), (rays[0], rays[1]), (rays[2], rays[3])):
        size = math.sqrt(dx * dx + dy * dy)
        if size < 1e-12:
            continue
        nx, ny = -dy / size, dx / size
        low, high = np.inf, -np.inf
        for k in range(start, end):
            reach = nx * polygons.vertices[k, 0] + ny * polygons.vertices[k, 1]
            low, high = min(low, reach), max(high, reach)
        best = max(
            best, _find_extent_along(nx, ny, chord, rays) - high, _find_extent_along(-nx, -ny, chord, rays) + low
        )
    return best


@kernel
def _find_extent_along(nx, ny, chord, rays):
    """Return the least extent of a chord and the rays behind it along a normal, m; -inf if the rays lead back."""
    if nx * rays[0] + ny * rays[1] < -1e-12 or nx * rays[2] + ny * rays[3] < -1e-12:
        return -np.inf
    return min(nx * chord[0] + ny * chord[1], nx * chord[2] + ny * chord[3])
