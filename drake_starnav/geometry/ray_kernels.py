"""Compiled ray casting: the first crossing of each beam of a fan with circles, segments and clipped conics.

The shapes are rows as described in `drake_starnav.geometry.raycast`.
"""

import math

from numba import njit

from drake_starnav.geometry.compiled import leaf

CIRCLE, SEGMENT, CONIC = 0.0, 1.0, 2.0
_ANGLE_PAD = 1e-9  # rad; beams through a corner shared by two segments must not slip between them
_LENGTH_PAD = 1e-9  # m; the same for the seam between a clipped conic and the segment that closes it


@njit(cache=True)
def cast_rows(rows, place, fan, ranges, reach):
    """Shorten `ranges` to the first crossing with rows of shapes.

    Each shape is transformed into the sensor frame S once, so that beams need no rotation.

    Args:
        rows: shape (k, 14).
        place: x, y, m, and cosine and sine of the yaw of the sensor.
        fan: a `Fan` of n beams.
        ranges: shape (n,), m, changed in place.
        reach: shapes farther than this are ignored, m.
    """
    x, y, cy, sy = place
    angle_min, increment, directions = fan.angle_min, fan.increment, fan.directions
    turn = 2.0 * math.pi
    for k in range(len(rows)):
        row = rows[k]
        gx, gy, radius = row[0] - x, row[1] - y, row[2]
        squared = gx * gx + gy * gy
        limit = reach + radius
        if squared > limit * limit:
            continue
        dx, dy = cy * gx + sy * gy, cy * gy - sy * gx
        if row[3] == SEGMENT:
            ax, ay = row[4] - x, row[5] - y
            ex, ey = row[6] - row[4], row[7] - row[5]
            ax, ay = cy * ax + sy * ay, cy * ay - sy * ax
            ex, ey = cy * ex + sy * ey, cy * ey - sy * ex
            angle = math.atan2(ay, ax)
            width = math.atan2(ax * ey - ay * ex, ax * (ax + ex) + ay * (ay + ey))
            if width < 0.0:
                angle += width
                width = -width
        elif squared <= radius * radius:
            angle, width = angle_min, turn
        else:
            half = math.asin(radius / math.sqrt(squared))
            angle, width = math.atan2(dy, dx) - half, 2.0 * half
        offset = (angle - angle_min) % turn
        for start in (offset - turn, offset):  # an interval may cover both ends of the fan
            i0 = max(0, int(math.ceil((start - _ANGLE_PAD) / increment)))
            i1 = min(len(ranges) - 1, int(math.floor((start + width + _ANGLE_PAD) / increment)))
            if i0 > i1:
                continue
            if row[3] == CIRCLE:
                _cast_circle(dx, dy, radius, directions, i0, i1, ranges)
            elif row[3] == SEGMENT:
                _cast_segment(ax, ay, ex, ey, directions, i0, i1, ranges)
            else:
                _cast_conic(row, place, directions, i0, i1, ranges)


@leaf
def _cast_conic(row, place, directions, i0, i1, ranges):
    """Shorten ranges of the beams i0 to i1 to a clipped conic; arguments as of `cast_rows`."""
    # Into S: A <- R^T A R, b <- R^T b, m <- R^T m with R the rotation by yaw.
    x, y, cy, sy = place
    gx, gy = row[0] - x, row[1] - y
    dx, dy = cy * gx + sy * gy, cy * gy - sy * gx
    a00, a01, a11 = row[4], row[5], row[6]
    p00 = cy * cy * a00 + 2.0 * cy * sy * a01 + sy * sy * a11
    p11 = sy * sy * a00 - 2.0 * cy * sy * a01 + cy * cy * a11
    p01 = cy * sy * (a11 - a00) + (cy * cy - sy * sy) * a01
    b0, b1 = cy * row[7] + sy * row[8], cy * row[8] - sy * row[7]
    m0, m1 = cy * row[10] + sy * row[11], cy * row[11] - sy * row[10]
    low, high = row[12] - _LENGTH_PAD, row[13] + _LENGTH_PAD
    g0, g1 = b0 - p00 * dx - p01 * dy, b1 - p01 * dx - p11 * dy
    c = row[9] - (g0 + b0) * dx - (g1 + b1) * dy
    flat = 1e-14 * (p00 + p11)
    s = -(m0 * dx + m1 * dy)
    for i in range(i0, i1 + 1):
        ux, uy = directions[i, 0], directions[i, 1]
        a = p00 * ux * ux + 2.0 * p01 * ux * uy + p11 * uy * uy
        b = g0 * ux + g1 * uy
        under = b * b - a * c
        if a <= flat or under < 0.0:  # flat: the beam is parallel to the sides of a horizontal cylinder
            continue
        root = math.sqrt(under)
        if b < 0.0:  # form without cancellation
            near, far = c / (root - b), (root - b) / a
        else:
            near, far = -(root + b) / a, (-c / (root + b) if root + b > 0.0 else 0.0)
        rate = m0 * ux + m1 * uy
        for t in (near, far):
            if 0.0 <= t < ranges[i] and low <= s + t * rate <= high:
                ranges[i] = t
                break


@leaf
def _cast_circle(dx, dy, radius, directions, i0, i1, ranges):
    """The same with a circle about (dx, dy) in S, m."""
    for i in range(i0, i1 + 1):
        ux, uy = directions[i, 0], directions[i, 1]
        cross = dx * uy - dy * ux
        under = radius * radius - cross * cross
        if under < 0.0:
            continue
        along, chord = dx * ux + dy * uy, math.sqrt(under)
        t = along - chord
        if t < 0.0:
            t = along + chord
        if 0.0 <= t < ranges[i]:
            ranges[i] = t


@leaf
def _cast_segment(ax, ay, ex, ey, directions, i0, i1, ranges):
    """The same with a segment from (ax, ay) to (ax + ex, ay + ey) in S, m."""
    cross = ax * ey - ay * ex
    for i in range(i0, i1 + 1):
        below = directions[i, 0] * ey - directions[i, 1] * ex
        if below != 0.0:
            t = cross / below
            if 0.0 <= t < ranges[i]:
                ranges[i] = t
