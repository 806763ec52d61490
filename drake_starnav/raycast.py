"""Exact ray casting of a fan of beams against circles, segments and clipped conics in a plane.

Every shape is one row of 14 numbers, so that one kernel serves all of them and shapes near one another
lie near one another in memory:

| column | holds |
|---|---|
| 0, 1, 2 | x, y, radius of a circle that contains the shape, m |
| 3 | `CIRCLE`, `SEGMENT` or `CONIC` |
| 4:8 | segment: x1, y1, x2, y2 |
| 4:10 | conic: a00, a01, a11, b0, b1, c of d^T A d + 2 b^T d + c = 0, d = p - (column 0, column 1) |
| 10:14 | conic: m0, m1, low, high; only the part with low <= m^T d <= high exists |

A beam measures the first curve it crosses, from either side: a sensor inside a closed shape sees its inner wall.
Each shape is tested against only those beams whose bearings it can cover, and only shapes in grid cells
within reach are looked at.
"""

import math
from dataclasses import dataclass

import numpy as np
from numba import njit

from drake_starnav.errors import StarnavError

COLUMNS = 14
CIRCLE, SEGMENT, CONIC = 0.0, 1.0, 2.0
_ANGLE_PAD = 1e-9  # rad; beams through a corner shared by two segments must not slip between them
_LENGTH_PAD = 1e-9  # m; the same for the seam between a clipped conic and the segment that closes it


@dataclass(frozen=True)
class Fan:
    """Directions of the beams in the sensor frame S.

    Attributes:
        angle_min: bearing of the first beam, rad.
        increment: bearing step, rad, positive; all beams lie within one turn.
        directions: shape (n, 2), unit vectors.
    """

    angle_min: float
    increment: float
    directions: np.ndarray

    @staticmethod
    def regular(angle_min: float, increment: float, beams: int) -> "Fan":
        """Beams evenly spaced by `increment` from `angle_min` on, rad."""
        angles = angle_min + increment * np.arange(beams)
        return Fan(angle_min, increment, np.column_stack((np.cos(angles), np.sin(angles))))


@dataclass(frozen=True)
class ShapeBins:
    """Shapes sorted by bin: `rows[starts[k]:starts[k + 1]]` are those of bin k.

    Attributes:
        rows: shape (n, 14), as described at the top of this module.
        starts: shape (bins + 1,), int.
        cell: edge of a grid cell, m; 0 when the bins are not a grid.
    """

    rows: np.ndarray
    starts: np.ndarray
    cell: float = 0.0

    @staticmethod
    def grouped(groups: list[np.ndarray]) -> "ShapeBins":
        """One bin per array of rows, in the given order."""
        starts = np.zeros(len(groups) + 1, dtype=np.int64)
        np.cumsum([len(group) for group in groups], out=starts[1:])
        return ShapeBins(np.vstack([*groups, np.zeros((0, COLUMNS))]), starts)

    @staticmethod
    def grid(rows: np.ndarray, cell: float) -> "ShapeBins":
        """Shapes by the grid cell of their centres; cells are hashed, so the plane has no edge.

        Args:
            rows: shape (n, 14).
            cell: edge of a cell, m. Shapes of a larger radius go to a last bin that every cast looks at.
        """
        buckets = 1
        while buckets < 2 * len(rows):
            buckets *= 2
        keys = _cell_keys(rows, cell, buckets)
        starts = np.searchsorted(keys, np.arange(buckets + 2), sorter=(order := np.argsort(keys, kind="stable")))
        return ShapeBins(np.ascontiguousarray(rows[order]), starts.astype(np.int64), cell)


def circle_rows(circles: np.ndarray) -> np.ndarray:
    """Circles as rows.

    Args:
        circles: shape (n, 3): x, y, radius, m.
    """
    circles = np.asarray(circles, dtype=float).reshape(-1, 3)
    rows = np.zeros((len(circles), COLUMNS))
    rows[:, :3] = circles
    rows[:, 3] = CIRCLE
    return rows


def segment_rows(segments: np.ndarray) -> np.ndarray:
    """Segments as rows.

    Args:
        segments: shape (n, 4): x1, y1, x2, y2, m.
    """
    segments = np.asarray(segments, dtype=float).reshape(-1, 4)
    rows = np.zeros((len(segments), COLUMNS))
    rows[:, :2] = 0.5 * (segments[:, :2] + segments[:, 2:])
    rows[:, 2] = 0.5 * np.hypot(*(segments[:, 2:] - segments[:, :2]).T)
    rows[:, 3] = SEGMENT
    rows[:, 4:8] = segments
    return rows


def ellipse_rows(ellipses: np.ndarray) -> np.ndarray:
    """Whole ellipses as rows.

    Args:
        ellipses: shape (n, 5): x, y, semi-axes p and q, m, bearing of the first semi-axis, rad.
    """
    ellipses = np.asarray(ellipses, dtype=float).reshape(-1, 5)
    x, y, p, q, angle = ellipses.T
    u, v = np.cos(angle), np.sin(angle)
    rows = np.zeros((len(ellipses), COLUMNS))
    rows[:, :3] = np.column_stack((x, y, np.maximum(p, q)))
    rows[:, 3] = CONIC
    rows[:, 4] = (u / p) ** 2 + (v / q) ** 2
    rows[:, 5] = u * v * (p**-2 - q**-2)
    rows[:, 6] = (v / p) ** 2 + (u / q) ** 2
    rows[:, 9] = -1.0
    rows[:, 12], rows[:, 13] = -1.0, 1.0
    return rows


def cast_grid(
    bins: ShapeBins, pose: tuple[float, float, float] | np.ndarray, fan: Fan, ranges: np.ndarray, reach: float
) -> None:
    """Shorten `ranges` to the first crossing with the shapes of a grid.

    Args:
        bins: made by `ShapeBins.grid`.
        pose: (x, y, yaw) of S in the frame of the shapes, m and rad.
        fan: the beams.
        ranges: shape (n,), m, changed in place; start from `+inf`.
        reach: shapes farther than this are ignored, m.

    Raises:
        StarnavError: bins are not a grid.
    """
    if bins.cell <= 0.0:
        raise StarnavError(f"ray cast: grid cell is {bins.cell:g}; allowed: bins made by ShapeBins.grid, 0 < cell")
    x, y, yaw = float(pose[0]), float(pose[1]), float(pose[2])
    _cast_grid(
        bins.rows, bins.starts, bins.cell, x, y, yaw, fan.directions, fan.angle_min, fan.increment, reach, ranges
    )


def cast_groups(bins: ShapeBins, poses: np.ndarray, fan: Fan, ranges: np.ndarray, reach: float) -> None:
    """Shorten `ranges` to the first crossing with groups of shapes, each in its own frame.

    Args:
        bins: made by `ShapeBins.grouped`, g groups.
        poses: shape (g, 3): (x, y, yaw) of S in the frame of each group, m and rad.
        fan, ranges, reach: as in `cast_grid`.
    """
    _cast_groups(bins.rows, bins.starts, poses, fan.directions, fan.angle_min, fan.increment, reach, ranges)


@njit(cache=True)
def _bucket(i, j, buckets):
    return ((i * 73856093) ^ (j * 19349663)) & (buckets - 1)


@njit(cache=True)
def _cell_keys(rows, cell, buckets):
    keys = np.empty(len(rows), dtype=np.int64)
    for k in range(len(rows)):
        if rows[k, 2] > cell:
            keys[k] = buckets
        else:
            keys[k] = _bucket(int(math.floor(rows[k, 0] / cell)), int(math.floor(rows[k, 1] / cell)), buckets)
    return keys


@njit(cache=True)
def _cast_grid(rows, starts, cell, x, y, yaw, directions, angle_min, increment, reach, ranges):
    buckets = len(starts) - 2
    i0, i1 = math.floor((x - reach) / cell) - 1, math.floor((x + reach) / cell) + 1
    j0, j1 = math.floor((y - reach) / cell) - 1, math.floor((y + reach) / cell) + 1
    if (i1 - i0 + 1.0) * (j1 - j0 + 1.0) >= buckets:  # more cells than buckets: look at every shape once
        _cast_rows(rows, 0, starts[buckets], x, y, yaw, directions, angle_min, increment, reach, ranges)
    else:
        for i in range(int(i0), int(i1) + 1):
            for j in range(int(j0), int(j1) + 1):
                k = _bucket(i, j, buckets)
                _cast_rows(rows, starts[k], starts[k + 1], x, y, yaw, directions, angle_min, increment, reach, ranges)
    _cast_rows(rows, starts[buckets], len(rows), x, y, yaw, directions, angle_min, increment, reach, ranges)


@njit(cache=True)
def _cast_groups(rows, starts, poses, directions, angle_min, increment, reach, ranges):
    for g in range(len(starts) - 1):
        x, y, yaw = poses[g, 0], poses[g, 1], poses[g, 2]
        _cast_rows(rows, starts[g], starts[g + 1], x, y, yaw, directions, angle_min, increment, reach, ranges)


@njit(cache=True)
def _cast_rows(rows, first, last, x, y, yaw, directions, angle_min, increment, reach, ranges):
    """Cast against rows[first:last]; each shape is brought into S once, so that beams need no rotation."""
    cy, sy = math.cos(yaw), math.sin(yaw)
    turn = 2.0 * math.pi
    for k in range(first, last):
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
                _cast_conic(row, dx, dy, cy, sy, directions, i0, i1, ranges)


@njit(cache=True)
def _cast_circle(dx, dy, radius, directions, i0, i1, ranges):
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


@njit(cache=True)
def _cast_segment(ax, ay, ex, ey, directions, i0, i1, ranges):
    cross = ax * ey - ay * ex
    for i in range(i0, i1 + 1):
        below = directions[i, 0] * ey - directions[i, 1] * ex
        if below != 0.0:
            t = cross / below
            if 0.0 <= t < ranges[i]:
                ranges[i] = t


@njit(cache=True)
def _cast_conic(row, dx, dy, cy, sy, directions, i0, i1, ranges):
    # Into S: A <- R^T A R, b <- R^T b, m <- R^T m with R the rotation by yaw.
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
        if a <= flat or under < 0.0:  # flat: the beam runs along the sides of a lying cylinder
            continue
        root = math.sqrt(under)
        if b < 0.0:  # the form without cancellation
            near, far = c / (root - b), (root - b) / a
        else:
            near, far = -(root + b) / a, (-c / (root + b) if root + b > 0.0 else 0.0)
        rate = m0 * ux + m1 * uy
        for t in (near, far):
            if 0.0 <= t < ranges[i] and low <= s + t * rate <= high:
                ranges[i] = t
                break
