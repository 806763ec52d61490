"""How far a robot is from surfaces that were hit, and whether it stays in space that was seen.

Two convex sets are disjoint if and only if the normal of an edge of one of them separates them; the gap along that
normal is a lower bound of their distance.
"""

import math

import numpy as np

from drake_starnav.geometry.compiled import kernel, leaf
from drake_starnav.geometry.footprint import in_frame
from drake_starnav.geometry.polyline import point_to_segment_squared
from drake_starnav.surroundings.unseen import Step, is_free

ESCAPE_CLEARANCE = 0.002
"""A move that begins within the margin may come no nearer than this, m: what bases stray by nature."""
LOOKAHEAD = 0.03
"""A margin wider by this, m, is asked about at once, for all samples until a point has moved as far: numerics."""


@kernel
def keeps_clear(poses, surfaces, looks, body, sizes):
    """Whether a body keeps the margin to all surfaces, and to all that was not seen, at all poses of a motion.

    Where the first pose has less room, that much is enough: to each surface, and to each place that was not seen.

    Args:
        poses: of the samples, shape (n, k), the first three columns x, y, yaw, W.
        surfaces: `Chords` of the last scan.
        looks: `Looks` of before; what the last scan hid must have been seen by one of them.
        body: of the robot.
        sizes: the margin, and within which distance of the scan's place the disc around the body is clear of what lies
            beyond the known hits; m.
    """
    margin, room = max(sizes[0], ESCAPE_CLEARANCE), sizes[1]
    count, center = len(poses), surfaces.center
    moved, frames = np.zeros(count), np.empty((count, 4))  # no point of the body has moved farther
    middle_x, middle_y = 0.5 * (poses[0, 0] + poses[-1, 0]), 0.5 * (poses[0, 1] + poses[-1, 1])
    farthest, around = 0.0, 0.0  # of the places from the scan's, and from the middle of the way
    for i in range(count):
        x, y, yaw = poses[i, 0], poses[i, 1], poses[i, 2]
        frames[i, 0], frames[i, 1], frames[i, 2], frames[i, 3] = x, y, math.cos(yaw), math.sin(yaw)
        farthest = max(farthest, math.hypot(x - center[0], y - center[1]))
        around = max(around, math.hypot(x - middle_x, y - middle_y))
        if i > 0:
            way = math.hypot(x - poses[i - 1, 0], y - poses[i - 1, 1])
            moved[i] = moved[i - 1] + way + body.lever * abs(yaw - poses[i - 1, 2])
    if farthest > room:
        return False
    farthest, around = farthest + body.radius + margin, around + body.radius + margin
    is_disc = len(body.polygons.ends) == 0  # else the gap is a bound, which may be less than that of the disc around
    asked = np.zeros(2, np.int64)
    for j in range(len(surfaces.ends)):
        ends = surfaces.ends[j]
        away = point_to_segment_squared(center[0], center[1], ends[0], ends[1], ends[2], ends[3])
        if away > farthest * farthest:  # what a chord hides is farther away than the chord
            continue
        beside = point_to_segment_squared(middle_x, middle_y, ends[0], ends[1], ends[2], ends[3])
        if is_disc and beside > around * around and not surfaces.shades[j]:
            continue
        if _keeps_off(frames, moved, ends, center, surfaces.shades[j], body, margin):
            continue
        if not surfaces.shades[j]:
            return False
        if surfaces.solid[j] and not _keeps_off(frames, moved, ends, center, False, body, margin):
            return False
        if not _stays_free(frames, moved, ends, center, looks, body, margin, asked):
            return False
    return True


@leaf
def _keeps_off(frames, moved, ends, center, shade, body, margin):
    """Whether a body keeps a margin to a chord, with `shade` to all that it hides as well; m.

    If it begins nearer to the chord alone, it need only come no nearer.
    """
    needed, i, way = margin, 0, moved[-1]
    while True:
        gap = body_gap(frames[i], ends, center, shade, body, needed + way)
        if i == 0 and gap < needed and not shade:
            needed = max(gap - 1e-9, ESCAPE_CLEARANCE)
        if not gap >= needed:  # nor is it where a pose is no number
            return False
        reached = moved[i] + (gap - needed)  # not less than moved[i]
        if reached >= way:
            return True
        while moved[i] <= reached:
            i += 1


@kernel
def _stays_free(frames, moved, ends, center, looks, body, margin, asked):
    """Whether all that a chord hides of a body with a margin around it is free, or no nearer than at first."""
    i, count = 0, len(moved)
    while i < count:
        gap = body_gap(frames[i], ends, center, True, body, margin + moved[-1])
        if gap < margin:
            gap = margin
            if is_free(Step(body, frames[0], frames[i], True), ends, center, looks, margin + LOOKAHEAD, asked):
                gap = margin + LOOKAHEAD
            elif i > 0 and not is_free(Step(body, frames[0], frames[i], False), ends, center, looks, margin, asked):
                return False
        reached = moved[i] + (gap - margin)
        i += 1
        while i < count and moved[i] <= reached:
            i += 1
    return True


@leaf
def body_gap(frame, ends, center, shade, body, enough):
    """Lower bound of the distance of a body from a chord (4,) and, with `shade`, all that it hides, m, up to `enough`.

    `frame` is the body's: x, y, and cosine and sine of its yaw, W.
    """
    x, y = frame[0], frame[1]  # to unpack an array may raise an error
    if len(body.polygons.ends) == 0:
        return _point_gap(x, y, ends, center, shade) - body.radius
    near = body.radius + enough
    if not shade and point_to_segment_squared(x, y, ends[0], ends[1], ends[2], ends[3]) > near * near:
        return enough
    (ax, ay), (bx, by) = in_frame(ends[0], ends[1], frame), in_frame(ends[2], ends[3], frame)
    cx, cy = in_frame(center[0], center[1], frame)
    chord = ax, ay, bx, by
    rays = (ax - cx, ay - cy, bx - cx, by - cy) if shade else (0.0, 0.0, 0.0, 0.0)
    least, start = np.inf, 0
    for end in body.polygons.ends:
        least = min(least, _part_gap(chord, rays, body.polygons, start, end, enough))
        start = end
    return least


@leaf
def _point_gap(x, y, ends, center, shade):
    """Distance of a place from a chord and, with `shade`, all that it hides, m; negative within that."""
    away = math.sqrt(point_to_segment_squared(x, y, ends[0], ends[1], ends[2], ends[3]))
    if not shade:
        return away
    ax, ay, bx, by = ends[0] - center[0], ends[1] - center[1], ends[2] - center[0], ends[3] - center[1]
    px, py = x - center[0], y - center[1]
    side = ax * by - ay * bx
    left, right = (ax * py - ay * px) * side, (px * by - py * bx) * side
    beyond = ((bx - ax) * (py - ay) - (by - ay) * (px - ax)) * side
    inside = left >= 0.0 and right >= 0.0 and beyond <= 0.0 and side != 0.0
    for qx, qy in ((ax, ay), (bx, by)):
        t = max((px * qx + py * qy) / max(qx * qx + qy * qy, 1e-18), 1.0)
        away = min(away, math.hypot(px - t * qx, py - t * qy))
    return -away if inside else away


@kernel
def _part_gap(chord, rays, polygons, start, end, enough):
    """`body_gap` of the polygon of these vertices, in the robot's frame."""
    ax, ay, bx, by = chord
    best = -np.inf
    for e in range(start, end):
        best = max(best, _along(polygons.normals[e, 0], polygons.normals[e, 1], chord, rays) - polygons.offsets[e])
        if best >= enough:
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
        best = max(best, _along(nx, ny, chord, rays) - high, _along(-nx, -ny, chord, rays) + low)
    return best


@kernel
def _along(nx, ny, chord, rays):
    """Least extent of a chord and the rays behind it along a normal, m; minus infinity if the rays lead back."""
    if nx * rays[0] + ny * rays[1] < -1e-12 or nx * rays[2] + ny * rays[3] < -1e-12:
        return -np.inf
    return min(nx * chord[0] + ny * chord[1], nx * chord[2] + ny * chord[3])
