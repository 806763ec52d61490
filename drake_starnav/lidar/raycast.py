"""Exact ray casting of a fan of beams against circles, segments and clipped conics in a plane.

Every shape is one row of 14 numbers, so that one kernel serves all of them and neighbouring shapes are close
in memory:

| column | holds |
|---|---|
| 0, 1, 2 | x, y, radius of a circle that contains the shape, m |
| 3 | `CIRCLE`, `SEGMENT` or `CONIC` |
| 4:8 | segment: x1, y1, x2, y2 |
| 4:10 | conic: a00, a01, a11, b0, b1, c of d^T A d + 2 b^T d + c = 0, d = p - (column 0, column 1) |
| 10:14 | conic: m0, m1, low, high; only the part with low <= m^T d <= high exists |

A beam measures the first curve it crosses, from either side: a sensor inside a closed shape sees its inner wall.
Each shape within reach is tested only against the beams whose bearings it can cover.
"""

import functools
import itertools
import math
from typing import NamedTuple

import numpy as np

from drake_starnav.geometry.compiled import kernel, leaf, put

COLUMNS = 14
CIRCLE, SEGMENT, CONIC = 0.0, 1.0, 2.0
_PAD = 1e-9
"""rad and m: no beam slips through the corner of two segments, or between a clipped conic and what closes it."""


class Fan(NamedTuple):
    """Directions of the beams in the sensor frame S.

    Attributes:
        angle_min: bearing of the first beam, rad.
        increment: bearing step, rad, positive; all beams lie within one turn.
        directions: shape (n, 2), unit vectors.
        clockwise: whether beams that measure one after the other begin with the last one.
    """

    angle_min: float
    increment: float
    directions: np.ndarray
    clockwise: bool = False

    @staticmethod
    @functools.lru_cache(maxsize=16)
    def regular(angle_min: float, increment: float, beams: int, clockwise: bool = False) -> "Fan":
        """Beams at equal steps of `increment` from `angle_min` on, rad."""
        angles = angle_min + increment * np.arange(beams)
        return Fan(float(angle_min), increment, np.column_stack((np.cos(angles), np.sin(angles))), clockwise)


class Place(NamedTuple):
    """Where the sensor is in the frame of some shapes: x, y, m, and cosine and sine of its yaw."""

    x: float
    y: float
    cosine: float
    sine: float


class Shapes(NamedTuple):
    """Shapes in groups, each in a frame of its own: `rows[starts[k]:starts[k + 1]]` are those of group k.

    Attributes:
        rows: shape (n, 14), as described at the top of this module.
        starts: shape (groups + 1,), int.
    """

    rows: np.ndarray
    starts: np.ndarray

    @staticmethod
    def of(groups: list[np.ndarray]) -> "Shapes":
        """The arrays of rows in the given order."""
        starts = np.array([*itertools.accumulate(map(len, groups), initial=0)])
        return Shapes(groups[0] if len(groups) == 1 else np.concatenate([*groups, np.zeros((0, COLUMNS))]), starts)


def make_circle_rows(circles: np.ndarray) -> np.ndarray:
    """Circles, shape (n, 3): x, y, radius, m, as rows."""
    circles = np.reshape(circles, (-1, 3))
    rows = np.zeros((len(circles), COLUMNS))
    rows[:, :3] = circles
    rows[:, 3] = CIRCLE
    return rows


def make_segment_rows(segments: np.ndarray) -> np.ndarray:
    """Segments, shape (n, 4): x1, y1, x2, y2, m, as rows."""
    segments = np.reshape(segments, (-1, 4))
    rows = np.zeros((len(segments), COLUMNS))
    rows[:, :2] = 0.5 * (segments[:, :2] + segments[:, 2:])
    rows[:, 2] = 0.5 * np.hypot(*(segments[:, 2:] - segments[:, :2]).T)
    rows[:, 3] = SEGMENT
    rows[:, 4:8] = segments
    return rows


@kernel
def cast_groups(groups, poses, fan, ranges, reach):
    """Shorten `ranges` to the first crossing with groups of shapes, each in its own frame.

    Args:
        groups: `Shapes` of g groups, as a plain tuple, which is handed over faster.
        poses: shape (g, 3): (x, y, yaw) of S in the frame of each group, m and rad.
        fan: a `Fan` of n beams, likewise.
        ranges: shape (n,), m, changed in place; start from `+inf`.
        reach: shapes farther than this are ignored, m.
    """
    groups, fan = Shapes(*groups), Fan(*fan)
    for g in range(len(groups.starts) - 1):
        place = Place(poses[g, 0], poses[g, 1], math.cos(poses[g, 2]), math.sin(poses[g, 2]))
        cast_rows(groups.rows[groups.starts[g] : groups.starts[g + 1]], place, fan, ranges, reach)


@kernel
def cast_rolling(groups, begin, end, fan, ranges, reach):
    """Shorten `ranges` to those of a rolling scan: beams measure one after the other while the sensor moves.

    Args:
        groups: `Shapes` of g groups.
        begin: shape (g, 3): (x, y, yaw) of S in the frame of each group one beam before the first beam, m and rad.
        end: the same at the last beam; in between, velocities are constant and yaw changes by at most half a turn.
        fan, ranges, reach: as in `cast_groups`.
    """
    groups, fan = Shapes(*groups), Fan(*fan)
    for g in range(len(groups.starts) - 1):
        rows = groups.rows[groups.starts[g] : groups.starts[g + 1]]
        _cast_rolling_rows(rows, begin[g], end[g], fan, ranges, reach)


@kernel
def _cast_rolling_rows(rows, begin, end, fan, ranges, reach):
    """Do the same for one group of shapes."""
    beams, circle = len(ranges), 2.0 * math.pi
    turn = (end[2] - begin[2] + math.pi) % circle - math.pi
    step = max(fan.increment + (-turn if fan.clockwise else turn) / beams, _PAD)  # of the beams' bearings
    first = fan.angle_min + end[2] - (0.0 if fan.clockwise else turn * (1.0 - 1.0 / beams))
    places = _place_beams(begin, end, turn, beams, fan.clockwise)
    for k in range(len(rows)):
        dx, dy = rows[k, 0] - 0.5 * (begin[0] + end[0]), rows[k, 1] - 0.5 * (begin[1] + end[1])
        sight_distance = math.hypot(dx, dy)
        radius = rows[k, 2] + 0.5 * math.hypot(end[0] - begin[0], end[1] - begin[1]) + _PAD
        if sight_distance > reach + radius:
            continue
        offset, width = 0.0, circle
        if sight_distance > radius and step > _PAD:
            half = math.asin(radius / sight_distance)
            offset, width = (math.atan2(dy, dx) - half - first) % circle, 2.0 * half
        for start in (offset - circle, offset, offset + circle):  # beams beyond `width` miss it from everywhere
            i0 = max(0, int(math.ceil((start - _PAD) / step)))
            for i in range(i0, min(beams, int(math.floor((start + width + _PAD) / step)) + 1)):
                place = Place(places[i, 0], places[i, 1], places[i, 2], places[i, 3])
                if rows[k, 3] != SEGMENT or _meets_segment(rows[k], place, fan.directions[i]):
                    _cast_shape(rows[k], place, fan.directions, i, i, ranges)


@kernel
def _place_beams(begin, end, turn, beams, clockwise):
    """Return the `Place` of the sensor at each beam of a sweep between two poses, by a turn, shape (beams, 4)."""
    places = np.empty((beams, 4))
    for i in range(beams):
        share_left = i / beams if clockwise else 1.0 - (i + 1.0) / beams  # of the sweep, at this beam
        yaw = end[2] - share_left * turn
        x, y = end[0] + share_left * (begin[0] - end[0]), end[1] + share_left * (begin[1] - end[1])
        put(places, i, (x, y, math.cos(yaw), math.sin(yaw)))
    return places


@leaf
def _meets_segment(row, place, direction):
    """Return whether the line of a beam of this direction in S passes between the ends of a segment."""
    (ax, ay, ex, ey), ux, uy = _transform_segment(row, place), direction[0], direction[1]
    one, other = ax * uy - ay * ux, (ax + ex) * uy - (ay + ey) * ux  # how far the ends are to the right of the beam
    slack = _PAD * (abs(ax) + abs(ay) + abs(ex) + abs(ey))
    return min(one, other) <= slack and max(one, other) >= -slack


@kernel
def cast_rows(rows, place, fan, ranges, reach):
    """Shorten `ranges` to the first crossing with rows of shapes.

    Each shape is transformed into the sensor frame S once, so that beams need no rotation. `place` is the sensor's
    `Place`; the others are as in `cast_groups`.
    """
    increment, turn = fan.increment, 2.0 * math.pi
    for k in range(len(rows)):
        row = rows[k]
        gx, gy, radius = row[0] - place.x, row[1] - place.y, row[2]
        squared = gx * gx + gy * gy
        limit = reach + radius
        if squared > limit * limit:
            continue
        if row[3] == SEGMENT:
            ax, ay, ex, ey = _transform_segment(row, place)
            angle = math.atan2(ay, ax)
            width = math.atan2(ax * ey - ay * ex, ax * (ax + ex) + ay * (ay + ey))
            if width < 0.0:
                angle += width
                width = -width
        elif squared <= radius * radius:
            angle, width = fan.angle_min, turn
        else:
            half = math.asin(radius / math.sqrt(squared))
            dx, dy = _rotate(gx, gy, place)
            angle, width = math.atan2(dy, dx) - half, 2.0 * half
        offset = (angle - fan.angle_min) % turn
        for start in (offset - turn, offset):  # an interval may cover both ends of the fan
            i0 = max(0, int(math.ceil((start - _PAD) / increment)))
            i1 = min(len(ranges) - 1, int(math.floor((start + width + _PAD) / increment)))
            if i0 <= i1:
                _cast_shape(row, place, fan.directions, i0, i1, ranges)


@leaf
def _cast_shape(row, place, directions, i0, i1, ranges):
    """Shorten ranges of the beams i0 to i1 to a shape; other arguments as of `cast_rows`."""
    if row[3] == CIRCLE:
        dx, dy = _rotate(row[0] - place.x, row[1] - place.y, place)
        _cast_circle(dx, dy, row[2], directions, i0, i1, ranges)
    elif row[3] == SEGMENT:
        ax, ay, ex, ey = _transform_segment(row, place)
        _cast_segment(ax, ay, ex, ey, directions, i0, i1, ranges)
    else:
        _cast_conic(row, place, directions, i0, i1, ranges)


@leaf
def _rotate(x, y, place):
    """Return a vector in S."""
    return place.cosine * x + place.sine * y, place.cosine * y - place.sine * x


@leaf
def _transform_segment(row, place):
    """The first end of a segment, and the way from there to the other, in S, m."""
    ax, ay = _rotate(row[4] - place.x, row[5] - place.y, place)
    ex, ey = _rotate(row[6] - row[4], row[7] - row[5], place)
    return ax, ay, ex, ey


@leaf
def _cast_conic(row, place, directions, i0, i1, ranges):
    """Shorten the ranges of beams i0 to i1 to those of a clipped conic."""
    # Into S: A <- R^T A R, b <- R^T b, m <- R^T m with R the rotation by yaw.
    cy, sy = place.cosine, place.sine
    dx, dy = _rotate(row[0] - place.x, row[1] - place.y, place)
    a00, a01, a11 = row[4], row[5], row[6]
    p00 = cy * cy * a00 + 2.0 * cy * sy * a01 + sy * sy * a11
    p11 = sy * sy * a00 - 2.0 * cy * sy * a01 + cy * cy * a11
    p01 = cy * sy * (a11 - a00) + (cy * cy - sy * sy) * a01
    (b0, b1), (m0, m1) = _rotate(row[7], row[8], place), _rotate(row[10], row[11], place)
    low, high = row[12] - _PAD, row[13] + _PAD
    g0, g1 = b0 - p00 * dx - p01 * dy, b1 - p01 * dx - p11 * dy
    c = row[9] - (g0 + b0) * dx - (g1 + b1) * dy
    flat = 1e-14 * (p00 + p11)
    s = -(m0 * dx + m1 * dy)
    for i in range(i0, i1 + 1):
        ux, uy = directions[i, 0], directions[i, 1]
        a = p00 * ux * ux + 2.0 * p01 * ux * uy + p11 * uy * uy
        b = g0 * ux + g1 * uy
        discriminant = b * b - a * c
        if a <= flat or discriminant < 0.0:  # flat: the beam is parallel to the sides of a horizontal cylinder
            continue
        root = math.sqrt(discriminant)
        if b < 0.0:  # form without cancellation
            near_range, far_range = c / (root - b), (root - b) / a
        else:
            near_range, far_range = -(root + b) / a, (-c / (root + b) if root + b > 0.0 else 0.0)
        rate = m0 * ux + m1 * uy
        for t in (near_range, far_range):
            if 0.0 <= t < ranges[i] and low <= s + t * rate <= high:
                ranges[i] = t
                break


@leaf
def _cast_circle(dx, dy, radius, directions, i0, i1, ranges):
    """The same with a circle about (dx, dy) in S, m."""
    for i in range(i0, i1 + 1):
        ux, uy = directions[i, 0], directions[i, 1]
        cross = dx * uy - dy * ux
        discriminant = radius * radius - cross * cross
        if discriminant < 0.0:
            continue
        range_along, chord = dx * ux + dy * uy, math.sqrt(discriminant)
        t = range_along - chord
        if t < 0.0:
            t = range_along + chord
        if 0.0 <= t < ranges[i]:
            ranges[i] = t


@leaf
def _cast_segment(ax, ay, ex, ey, directions, i0, i1, ranges):
    """The same with a segment from (ax, ay) to (ax + ex, ay + ey) in S, m.

    A beam in line with it meets its nearer end: the quotient of two rounding errors lies anywhere.
    """
    cross, parallel = ax * ey - ay * ex, _PAD * (abs(ex) + abs(ey))
    for i in range(i0, i1 + 1):
        ux, uy = directions[i, 0], directions[i, 1]
        below, one = ux * ey - uy * ex, ax * ux + ay * uy
        other = one + ex * ux + ey * uy  # how far ahead the ends are
        t = cross / below if abs(below) > parallel else min(one, other)
        t = min(max(t, min(one, other) - _PAD), max(one, other) + _PAD)
        if 0.0 <= t < ranges[i]:
            ranges[i] = t
