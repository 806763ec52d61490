"""Static and moving hits, distinguished by a grid of when each cell was first and last hit, and seen free.

A hit is moving if its cell was seen free before and the same holds for the hit of a neighbouring beam (a tip or a post
thinner than the beam spacing is hit only now and then). It is static if a cell at or beside it has been hit for long
enough without being seen free in between. Before either is known, a hit is static if it is part of a surface that is
wider than any dynamic obstacle, or of one that is known to be static elsewhere: as the robot drives by, more and more
of it comes into view. Outside the grid several obstacles may look like one wide surface: there only convex ones count.

A static object may start at any time, unless it is too large to move: the grid also remembers where such large
surfaces were seen. Its lengths are of persons and carts, whoever watches: nature.
"""

import math
from typing import NamedTuple

import numpy as np

from drake_starnav.geometry.compiled import kernel, leaf
from drake_starnav.lidar.laser_scan import DYNAMIC, HIT, LOST, STATIC, UNKNOWN, LaserScan, placed_ends
from drake_starnav.tracking.parameters import DynamicObstacleParameters
from drake_starnav.tracking.surfaces import continuing_beams, run_chord, runs
from drake_starnav.utils.snapshot import snapshot

CELL = 0.05
"""Size of a cell, m; cell (i, j) of W spans [i, i+1) x [j, j+1) cells."""
WIDEST_REACH = 11.0
"""The grid reaches as far from the robot as the lidar does, but no farther than this, m."""
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


class Judged(NamedTuple):
    """What `OccupancyHistory` tells of the beams of a scan, each of shape (n,).

    Attributes:
        motion: STATIC, also without a hit, UNKNOWN or DYNAMIC.
        came: whether each hit what has come here, bool: what is DYNAMIC, and what stands by now, or creeps.
        may_start: whether each hit what could move, whether or not it does, bool.
    """

    motion: np.ndarray
    came: np.ndarray
    may_start: np.ndarray


@snapshot
class OccupancyHistory:
    """When the cells around the robot were hit and seen free. Immutable.

    Attributes:
        first: cell (i, j) of W in which the arrays begin, shape (2,).
        first_hit: time of the first hit since it was last seen free, shape (n, n), s; NEVER without one.
        last_hit: time of the last, shape (n, n), s; NEVER.
        seen_free: whether it ever was, shape (n, n), bool.
        large: whether a surface too large to move was hit there since it was last seen free, shape (n, n), bool.
    """

    first: np.ndarray
    first_hit: np.ndarray
    last_hit: np.ndarray
    seen_free: np.ndarray
    large: np.ndarray

    @staticmethod
    def about(position: np.ndarray, range_max: float) -> "OccupancyHistory":
        """An empty grid about a place (2,) in W, m, for a lidar of this range, m."""
        n = 2 * math.ceil(min(range_max + RECENTRED, WIDEST_REACH) / CELL)
        first = np.floor(np.asarray(position) / CELL).astype(np.int64) - n // 2
        never, nowhere = np.full((n, n), NEVER), np.zeros((n, n), bool)
        return OccupancyHistory(first, never, never, nowhere, nowhere)

    def following(self, position: np.ndarray) -> "OccupancyHistory":
        """This grid, moved by whole cells if the place (2,) in W, m, is far from its middle."""
        n = len(self.first_hit)
        wanted = np.floor(np.asarray(position) / CELL).astype(np.int64) - n // 2
        shift = wanted - self.first
        if np.abs(shift).max() * CELL < RECENTRED:
            return self
        times = [_shifted(array, NEVER, *shift) for array in (self.first_hit, self.last_hit)]
        return OccupancyHistory(
            wanted, *times, *(_shifted(array, False, *shift) for array in (self.seen_free, self.large))
        )

    def judged(
        self, scan: LaserScan, pose: np.ndarray, large: np.ndarray, parameters: DynamicObstacleParameters
    ) -> Judged:
        """What the beams of a scan at a pose (x, y, yaw) of S in W hit, judged by the earlier scans.

        `large` are those on a surface that is too large to move, shape (n,).
        """
        grids = self.first_hit, self.last_hit, self.seen_free, self.large
        return Judged(*_judged(grids, self._cells_hit(scan, pose), scan.beams, scan.time, large, parameters.max_radius))

    def updated(self, scan: LaserScan, pose: np.ndarray, large: np.ndarray) -> "OccupancyHistory":
        """The grid with one more scan; arguments as for `judged`."""
        grid = self.following(pose[:2])
        grids = [array.copy() for array in (grid.first_hit, grid.last_hit, grid.seen_free, grid.large)]
        place = float(pose[0]), float(pose[1]), scan.angle_min + float(pose[2])
        _note(tuple(grids), (grid.first, grid._cells_hit(scan, pose)), scan.beams, scan.time, place, large)
        return OccupancyHistory(grid.first, *grids)

    def _cells_hit(self, scan: LaserScan, pose: np.ndarray) -> np.ndarray:
        """Row and column of the cell that each beam hits, shape (n, 2); negative where it hits none."""
        return _cells_hit(scan.beams, float(pose[0]), float(pose[1]), float(pose[2]), self.first)


@kernel
def _cells_hit(beams, x, y, yaw, first):
    """The loop of `OccupancyHistory._cells_hit`."""
    everything = np.ones(len(beams.kinds), np.bool_)
    ends = placed_ends(beams.directions, beams.distances, everything, x, y, math.cos(yaw), math.sin(yaw))
    cells = np.full((len(ends), 2), -1)
    for k in range(len(ends)):
        if beams.kinds[k] & HIT:
            cells[k, 0] = math.floor(ends[k, 0] / CELL) - first[0]
            cells[k, 1] = math.floor(ends[k, 1] / CELL) - first[1]
    return cells


@leaf
def _inside(grid, cells, k, border):
    """Whether a beam hits a cell of a grid, without a border of this many cells."""
    return border <= min(cells[k, 0], cells[k, 1]) and max(cells[k, 0], cells[k, 1]) < len(grid) - border


@kernel
def _judged(grids, cells, beams, time, large, most):
    """The loop of `OccupancyHistory.judged`; `most` is the radius of the largest obstacle that moves, m."""
    first_hit, last_hit, seen_free, seen_large = grids
    n, hits = len(cells), beams.kinds & HIT != 0
    stands, freed, may_start = np.zeros(n, np.bool_), np.zeros(n, np.bool_), hits & ~large
    static = large.copy()  # outside the grid nothing else is evidence
    for k in range(n):
        if not _inside(first_hit, cells, k, 1):
            continue
        i, j = cells[k]
        freed[k] = seen_free[i, j]
        for a in range(i - 1, i + 2):
            for b in range(j - 1, j + 2):
                stands[k] |= _stands(first_hit[a, b], last_hit[a, b], time)
                may_start[k] &= not seen_large[a, b]
    continues = continuing_beams(beams, hits)
    for first, count in runs(hits, continues):  # static if too wide, all around, or if some of it certainly stands
        run = (first + np.arange(count)) % n
        chord = run_chord(beams.distances, beams.increment, first, count)
        if stands[run].any():
            static[run] = True
        elif (count == n and continues[first]) or chord > 2.0 * most:
            for k in run:
                static[k] |= _inside(first_hit, cells, k, 1)
    motion, came = np.full(n, STATIC), np.zeros(n, np.bool_)
    for k in range(n):
        before, after = k - 1, k + 1 if k + 1 < n else 0  # an obstacle is hit by two beams at least
        came[k] = freed[k] and (freed[before] or freed[after])
        moves = (freed[before] and not stands[before]) or (freed[after] and not stands[after])
        if freed[k] and not stands[k] and moves:
            motion[k] = DYNAMIC
        elif hits[k] and not stands[k] and (freed[k] or not static[k]):
            motion[k] = UNKNOWN
    return motion, came, may_start


@kernel
def _note(grids, places, beams, time, place, large):
    """Note in grids of first and last hits, when seen free, and large surfaces, what a scan shows at a time, s.

    Args:
        grids: four, changed in place.
        places: the grid's first cell, and the cell that each beam hits.
        beams: of the scan.
        time: s.
        place: x, y and the bearing of the first beam, in W.
        large: which beams hit a large surface.
    """
    (first_hit, last_hit, seen_free, seen_large), (origin, cells), (x, y, bearing) = grids, places, place
    distance = np.where(beams.kinds & LOST != 0, 0.0, beams.distances)
    _free(first_hit, seen_free, seen_large, (origin, x, y), (bearing, beams.increment, beams.seam < np.inf), distance)
    for k in range(len(cells)):
        if _inside(first_hit, cells, k, 0):
            i, j = cells[k]
            last_hit[i, j] = time
            if first_hit[i, j] < 0.0:
                first_hit[i, j] = time
            if large[k]:
                seen_large[i, j] = True


def _shifted(array: np.ndarray, empty: float, di: int, dj: int) -> np.ndarray:
    n = len(array)
    out = np.full((n, n), empty, array.dtype)
    if abs(di) < n and abs(dj) < n:
        i, j = max(di, 0), max(dj, 0)
        kept = array[i : n + min(di, 0), j : n + min(dj, 0)]
        out[i - di : i - di + kept.shape[0], j - dj : j - dj + kept.shape[1]] = kept
    return out


@leaf
def _stands(first_hit, last_hit, time):
    """Whether a cell has been occupied for long enough."""
    since, lasted = time - first_hit, last_hit - first_hit
    return first_hit >= 0.0 and since >= STANDING_AFTER and lasted >= HIT_SHARE * STANDING_AFTER


@kernel
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
    if first < 0:
        first += n
    while 2 << k <= length:
        k += 1
    other = first + length - (1 << k)
    return min(table[0, k, first], table[0, k, other]), max(table[1, k, first], table[1, k, other])


@leaf
def _settled(first_hit, seen_free, large, square):
    """Whether all cells of a square (i, j, side) are known to be free, as they were seen last."""
    i, j, side = square
    for a in range(i, min(i + side, len(first_hit))):
        for b in range(j, min(j + side, len(first_hit))):
            if not seen_free[a, b] or first_hit[a, b] >= 0.0 or large[a, b]:
                return False
    return True


@kernel
def _free(first_hit, seen_free, large, place, beams, distance):
    """Note in square grids which cells all beams near them pass: those are free now.

    Squares of cells whose beams all end before them, or all beyond, are not looked at cell by cell, nor what is free
    anyway.

    Args:
        first_hit, seen_free, large: changed in place.
        place: first cell of the grids, shape (2,), and x, y of the sensor, m.
        beams: bearing of the first one in the grids' frame and the step, rad, and whether they are a full circle.
        distance: up to which each sees, shape (n,), m.
    """
    (origin, x, y), (bearing_0, increment, wrap), cells = place, beams, len(first_hit)
    n, table = len(distance), _extremes(distance)
    half, turn_beams = 0.5 * math.sqrt(2.0) * CELL, 2.0 * math.pi / increment
    squares, waiting = np.empty((cells * cells // SQUARE + 4 * SQUARE, 3), np.int64), 0
    for i in range(0, cells, SQUARE):
        for j in range(0, cells, SQUARE):
            squares[waiting, 0], squares[waiting, 1], squares[waiting, 2] = i, j, SQUARE
            waiting += 1
    while waiting > 0:
        waiting -= 1
        i, j, side = squares[waiting, 0], squares[waiting, 1], squares[waiting, 2]
        if _settled(first_hit, seen_free, large, (i, j, side)):
            continue
        dx, dy = (i + origin[0] + 0.5 * side) * CELL - x, (j + origin[1] + 0.5 * side) * CELL - y
        r, spread = math.sqrt(dx * dx + dy * dy), (side - 1) * half
        turn = (math.atan2(dy, dx) - bearing_0) / (2.0 * math.pi)
        middle = (turn - math.floor(turn)) * turn_beams
        # no beam that passes through the cell, nor the one beside it, may end before the cell does
        width = math.asin(min(half / max(r - spread, half), 1.0)) / increment + 1.0
        if side > 1:
            width += math.asin(min(spread / max(r, spread), 1.0)) / increment + 1.0
        first, last = int(math.floor(middle - width)), int(math.ceil(middle + width))
        least, most = _extremes_of(table, first, last)
        known = wrap or (first >= 0 and last < n) or (side == 1 and last - first >= n)
        ends = r + half + RANGE_SLACK
        if known and least > (ends if side == 1 else ends + spread + 1e-9):
            for a in range(i, min(i + side, cells)):
                for b in range(j, min(j + side, cells)):
                    seen_free[a, b], first_hit[a, b], large[a, b] = True, NEVER, False
        elif side > 1 and (not known or most > ends - spread - 1e-9):
            for k in range(4):
                a, b = i + k // 2 * (side // 2), j + k % 2 * (side // 2)
                if a < cells and b < cells:
                    squares[waiting, 0], squares[waiting, 1], squares[waiting, 2] = a, b, side // 2
                    waiting += 1
