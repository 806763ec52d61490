"""Whether what the last scan hides of a body is free: earlier views cover it, or the robot itself stood there.

All else is unknown. The robot may begin near it, and then comes no nearer to it.
"""

import math
from typing import NamedTuple

import numpy as np

from drake_starnav.geometry.compiled import kernel
from drake_starnav.geometry.footprint import Body, Footprint, measure_part_distance, transform_point
from drake_starnav.lidar.field_of_view import TURN
from drake_starnav.surroundings.chords import BINS, ROUNDING
from drake_starnav.surroundings.view_arrays import body_covers, view_covers

FINEST, MOST_ASKED, DEPTH = 0.004, 8000, 24
"""A part shorter than FINEST, m, is not cut further; after MOST_ASKED queries the answer is no; at most DEPTH parts
wait at a time: numerics."""
EXCESS = 0.001
"""The polygon around a body with its margin is no larger, m: numerics."""
SLIVER = 1e-7
"""A part no larger than this is none, m^2."""
EXACT = 1e-9
"""Distances count as equal up to this, m: numerics."""


class BodyStep(NamedTuple):
    """Where a body goes.

    Attributes:
        body: of the robot.
        first, there: x, y, and cosine and sine of its yaw, where it stands now and where it gets, W.
        must_be_free: whether it must be free there for good: that nothing comes nearer does not count.
    """

    body: Body
    first: np.ndarray
    there: np.ndarray
    must_be_free: bool


@kernel
def is_occluded_part_free(step, end_points, center, views, margin, view_queries):
    """Return whether all that a chord occludes of a body with a margin is free, or no nearer to it than it was.

    Args:
        step: of the body.
        end_points: of the chord, shape (4,), W.
        center: from where it hides, shape (2,), W.
        views: `ViewArrays`.
        margin: m.
        view_queries: number of queries so far, and the index of the view that covered last, which is asked first.
    """
    for k in range(max(len(step.body.polygons.ends), 1)):
        inflated_polygon = _inflate_part(step.there, step.body, k, margin)
        occluded_polygon = np.empty((len(inflated_polygon) + 4, 2))
        count = _make_occluded_polygon(inflated_polygon, end_points, center, occluded_polygon)
        if count > 0 and not is_known_free(occluded_polygon, count, views, step, view_queries):
            return False
    return True


@kernel
def is_known_free(part, n, views, step, view_queries):
    """Return whether a convex polygon, the first `n` of `part`, is free everywhere, or no nearer to a body than it was.

    A polygon that is not free as a whole is cut along the edges of the body where it stands, or halved, until its parts
    are free or smaller than FINEST. Other arguments as for `is_occluded_part_free`.
    """
    if _is_part_free(part, n, views, step, view_queries)[0]:
        return True
    for i in range(n):  # mostly a corner decides
        if not _is_part_free(part[i : i + 1], np.int64(1), views, step, view_queries)[0]:
            return False
    stack, sizes, depth = np.empty((DEPTH, n + 2 * DEPTH, 2)), np.empty(DEPTH, np.int64), 1
    sizes[0] = n
    for i in range(n):  # an assignment to a slice takes Numba 2 s to compile
        stack[0, i, 0], stack[0, i, 1] = part[i, 0], part[i, 1]
    piece = np.empty((n + 2 * DEPTH, 2))
    while depth > 0:
        depth -= 1
        m = sizes[depth]
        for i in range(m):
            piece[i, 0], piece[i, 1] = stack[depth, i, 0], stack[depth, i, 1]
        free, nx, ny, middle = _is_part_free(piece, m, views, step, view_queries)
        if free:
            continue
        low_x, high_x, low_y, high_y = piece[0, 0], piece[0, 0], piece[0, 1], piece[0, 1]
        for i in range(1, m):
            low_x, high_x = min(low_x, piece[i, 0]), max(high_x, piece[i, 0])
            low_y, high_y = min(low_y, piece[i, 1]), max(high_y, piece[i, 1])
        wide, high = high_x - low_x, high_y - low_y
        if nx == 0.0 and ny == 0.0:
            if max(wide, high) < FINEST:
                return False
            nx, ny, middle = (1.0, 0.0, low_x + 0.5 * wide) if wide > high else (0.0, 1.0, low_y + 0.5 * high)
        if depth + 2 > DEPTH or view_queries[0] > MOST_ASKED:
            return False
        for side in (1.0, -1.0):
            size = clip_by_half_plane(piece, m, side * nx, side * ny, side * middle, stack[depth])
            if size > 2:
                sizes[depth] = size
                depth += 1
    return True


@kernel
def _is_part_free(part, n, views, step, view_queries):
    """Return whether all of a polygon is the robot's own place, or was seen in one view, or is no nearer than it was.

    Also return the edge along which to cut off what the body covers, as from `body_covers`.
    """
    own, nx, ny, middle = body_covers(step.first, step.body, part, n, np.inf)
    free = (
        own
        or _any_view_covers(part, n, views, view_queries)
        or (not step.must_be_free and _keeps_distance(part, n, step))
    )
    return free, nx, ny, middle


@kernel
def _keeps_distance(part, n, step):
    """Return whether the body comes no nearer to any place of a polygon than it is where it stands.

    A part of it does not if it moves away from the whole polygon along the normals to its corners: the distance is
    convex, and all other normals lie between these. Nor does it if a linear bound, by the normal to the middle, is at
    each corner no less than the distance of the nearest part now.
    """
    start_corner, end_corner, x, y = np.empty((n, 2)), np.empty((n, 2)), 0.0, 0.0
    for i in range(n):
        start_corner[i, 0], start_corner[i, 1] = transform_point(part[i, 0], part[i, 1], step.first)
        end_corner[i, 0], end_corner[i, 1] = transform_point(part[i, 0], part[i, 1], step.there)
        x, y = x + end_corner[i, 0] / n, y + end_corner[i, 1] / n
    stops, count = step.body.polygons.ends, max(len(step.body.polygons.ends), 1)
    start_distances = np.empty((count, n))
    nearest = 0
    moves_off = np.ones(count, np.bool_)
    for k in range(count):
        start, end = (stops[k - 1] if k > 0 else 0), (stops[k] if len(stops) else 0)
        for i in range(n):
            start_distances[k, i], nx, ny = measure_part_distance(
                start_corner[i, 0], start_corner[i, 1], step.body, start, end
            )
            for j in range(n):
                dx, dy = end_corner[j, 0] - start_corner[j, 0], end_corner[j, 1] - start_corner[j, 1]
                moves_off[k] = moves_off[k] and nx * dx + ny * dy >= -EXACT
        nearest = k if start_distances[k].max() < start_distances[nearest].max() else nearest
    for k in range(count):
        start, end = (stops[k - 1] if k > 0 else 0), (stops[k] if len(stops) else 0)
        if not moves_off[k]:
            distance, nx, ny = measure_part_distance(x, y, step.body, start, end)
            for i in range(n):
                end_distance = distance + nx * (end_corner[i, 0] - x) + ny * (end_corner[i, 1] - y)
                if end_distance < start_distances[nearest, i] - EXACT:
                    return False
    return True


@kernel
def _any_view_covers(part, n, views, view_queries):
    """Return whether some view saw all of a polygon."""
    if len(views.poses) == 0:
        return False
    first = view_queries[1]
    view_queries[0] += 1
    if view_covers(first, views, part, n):
        return True
    for k in range(len(views.poses)):
        if k != first:
            view_queries[0] += 1
            if view_covers(k, views, part, n):
                view_queries[1] = k
                return True
    return False


@kernel
def clip_by_half_plane(part, n, nx, ny, offset, out):
    """Write what of a convex polygon, the first `n` of `part`, has normal @ p <= offset to `out`; return its size."""
    m = 0
    for k in range(n):
        j = k + 1 if k + 1 < n else 0
        s = nx * part[k, 0] + ny * part[k, 1] - offset
        t = nx * part[j, 0] + ny * part[j, 1] - offset
        if s <= 0.0:
            out[m] = part[k]
            m += 1
        if (s < 0.0 < t) or (t < 0.0 < s):
            share = s / (s - t)
            out[m, 0] = part[k, 0] + share * (part[j, 0] - part[k, 0])
            out[m, 1] = part[k, 1] + share * (part[j, 1] - part[k, 1])
            m += 1
    return m


@kernel
def _inflate_part(frame, body, k, margin):
    """Return a polygon around the k-th part of a body with a margin, that exceeds it by no more than EXCESS, W."""
    (x, y, cosine, sine), (vertices, normals, _, stops) = frame, body.polygons
    start, end, inflation = 0, 1, margin + (0.0 if len(stops) else body.radius)
    if len(stops):
        start, end = (stops[k - 1] if k > 0 else 0), stops[k]
    inflated_corners, widest_angle = [], 2.0 * math.acos(inflation / (inflation + EXCESS))
    for j in range(start, end):
        u, v, first, turn_angle = 0.0, 0.0, 0.0, TURN
        if len(stops):
            (a, b), (c, d) = normals[j - 1 if j > start else end - 1], normals[j]
            (u, v), first, turn_angle = vertices[j], math.atan2(b, a), math.atan2(a * d - b * c, a * c + b * d)
        corner_count = math.ceil(turn_angle / widest_angle)
        for t in range(corner_count):
            angle = first + turn_angle * (t + 0.5) / corner_count
            corner_distance = inflation / math.cos(0.5 * turn_angle / corner_count)
            p, q = u + corner_distance * math.cos(angle), v + corner_distance * math.sin(angle)
            inflated_corners.append((x + cosine * p - sine * q, y + sine * p + cosine * q))
    return np.array(inflated_corners)


@kernel
def _make_occluded_polygon(part, ends, center, out):
    """Write what a chord hides of a convex polygon to `out`; return how many corners it has, 0: nothing."""
    cx, cy = center
    ax, ay, bx, by = ends[0] - cx, ends[1] - cy, ends[2] - cx, ends[3] - cy
    if ax * by - ay * bx < 0.0:
        ax, ay, bx, by = bx, by, ax, ay
    ex, ey = bx - ax, by - ay
    n, first, second, third = len(part), True, True, True  # whether all of it is beside an edge of the shadow
    for k in range(n):
        px, py = part[k, 0] - cx, part[k, 1] - cy
        first = first and ax * py - ay * px <= 0.0
        second = second and px * by - py * bx <= 0.0
        third = third and ex * (py - ay) - ey * (px - ax) >= 0.0
    if first or second or third:
        return 0
    clipped_part = np.empty((n + 4, 2))
    n = clip_by_half_plane(part, n, ay, -ax, ay * cx - ax * cy, out)
    n = clip_by_half_plane(out, n, -by, bx, bx * cy - by * cx, clipped_part) if n > 2 else 0
    n = clip_by_half_plane(clipped_part, n, -ey, ex, ex * (cy + ay) - ey * (cx + ax), out) if n > 2 else 0
    area = 0.0
    for k in range(n):
        j = k + 1 if k + 1 < n else 0
        area += 0.5 * (out[k, 0] * out[j, 1] - out[k, 1] * out[j, 0])
    return n if n > 2 and area > SLIVER else 0


def find_initial_disc_radius(footprint: Footprint, margin: float, offset: float) -> float:
    """Return the radius of the disc, m: in it a robot turns, and then drives off until a lidar sees what is beside it.

    Args:
        footprint: of the robot.
        margin: kept around it, m.
        offset: of the lidar ahead of its axis, m: it may see nothing farther back.
    """
    body, origin_frame = footprint.body, np.array((0.0, 0.0, 1.0, 0.0))
    corners = np.vstack([_inflate_part(origin_frame, body, k, margin) for k in range(max(len(footprint.parts), 1))])
    half_width = float(np.abs(corners[:, 1]).max())
    front_distance = offset + 2.0 * TURN / BINS * half_width  # a view counts by whole bins
    return max(float(np.hypot(*corners.T).max()), math.hypot(half_width, front_distance)) + ROUNDING
