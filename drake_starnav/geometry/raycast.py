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
Each shape is tested only against the beams whose bearings it can cover, and only shapes in grid cells within reach
are tested.
"""

import math
from typing import NamedTuple

import numpy as np
from numba import njit

from drake_starnav.errors import StarnavError
from drake_starnav.geometry.ray_kernels import CIRCLE, SEGMENT, cast_rows

COLUMNS = 14


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
    def regular(angle_min: float, increment: float, beams: int, clockwise: bool = False) -> "Fan":
        """Beams at equal steps of `increment` from `angle_min` on, rad."""
        angles = angle_min + increment * np.arange(beams)
        return Fan(float(angle_min), increment, np.column_stack((np.cos(angles), np.sin(angles))), clockwise)


class ShapeBins(NamedTuple):
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
        """One bin for each array of rows, in the given order."""
        starts = np.zeros(len(groups) + 1, dtype=np.int64)
        np.cumsum([len(group) for group in groups], out=starts[1:])
        return ShapeBins(np.vstack([*groups, np.zeros((0, COLUMNS))]), starts)

    @staticmethod
    def grid(rows: np.ndarray, cell: float) -> "ShapeBins":
        """Shapes by the grid cell of their centres; cells are hashed, so the grid is unbounded.

        Args:
            rows: shape (n, 14).
            cell: edge of a cell, m. Shapes of a larger radius go to a last bin that every cast tests.
        """
        buckets = 1
        while buckets < 2 * len(rows):
            buckets *= 2
        i, j = np.floor(rows[:, :2] / cell).astype(np.int64).T
        bucket = np.where(rows[:, 2] <= cell, _bucket(i, j, buckets), buckets)
        order = np.argsort(bucket, kind="stable")
        return ShapeBins(rows[order], np.searchsorted(bucket[order], np.arange(buckets + 2)), cell)


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


@njit(cache=True)
def cast_grid(bins, pose, fan, ranges, reach):
    """Shorten `ranges` to the first crossing with the shapes of a grid.

    Args:
        bins: made by `ShapeBins.grid`.
        pose: (x, y, yaw) of S in the frame of the shapes, shape (3,), m and rad.
        fan: the beams.
        ranges: shape (n,), m, changed in place; start from `+inf`.
        reach: shapes farther than this are ignored, m.

    Raises:
        StarnavError: the bins are not a grid.
    """
    if bins.cell <= 0.0:
        raise StarnavError("ray cast: the bins are no grid; allowed: bins made by ShapeBins.grid")
    place = pose[0], pose[1], math.cos(pose[2]), math.sin(pose[2])
    for first, last in _near_runs(bins, pose[0], pose[1], reach):
        cast_rows(bins.rows[first:last], place, fan, ranges, reach)


@njit(cache=True)
def _bucket(i, j, buckets):
    """The bucket of the grid cell (i, j)."""
    # Cells of one column i are consecutive; multiples of the golden ratio spread the columns evenly.
    return (i * (int(0.6180339887498949 * buckets) | 1) + j) & (buckets - 1)


@njit(cache=True)
def _near_runs(bins, x, y, reach):
    """The rows of a grid that may be within reach, as runs [first, last), shape (k, 2); a row may be in several."""
    starts, cell = bins.starts, bins.cell
    buckets = len(starts) - 2
    i0, i1 = math.floor((x - reach) / cell) - 1, math.floor((x + reach) / cell) + 1
    j0, j1 = math.floor((y - reach) / cell) - 1, math.floor((y + reach) / cell) + 1
    if (i1 - i0 + 1.0) * (j1 - j0 + 1.0) >= buckets:  # more cells than buckets: test every shape once
        return np.array([[0, starts[-1]]])
    runs = np.empty((2 * int(i1 - i0) + 3, 2), dtype=np.int64)
    runs[0, 0], runs[0, 1] = starts[buckets], starts[buckets + 1]
    count, length = 1, int(j1 - j0) + 1
    for i in range(int(i0), int(i1) + 1):
        begin = _bucket(i, int(j0), buckets)
        end = begin + length
        runs[count, 0], runs[count, 1] = starts[begin], starts[min(end, buckets)]
        count += 1
        if end > buckets:  # the column continues at the first bucket
            runs[count, 0], runs[count, 1] = 0, starts[end - buckets]
            count += 1
    return runs[:count]


@njit(cache=True)
def rows_near(bins, x, y, reach):
    """The rows of a grid that may lie within reach of a point, m; shape (k, 14)."""
    rows = bins.rows
    chosen = np.zeros(len(rows), dtype=np.bool_)
    for first, last in _near_runs(bins, x, y, reach):
        for i in range(first, last):
            chosen[i] = math.hypot(rows[i, 0] - x, rows[i, 1] - y) <= reach + rows[i, 2]
    return rows[chosen]


@njit(cache=True)
def cast_groups(bins, poses, fan, ranges, reach):
    """Shorten `ranges` to the first crossing with groups of shapes, each in its own frame.

    Args:
        bins: made by `ShapeBins.grouped`, g groups.
        poses: shape (g, 3): (x, y, yaw) of S in the frame of each group, m and rad.
        fan, ranges, reach: as in `cast_grid`.
    """
    for g in range(len(bins.starts) - 1):
        place = poses[g, 0], poses[g, 1], math.cos(poses[g, 2]), math.sin(poses[g, 2])
        cast_rows(bins.rows[bins.starts[g] : bins.starts[g + 1]], place, fan, ranges, reach)


@njit(cache=True)
def cast_rolling(bins, begin, end, fan, ranges, reach):
    """Shorten `ranges` to those of a rolling scan: beams measure one after the other while the sensor moves.

    Args:
        bins: made by `ShapeBins.grouped`, g groups.
        begin: shape (g, 3): (x, y, yaw) of S in the frame of each group one beam before the first beam, m and rad.
        end: the same at the last beam; in between, velocities are constant and yaw changes by at most half a turn.
        fan, ranges, reach: as in `cast_grid`.
    """
    beams = len(ranges)
    for g in range(len(bins.starts) - 1):
        rows = bins.rows[bins.starts[g] : bins.starts[g + 1]]
        turn = (end[g, 2] - begin[g, 2] + math.pi) % (2.0 * math.pi) - math.pi
        for i in range(beams):
            left = i / beams if fan.clockwise else 1.0 - (i + 1.0) / beams  # of the sweep, when this beam is measured
            x = end[g, 0] + left * (begin[g, 0] - end[g, 0])
            y = end[g, 1] + left * (begin[g, 1] - end[g, 1])
            yaw = end[g, 2] - left * turn
            place = x, y, math.cos(yaw), math.sin(yaw)
            beam = Fan(fan.angle_min + i * fan.increment, fan.increment, fan.directions[i : i + 1], fan.clockwise)
            cast_rows(rows, place, beam, ranges[i : i + 1], reach)
