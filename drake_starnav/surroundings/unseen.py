"""Whether what the last scan hides of a body is free: earlier looks saw it, or the robot itself stood there.

What is neither may be near the robot where it is. It comes no nearer to that than it is.
"""

import math
from typing import NamedTuple

import numpy as np
from numba import njit

from drake_starnav.geometry.footprint import Body, Footprint
from drake_starnav.lidar.field_of_view import TURN
from drake_starnav.surroundings.chords import BINS, ROUNDING
from drake_starnav.surroundings.looks import saw, stands_on

FINEST, MOST_ASKED, DEPTH = 0.004, 8000, 24
"""A part of what is asked about that is no longer than this is known as a whole, or it is unknown, m; so is what it
takes more questions to decide. And so many parts wait at a time."""
RIM = 24
"""Corners of the polygon around a disc."""
SLIVER = 1e-7
"""A part no larger than this is none, m^2."""
EXACT = 1e-9
"""Distances count as equal up to this, m."""


class Step(NamedTuple):
    """Where a body goes.

    Attributes:
        body: of the robot.
        first, there: x, y, and cosine and sine of its yaw, where it stands now and where it gets, W.
        alone: whether it must be free there for good: that nothing comes nearer does not count.
    """

    body: Body
    first: np.ndarray
    there: np.ndarray
    alone: bool


@njit(cache=True)
def is_free(step, ends, center, looks, margin, asked):
    """Whether all that a chord hides of a body with a margin around it is free, or no nearer to it than it was.

    Args:
        step: of the body.
        ends: of the chord, shape (4,), W.
        center: from where it hides, shape (2,), W.
        looks: `Looks` of before.
        margin: m.
        asked: how often looks were asked, up to MOST_ASKED, from when on nothing is known; and the one that answered
            last, which is asked first.
    """
    start, stops = 0, step.body.polygons.ends
    for k in range(max(len(stops), 1)):
        end = stops[k] if len(stops) else RIM
        hidden = np.empty((end - start + 4, 2))
        count = _hidden(_grown(step.there, step.body, start, end, margin), ends, center, hidden)
        if count > 0 and not known(hidden, count, looks, step, asked):
            return False
        start = end
    return True


@njit(cache=True)
def known(part, n, looks, step, asked):
    """Whether each place of a convex polygon, the first `n` of `part`, is free, or no nearer to a body than it was.

    What is not as a whole is cut along the edges of the body where it stands, or halved, down to FINEST. Other
    arguments as of `is_free`.
    """
    if _known(part, n, looks, step, asked):
        return True
    for i in range(n):  # mostly a corner decides
        if not _known(part[i : i + 1], 1, looks, step, asked):
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
        if _known(piece, m, looks, step, asked):
            continue
        low_x, high_x, low_y, high_y = piece[0, 0], piece[0, 0], piece[0, 1], piece[0, 1]
        for i in range(1, m):
            low_x, high_x = min(low_x, piece[i, 0]), max(high_x, piece[i, 0])
            low_y, high_y = min(low_y, piece[i, 1]), max(high_y, piece[i, 1])
        wide, high = high_x - low_x, high_y - low_y
        nx, ny, middle = _edge_across(piece, m, step)
        if nx == 0.0 and ny == 0.0:
            if max(wide, high) < FINEST:
                return False
            nx, ny, middle = (1.0, 0.0, low_x + 0.5 * wide) if wide > high else (0.0, 1.0, low_y + 0.5 * high)
        if depth + 2 > DEPTH or asked[0] > MOST_ASKED:
            return False
        for side in (1.0, -1.0):
            size = clipped(piece, m, side * nx, side * ny, side * middle, stack[depth])
            if size > 2:
                sizes[depth] = size
                depth += 1
    return True


@njit(cache=True)
def _known(part, n, looks, step, asked):
    """Whether all of a polygon is the robot's own place, or was seen by one look, or is no nearer than it was."""
    if stands_on(step.first, step.body, part, n) or _seen_by_any(part, n, looks, asked):
        return True
    return not step.alone and _no_nearer(part, n, step)


@njit(cache=True)
def _no_nearer(part, n, step):
    """Whether the body comes no nearer to any place of a polygon than it is where it stands.

    By how far each part of it is there at least, which is linear from the place that is nearest to the middle on; and
    how far one part is where it stands, which is convex: so the corners decide.
    """
    x, y = 0.0, 0.0
    for i in range(n):
        x, y = x + part[i, 0] / n, y + part[i, 1] / n
    stops, start, least, nearest = step.body.polygons.ends, 0, np.inf, (0, 0)
    for k in range(max(len(stops), 1)):
        end = stops[k] if len(stops) else 0
        away, _, _ = _away(x, y, step.first, step.body, start, end)
        if away < least:
            least, nearest = away, (start, end)
        start = end
    before = np.empty(n)
    for i in range(n):
        before[i], _, _ = _away(part[i, 0], part[i, 1], step.first, step.body, nearest[0], nearest[1])
    start = 0
    for k in range(max(len(stops), 1)):
        end = stops[k] if len(stops) else 0
        away, nx, ny = _away(x, y, step.there, step.body, start, end)
        for i in range(n):
            if away + nx * (part[i, 0] - x) + ny * (part[i, 1] - y) < before[i] - EXACT:
                return False
        start = end
    return True


@njit(cache=True)
def _away(px, py, frame, body, start, end):
    """How far a part of a body is from a place, m, negative within it; and the direction from it, W."""
    x, y, cosine, sine = frame
    dx, dy = px - x, py - y
    if len(body.polygons.ends) == 0:
        size = max(math.hypot(dx, dy), EXACT)
        return size - body.radius, dx / size, dy / size
    u, v = cosine * dx + sine * dy, cosine * dy - sine * dx
    depth, nu, nv = -np.inf, 0.0, 0.0
    for k in range(start, end):
        a, b = body.polygons.normals[k]
        along = a * u + b * v - body.polygons.offsets[k]
        if along > depth:
            depth, nu, nv = along, a, b
    if depth > 0.0:
        depth = np.inf
        for k in range(start, end):
            ax, ay = body.polygons.vertices[k]
            bx, by = body.polygons.vertices[k + 1 if k + 1 < end else start]
            ex, ey = bx - ax, by - ay
            t = min(max(((u - ax) * ex + (v - ay) * ey) / (ex * ex + ey * ey), 0.0), 1.0)
            qu, qv = u - ax - t * ex, v - ay - t * ey
            size = math.hypot(qu, qv)
            if size < depth:
                depth, nu, nv = size, qu / max(size, 1e-300), qv / max(size, 1e-300)
    return depth, cosine * nu - sine * nv, sine * nu + cosine * nv


@njit(cache=True)
def _edge_across(part, n, step):
    """Normal and offset of an edge of the body where it stands that parts what it covers of a polygon; zeros: none."""
    x, y, cosine, sine = step.first
    start = 0
    for end in step.body.polygons.ends:
        nx, ny, offset, apart = 0.0, 0.0, 0.0, False
        for e in range(start, end):
            a, b = step.body.polygons.normals[e]
            a, b = cosine * a - sine * b, sine * a + cosine * b
            most, low, high = step.body.polygons.offsets[e] + a * x + b * y, np.inf, -np.inf
            for i in range(n):
                along = a * part[i, 0] + b * part[i, 1] - most
                low, high = min(low, along), max(high, along)
            apart = apart or low > -ROUNDING
            if low < -ROUNDING and high > ROUNDING:
                nx, ny, offset = a, b, most
        if not apart and (nx != 0.0 or ny != 0.0):
            return nx, ny, offset
        start = end
    return 0.0, 0.0, 0.0


@njit(cache=True)
def _seen_by_any(part, n, looks, asked):
    """Whether some look saw all of a polygon."""
    if len(looks.places) == 0:
        return False
    first = asked[1]
    asked[0] += 1
    if saw(first, looks, part, n):
        return True
    for k in range(len(looks.places)):
        if k != first:
            asked[0] += 1
            if saw(k, looks, part, n):
                asked[1] = k
                return True
    return False


@njit(cache=True)
def clipped(part, n, nx, ny, offset, out):
    """What of a convex polygon, the first `n` of `part`, lies where normal @ p <= offset, into `out`; its size."""
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


def start_radius(footprint: Footprint, margin: float, offset: float) -> float:
    """Radius of the disc, m: in it a robot turns, and then drives off until a lidar sees what is beside it.

    Args:
        footprint: of the robot.
        margin: kept around it, m.
        offset: of the lidar ahead of its axis, m: it may see nothing farther back.
    """
    body, here = footprint.body, np.array((0.0, 0.0, 1.0, 0.0))
    begins, ends = (0, *body.polygons.ends[:-1]), body.polygons.ends if len(footprint.parts) else (RIM,)
    corners = np.vstack([_grown(here, body, begin, end, margin) for begin, end in zip(begins, ends, strict=True)])
    beside = float(np.abs(corners[:, 1]).max())
    ahead = offset + 2.0 * TURN / BINS * beside  # a view counts by whole bins
    return max(float(np.hypot(*corners.T).max()), math.hypot(beside, ahead)) + ROUNDING
