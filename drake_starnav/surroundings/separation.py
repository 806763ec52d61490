"""How far a robot is from surfaces that were hit, and whether it stays in space that was seen.

Two convex sets are disjoint if and only if the normal of an edge of one of them separates them; the gap along that
normal is a lower bound of their distance.
"""

import math

import numpy as np
from numba import njit

from drake_starnav.geometry.polyline import point_to_segment_squared
from drake_starnav.surroundings.looks import clipped, known
from drake_starnav.surroundings.start import RIM

ESCAPE_CLEARANCE = 0.002
"""A move that begins within the margin may come no nearer than this, m."""
LOOKAHEAD = 0.03
"""What no point of a robot leaves on its way is asked about at once, m: a few samples."""
SLIVER = 1e-7
"""A part no larger than this is none, m^2."""


@njit(cache=True)
def keeps_clear(poses, surfaces, looks, body, sizes):
    """Whether a body keeps the margin to all surfaces, and is by it within what was seen, at all poses of a motion.

    Where the first pose has less room, that much is enough.

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
    for i in range(count):
        x, y, yaw = poses[i, 0], poses[i, 1], poses[i, 2]
        frames[i, 0], frames[i, 1], frames[i, 2], frames[i, 3] = x, y, math.cos(yaw), math.sin(yaw)
        if math.hypot(x - center[0], y - center[1]) > room:
            return False
        if i > 0:
            way = math.hypot(x - poses[i - 1, 0], y - poses[i - 1, 1])
            moved[i] = moved[i - 1] + way + body.lever * abs(yaw - poses[i - 1, 2])
    apart = math.hypot(frames[0, 0] - center[0], frames[0, 1] - center[1]) + body.radius + margin + moved[-1]
    asked = np.zeros(2, np.int64)
    hidden = -1.0  # the margin to what was not seen; below 0: not yet asked for
    for j in range(len(surfaces.ends)):
        ends = surfaces.ends[j]
        away = point_to_segment_squared(center[0], center[1], ends[0], ends[1], ends[2], ends[3])
        if away > apart * apart:  # what a chord hides is farther away than the chord
            continue
        if _keeps_off(frames, moved, ends, center, surfaces.shades[j], body, margin):
            continue
        if not surfaces.shades[j]:
            return False
        if surfaces.solid[j] and not _keeps_off(frames, moved, ends, center, False, body, margin):
            return False
        if hidden < 0.0:
            hidden = _hidden_margin(frames[0], surfaces, looks, body, margin, apart, asked)
        if not _stays_seen(frames, moved, ends, center, looks, body, hidden, asked):
            return False
    return True


@njit(cache=True)
def _keeps_off(frames, moved, ends, center, shade, body, margin):
    """Whether a body keeps a margin to a chord, with `shade` to all that it hides as well; m.

    If it begins nearer, so much is enough.
    """
    needed, i, way = margin, 0, moved[-1]
    while True:
        gap = body_gap(frames[i], ends, center, shade, body, needed + way)
        if i == 0 and gap < needed:
            needed = max(gap - 1e-9, ESCAPE_CLEARANCE)
        if gap < needed:
            return False
        reached = moved[i] + (gap - needed)  # not less than moved[i]
        if reached >= way:
            return True
        i = np.searchsorted(moved, reached, side="right")


@njit(cache=True)
def _stays_seen(frames, moved, ends, center, looks, body, margin, asked):
    """Whether some look saw all that a chord hides of a body with a margin around it, at all samples."""
    i, count = 0, len(moved)
    while i < count:
        gap = body_gap(frames[i], ends, center, True, body, margin + moved[-1])
        if gap < margin:
            gap = margin
            if _seen(frames[i], ends, center, looks, body, margin + LOOKAHEAD, asked):
                gap = margin + LOOKAHEAD
            elif not _seen(frames[i], ends, center, looks, body, margin, asked):
                return False
        i = max(i + 1, np.searchsorted(moved, moved[i] + (gap - margin), side="right"))
    return True


@njit(cache=True)
def _hidden_margin(frame, surfaces, looks, body, margin, apart, asked):
    """The widest of a few margins with which all of a body that the last scan does not see was seen before, m."""
    center = surfaces.center
    for wanted in (margin, 0.5 * (margin + ESCAPE_CLEARANCE)):
        seen = True
        for j in range(len(surfaces.ends)):
            ends = surfaces.ends[j]
            if not surfaces.shades[j] or not seen:
                continue
            away = point_to_segment_squared(center[0], center[1], ends[0], ends[1], ends[2], ends[3])
            if away < apart * apart and body_gap(frame, ends, center, True, body, wanted) < wanted:
                seen = _seen(frame, ends, center, looks, body, wanted, asked)
        if seen:
            return wanted
    return ESCAPE_CLEARANCE


@njit(cache=True)
def _seen(frame, ends, center, looks, body, margin, asked):
    """Whether looks saw all that a chord hides of a body with a margin around it."""
    start, stops = 0, body.polygons.ends
    for k in range(max(len(stops), 1)):
        end = stops[k] if len(stops) else RIM
        hidden = np.empty((end - start + 4, 2))
        count = _hidden(_grown(frame, body, start, end, margin), ends, center, hidden)
        if count > 0 and not known(hidden, count, looks, asked):
            return False
        start = end
    return True


@njit(cache=True)
def _grown(frame, body, start, end, margin):
    """A part of a body with a margin around it, its corners mitred, W."""
    x, y, cosine, sine = frame
    out, (_, normals, offsets, stops) = np.empty((end - start, 2)), body.polygons
    for k in range(end - start):
        if len(stops):
            i, j = start + (k - 1) % (end - start), start + k
            a, b, c, d = normals[i, 0], normals[i, 1], normals[j, 0], normals[j, 1]
            p, q, turn = offsets[i] + margin, offsets[j] + margin, a * d - b * c
            u, v = (p * d - q * b) / turn, (a * q - c * p) / turn
        else:
            size = (body.radius + margin) / math.cos(math.pi / RIM)
            u, v = size * math.cos(2.0 * math.pi * k / RIM), size * math.sin(2.0 * math.pi * k / RIM)
        out[k, 0], out[k, 1] = x + cosine * u - sine * v, y + sine * u + cosine * v
    return out


@njit(cache=True)
def _hidden(part, ends, center, out):
    """What a chord hides of a convex polygon, as a polygon into `out`; how many corners it has, 0: nothing."""
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
    within = np.empty((n + 4, 2))
    n = clipped(part, n, ay, -ax, ay * cx - ax * cy, out)
    n = clipped(out, n, -by, bx, bx * cy - by * cx, within) if n > 2 else 0
    n = clipped(within, n, -ey, ex, ex * (cy + ay) - ey * (cx + ax), out) if n > 2 else 0
    area = 0.0
    for k in range(n):
        j = k + 1 if k + 1 < n else 0
        area += 0.5 * (out[k, 0] * out[j, 1] - out[k, 1] * out[j, 0])
    return n if n > 2 and area > SLIVER else 0


@njit(cache=True)
def body_gap(frame, ends, center, shade, body, enough):
    """Lower bound of the distance of a body from a chord (4,) and, with `shade`, all that it hides, m, up to `enough`.

    `frame` is the body's: x, y, and cosine and sine of its yaw, W.
    """
    x, y, cosine, sine = frame
    if len(body.polygons.ends) == 0:
        return _point_gap(x, y, ends, center, shade) - body.radius
    near = body.radius + enough
    if not shade and point_to_segment_squared(x, y, ends[0], ends[1], ends[2], ends[3]) > near * near:
        return enough
    ax, ay = _in_frame(ends[0] - x, ends[1] - y, cosine, sine)
    bx, by = _in_frame(ends[2] - x, ends[3] - y, cosine, sine)
    cx, cy = _in_frame(center[0] - x, center[1] - y, cosine, sine)
    chord = ax, ay, bx, by
    rays = (ax - cx, ay - cy, bx - cx, by - cy) if shade else (0.0, 0.0, 0.0, 0.0)
    least, start = np.inf, 0
    for end in body.polygons.ends:
        least = min(least, _part_gap(chord, rays, body.polygons, start, end, enough))
        start = end
    return least


@njit(cache=True)
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


@njit(cache=True)
def _in_frame(x, y, cosine, sine):
    """A vector in the frame that is turned by an angle of this cosine and sine."""
    return cosine * x + sine * y, cosine * y - sine * x


@njit(cache=True)
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


@njit(cache=True)
def _along(nx, ny, chord, rays):
    """Least extent of a chord and the rays behind it along a normal, m; minus infinity if the rays lead back."""
    if nx * rays[0] + ny * rays[1] < -1e-12 or nx * rays[2] + ny * rays[3] < -1e-12:
        return -np.inf
    return min(nx * chord[0] + ny * chord[1], nx * chord[2] + ny * chord[3])
