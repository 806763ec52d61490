"""Static and moving hits, distinguished by a grid of when each cell was first and last hit, and seen free.

A hit is moving if its cell was seen free before and the same holds for the hit of a neighbouring beam (a tip or a post
thinner than the beam spacing is hit only now and then). It is static if a cell at or beside it has been hit for long
enough without being seen free in between. Before either is known, a hit is static if it is part of a surface that is
wider than any dynamic obstacle, or of one that is known to be static elsewhere: as the robot drives by, more and more
of it comes into view.

A static object may start at any time, unless it is too large to move: the grid also remembers where such large
surfaces were seen.
"""

import math

import numpy as np
from numba import njit
from numba.extending import register_jitable

from drake_starnav.geometry.compiled import leaf
from drake_starnav.lidar.laser_scan import DYNAMIC, STATIC, UNKNOWN, LaserScan
from drake_starnav.tracking.parameters import DynamicObstacleParameters
from drake_starnav.tracking.surfaces import joined, runs, scan_chord
from drake_starnav.utils.snapshot import snapshot

CELL = 0.05
"""Size of a cell, m; cell (i, j) of W spans [i, i+1) x [j, j+1) cells."""
REACH = 6.0
"""Half the side of the grid about the robot, m."""
RECENTRED = 1.0
"""The grid follows the robot when it is this far from the grid's middle, m."""
SQUARE = 8
"""Cells along a square of the grid that is seen through as a whole, or not; a power of two."""
NEVER = -1.0
RANGE_SLACK = 0.05
"""A cell is seen free if it ends by this much before all beams near it do, m."""
STANDING_AFTER = 2.0
HIT_SHARE = 0.5
"""A cell hit for this long, s, counts as static if its first and last hit are at least this share of it apart."""
_BESIDE = np.indices((3, 3)).reshape(2, 9) - 1  # rows and columns of a cell and its neighbours, from its own


@snapshot
class OccupancyHistory:
    """When the cells around the robot were hit and seen free. Immutable.

    Attributes:
        first: cell (i, j) of W in which the arrays begin, shape (2,).
        first_hit: time of the first hit since it was last seen free, shape (n, n), s; NEVER without one.
        last_hit, seen_free: time of the last, shape (n, n), s; NEVER.
        large: time of the last hit on a surface too large to move, since it was last seen free, shape (n, n), s; NEVER.
    """

    first: np.ndarray
    first_hit: np.ndarray
    last_hit: np.ndarray
    seen_free: np.ndarray
    large: np.ndarray

    @staticmethod
    def about(position: np.ndarray) -> "OccupancyHistory":
        """An empty grid about a place (2,) in W, m."""
        n = 2 * math.ceil(REACH / CELL)
        first = np.floor(np.asarray(position) / CELL).astype(np.int64) - n // 2
        empty = np.full((n, n), NEVER)
        return OccupancyHistory(first, empty, empty, empty, empty)

    def following(self, position: np.ndarray) -> "OccupancyHistory":
        """This grid, moved by whole cells if the place (2,) in W, m, is far from its middle."""
        n = len(self.first_hit)
        wanted = np.floor(np.asarray(position) / CELL).astype(np.int64) - n // 2
        shift = wanted - self.first
        if np.abs(shift).max() * CELL < RECENTRED:
            return self
        before = (self.first_hit, self.last_hit, self.seen_free, self.large)
        arrays = [_shifted(array, *shift) for array in before]
        return OccupancyHistory(wanted, *arrays)

    def classified(
        self, scan: LaserScan, pose: np.ndarray, parameters: DynamicObstacleParameters
    ) -> tuple[np.ndarray, np.ndarray]:
        """What each beam of a scan at a pose (x, y, yaw) of S in W hit, judged by the earlier scans, shape (n,), int.

        It is STATIC, also without a hit or outside the grid, UNKNOWN or DYNAMIC. The second array says which beams hit
        what has come here, shape (n,), bool: what is DYNAMIC, and what stands by now, or creeps.
        """
        beams, i, j = self._cells_hit(scan, pose, border=1)
        stands, freed = scan.hits.copy(), np.zeros(len(scan.hits), bool)
        near = i[:, None] + _BESIDE[0], j[:, None] + _BESIDE[1]
        stands[beams] = _stands(self.first_hit[near], self.last_hit[near], scan.time).any(axis=1)
        freed[beams] = self.seen_free[i, j] >= 0.0
        widest = 2.0 * parameters.max_radius
        static = _on_static_surface(scan, widest, stands)
        dynamic, came = _in_pairs(freed & ~stands), _in_pairs(freed)
        unknown = scan.hits & ~stands & (freed | ~static)
        return np.where(dynamic, DYNAMIC, np.where(unknown, UNKNOWN, STATIC)), came

    def may_start(self, scan: LaserScan, pose: np.ndarray, large: np.ndarray) -> np.ndarray:
        """Which hits are on objects that could move, whether or not they do, shape (n,), bool.

        `large` are those on a surface that is too large to move, shape (n,); other arguments as for `classified`.
        """
        beams, i, j = self._cells_hit(scan, pose, border=1)
        may_start = scan.hits & ~large
        may_start[beams] &= (self.large[i[:, None] + _BESIDE[0], j[:, None] + _BESIDE[1]] < 0.0).all(axis=1)
        return may_start

    def walls(self, time: float) -> np.ndarray:
        """Centres of the cells that at a time (s) have been occupied for STANDING_AFTER, shape (n, 2), W, m."""
        return (_standing_cells(self.first_hit, self.last_hit, time) + self.first + 0.5) * CELL

    def updated(self, scan: LaserScan, pose: np.ndarray, large: np.ndarray) -> "OccupancyHistory":
        """The grid with one more scan; arguments as for `may_start`."""
        grid = self.following(pose[:2])
        first_hit, last_hit, seen_free, seen_large = (
            array.copy() for array in (grid.first_hit, grid.last_hit, grid.seen_free, grid.large)
        )
        distance = np.where(scan.lost, 0.0, scan.distances)
        beams = scan.angle_min + pose[2], scan.angle_increment, scan.full_circle
        free = _seen_through(grid.first, len(first_hit), pose[0], pose[1], beams, distance)
        _forget_hits(free, scan.time, seen_free, first_hit, seen_large)
        hit, i, j = grid._cells_hit(scan, pose, border=0)
        first_hit[i, j] = np.where(first_hit[i, j] < 0.0, scan.time, first_hit[i, j])
        last_hit[i, j] = scan.time
        seen_large[i[large[hit]], j[large[hit]]] = scan.time
        return OccupancyHistory(grid.first, first_hit, last_hit, seen_free, seen_large)

    def _cells_hit(self, scan: LaserScan, pose: np.ndarray, border: int) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
        """Which beams hit cells of the grid, but for so wide a border, and rows and columns of these, each (k,)."""
        cells = np.floor(scan.points(pose) / CELL).astype(np.int64) - self.first
        inside = ((cells >= border) & (cells < len(self.first_hit) - border)).all(axis=1)
        return np.flatnonzero(scan.hits)[inside], cells[inside, 0], cells[inside, 1]


def _in_pairs(beams: np.ndarray) -> np.ndarray:
    """Which of some beams have a neighbour among them, shape (n,), bool."""
    return beams & (np.roll(beams, 1) | np.roll(beams, -1))


def _shifted(array: np.ndarray, di: int, dj: int) -> np.ndarray:
    n = len(array)
    out = np.full((n, n), NEVER)
    if abs(di) < n and abs(dj) < n:
        i, j = max(di, 0), max(dj, 0)
        kept = array[i : n + min(di, 0), j : n + min(dj, 0)]
        out[i - di : i - di + kept.shape[0], j - dj : j - dj + kept.shape[1]] = kept
    return out


def _on_static_surface(scan: LaserScan, width: float, stands: np.ndarray) -> np.ndarray:
    """Which hits are part of a run of connected ones that is wider than `width`, or of which one certainly `stands`."""
    out = np.zeros(len(scan.hits), bool)
    continues = joined(scan.distances, scan.hits, scan.angle_increment, scan.full_circle)
    for run in runs(scan.hits, continues):
        out[run] = continues.all() or scan_chord(scan, run) > width or stands[run].any()
    return out


@register_jitable
def _stands(first_hit, last_hit, time):
    """Which cells have been occupied for long enough; of arrays, or in compiled code of one cell."""
    return (
        (first_hit >= 0.0) & (time - first_hit >= STANDING_AFTER) & (last_hit - first_hit >= HIT_SHARE * STANDING_AFTER)
    )


@njit(cache=True)
def _standing_cells(first_hit, last_hit, time):
    """Rows and columns of the cells that `_stands` tells of, shape (k, 2)."""
    n = len(first_hit)
    cells, k = np.empty((n * n, 2), np.int64), 0
    for i in range(n):
        for j in range(n):
            if _stands(first_hit[i, j], last_hit[i, j], time):
                cells[k, 0], cells[k, 1] = i, j
                k += 1
    return cells[:k].copy()


@njit(cache=True)
def _forget_hits(free, time, seen_free, first_hit, large):
    """Note in grids that some cells (n, n) are free at a time, s."""
    for i in range(len(free)):
        for j in range(len(free)):
            if free[i, j]:
                seen_free[i, j], first_hit[i, j], large[i, j] = time, NEVER, NEVER


@njit(cache=True, error_model="numpy")
def _extremes(distance):
    """Least and greatest distance of 2^k beams from each on, of two turns, shape (2, levels, 2 n)."""
    n, levels = len(distance), 1
    while 1 << levels <= n:
        levels += 1
    table = np.empty((2, levels, 2 * n))
    for i in range(2 * n):
        table[0, 0, i] = table[1, 0, i] = distance[i % n]
    for k in range(1, levels):
        half = 1 << (k - 1)
        for i in range(2 * n):
            j = min(i + half, 2 * n - 1)
            table[0, k, i] = min(table[0, k - 1, i], table[0, k - 1, j])
            table[1, k, i] = max(table[1, k - 1, i], table[1, k - 1, j])
    return table


@leaf
def _extremes_of(table, first, last):
    """The least and greatest distance of the beams from `first` to `last`, which may lie in the turns beside."""
    n, k = table.shape[2] // 2, 0
    if last - first >= n:
        first, last = 0, n - 1
    length = last - first + 1
    first %= n
    while 2 << k <= length:
        k += 1
    other = first + length - (1 << k)
    return min(table[0, k, first], table[0, k, other]), max(table[1, k, first], table[1, k, other])


@njit(cache=True, error_model="numpy")
def _seen_through(origin, cells, x, y, beams, distance):
    """Which cells of a square grid all beams near them pass, shape (cells, cells), bool.

    Squares of cells whose beams all end before them, or all beyond, are not looked at cell by cell.

    Args:
        origin: first cell of the grid, shape (2,).
        cells: along a side.
        x, y: of the sensor, m.
        beams: bearing of the first one in the grid's frame and the step, rad, and whether they are a full circle.
        distance: up to which each sees, shape (n,), m.
    """
    bearing_0, increment, wrap = beams
    n, table = len(distance), _extremes(distance)
    through = np.zeros((cells, cells), np.bool_)
    half = 0.5 * math.sqrt(2.0) * CELL
    squares, waiting = np.empty((cells * cells // SQUARE + 4 * SQUARE, 3), np.int64), 0
    for i in range(0, cells, SQUARE):
        for j in range(0, cells, SQUARE):
            squares[waiting, 0], squares[waiting, 1], squares[waiting, 2] = i, j, SQUARE
            waiting += 1
    while waiting > 0:
        waiting -= 1
        i, j, side = squares[waiting, 0], squares[waiting, 1], squares[waiting, 2]
        dx, dy = (i + origin[0] + 0.5 * side) * CELL - x, (j + origin[1] + 0.5 * side) * CELL - y
        r, spread = math.sqrt(dx * dx + dy * dy), (side - 1) * half
        middle = ((math.atan2(dy, dx) - bearing_0) % (2.0 * math.pi)) / increment
        # no beam that passes through the cell, nor the one beside it, may end before the cell does
        width = math.asin(min(half / max(r - spread, half), 1.0)) / increment + 1.0
        if side > 1:
            width += math.asin(min(spread / max(r, spread), 1.0)) / increment + 1.0
        first, last = int(math.floor(middle - width)), int(math.ceil(middle + width))
        least, most = _extremes_of(table, first, last)
        known = wrap or (first >= 0 and last < n) or (side == 1 and last - first >= n)
        ends = r + half + RANGE_SLACK
        if side == 1:
            through[i, j] = known and least > ends
        elif known and least > ends + spread + 1e-9:
            for a in range(i, min(i + side, cells)):
                for b in range(j, min(j + side, cells)):
                    through[a, b] = True
        elif not known or most > ends - spread - 1e-9:
            for k in range(4):
                a, b = i + k // 2 * (side // 2), j + k % 2 * (side // 2)
                if a < cells and b < cells:
                    squares[waiting, 0], squares[waiting, 1], squares[waiting, 2] = a, b, side // 2
                    waiting += 1
    return through
