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

from drake_starnav.geometry.compiled import kernel, leaf, put
from drake_starnav.lidar.laser_scan import DYNAMIC, STATIC, UNKNOWN, LaserScan
from drake_starnav.moving.parameters import DynamicObstacleParameters
from drake_starnav.moving.surfaces import find_continuing, find_runs, measure_chords
from drake_starnav.utils.snapshot import snapshot

CELL = 0.05
"""Size of a cell, m; cell (i, j) of W spans [i, i+1) x [j, j+1) cells."""
WIDEST_REACH = 11.0
"""The grid reaches as far from the robot as the lidar does, but no farther than this, m."""
RECENTRED_WITHIN = 1.0
"""The grid follows the robot when it is this far from the grid's middle, m."""
HALF_DIAGONAL = 0.5 * math.sqrt(2.0) * CELL
"""Of a cell, m."""
NEIGHBOURHOOD = np.indices((3, 3)).reshape(2, 9) - 1
"""Offsets, rows and columns, of a cell and its eight neighbours."""
SQUARE = 8
"""Cells along a square of the grid that is seen through as a whole, or not; a power of two."""
NEVER = -1.0
RANGE_SLACK = 0.05
"""A cell is seen free if it ends by this much before all beams near it do, m."""
STANDING_AFTER = 2.0
HIT_SHARE = 0.5
"""A cell hit for this long, s, counts as static if its first and last hit are at least this share of it apart."""


class BeamMotion(NamedTuple):
    """What `OccupancyHistory` tells of the beams of a scan, each of shape (n,).

    Attributes:
        motion: STATIC, also without a hit, UNKNOWN or DYNAMIC.
        newly_occupied: whether each hit what has come here, bool: what is DYNAMIC, and what stands by now, or creeps.
        may_start: whether each hit what could move, whether or not it does, bool.
    """

    motion: np.ndarray
    newly_occupied: np.ndarray
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
    def make_around(position: np.ndarray, range_max: float) -> "OccupancyHistory":
        """An empty grid about a place (2,) in W, m, for a lidar of this range, m."""
        n = 2 * math.ceil(min(range_max + RECENTRED_WITHIN, WIDEST_REACH) / CELL)
        first_cell = np.floor(np.asarray(position) / CELL).astype(np.int64) - n // 2
        never, nowhere = np.full((n, n), NEVER), np.zeros((n, n), bool)
        return OccupancyHistory(first_cell, never, never, nowhere, nowhere)

    def follow_robot(self, position: np.ndarray) -> "OccupancyHistory":
        """This grid, moved by whole cells if the place (2,) in W, m, is far from its middle."""
        n = len(self.first_hit)
        next_first = np.floor(np.asarray(position) / CELL).astype(np.int64) - n // 2
        shift = next_first - self.first
        if np.abs(shift).max() * CELL < RECENTRED_WITHIN:
            return self
        hit_times = [_shift_cells(array, NEVER, *shift) for array in (self.first_hit, self.last_hit)]
        return OccupancyHistory(
            next_first, *hit_times, *(_shift_cells(array, False, *shift) for array in (self.seen_free, self.large))
        )

    def classify_beams(
        self, scan: LaserScan, pose: np.ndarray, on_large_surface: np.ndarray, parameters: DynamicObstacleParameters
    ) -> BeamMotion:
        """What the beams of a scan at a pose (x, y, yaw) of S in W hit, judged by the earlier scans.

        `on_large_surface` are those on a surface that is too large to move, shape (n,).
        """
        is_hit, cells = scan.hits, self._find_hit_cells(scan, pose)
        is_standing, was_free, may_start = np.zeros_like(is_hit), np.zeros_like(is_hit), is_hit & ~on_large_surface
        is_inside = self._are_inside(cells, border=1) & is_hit
        rows, columns = cells[is_inside].T
        was_free[is_inside] = self.seen_free[rows, columns]
        nearby = rows[:, None] + NEIGHBOURHOOD[0], columns[:, None] + NEIGHBOURHOOD[1]
        is_standing[is_inside] = _are_standing(self.first_hit[nearby], self.last_hit[nearby], scan.time).any(axis=1)
        may_start[is_inside] &= ~self.large[nearby].any(axis=1)
        is_static = _find_static_surfaces(scan, is_standing, is_inside, 2.0 * parameters.max_radius)
        is_static |= on_large_surface  # outside the grid nothing else is evidence
        moves = was_free & ~is_standing
        is_unknown = is_hit & ~is_standing & (was_free | ~is_static)
        motion = np.where(moves & _has_neighbour(moves), DYNAMIC, np.where(is_unknown, UNKNOWN, STATIC))
        return BeamMotion(motion, was_free & _has_neighbour(was_free), may_start)

    def find_walls(self, time: float, places: np.ndarray, farthest_distances: np.ndarray) -> np.ndarray:
        """Return the centres of cells that at a time (s) have been occupied for STANDING_AFTER, shape (n, 2), W, m.

        All that are within reach (k,) of places (k, 2), m, are among them.
        """
        reach, last_index = farthest_distances[:, None], len(self.first_hit) - 1
        begin = (np.floor((places - reach) / CELL).astype(np.int64) - self.first).min(axis=0, initial=last_index)
        end = (np.floor((places + reach) / CELL).astype(np.int64) - self.first).max(axis=0, initial=0)
        begin = np.maximum(begin, 0)
        near = tuple(map(slice, begin, np.minimum(end, last_index) + 1))
        standing_cells = np.argwhere(_are_standing(self.first_hit[near], self.last_hit[near], time))
        return (standing_cells + begin + self.first + 0.5) * CELL

    def add_scan(self, scan: LaserScan, pose: np.ndarray, on_large_surface: np.ndarray) -> "OccupancyHistory":
        """The grid with one more scan; arguments as for `classify_beams`."""
        grid = self.follow_robot(pose[:2])
        first_hit, last_hit, seen_free, large = (
            array.copy() for array in (grid.first_hit, grid.last_hit, grid.seen_free, grid.large)
        )
        free_ranges = _make_extremes(np.where(scan.lost, 0.0, scan.distances))
        view = scan.field_of_view._replace(angle_min=scan.angle_min + float(pose[2]))
        _note_free_cells(
            first_hit, seen_free, large, grid.first, np.array(pose[:2]), view, scan.full_circle, free_ranges
        )
        cells = grid._find_hit_cells(scan, pose)
        is_inside = grid._are_inside(cells) & scan.hits
        hit_cells = tuple(cells[is_inside].T)
        last_hit[hit_cells] = scan.time
        first_hit[hit_cells] = np.where(first_hit[hit_cells] < 0.0, scan.time, first_hit[hit_cells])
        large[tuple(cells[is_inside & on_large_surface].T)] = True  # of several hits in a cell, any
        return OccupancyHistory(grid.first, first_hit, last_hit, seen_free, large)

    def _find_hit_cells(self, scan: LaserScan, pose: np.ndarray) -> np.ndarray:
        """Return row and column of the cell in which each beam ends, shape (n, 2)."""
        end_points = scan.points_at(scan.distances, np.ones(len(scan.ranges), bool), pose)
        return np.floor(end_points / CELL).astype(np.int64) - self.first

    def _are_inside(self, cells: np.ndarray, border: int = 0) -> np.ndarray:
        """Return which cells (n, 2) are of the grid without a border of this many cells, shape (n,)."""
        return np.all((border <= cells) & (cells < len(self.first_hit) - border), axis=1)


def _find_static_surfaces(scan: LaserScan, is_standing: np.ndarray, is_inside: np.ndarray, width: float) -> np.ndarray:
    """Return which beams hit a surface of which a part certainly stands, or, inside the grid, that is too wide."""
    is_static, n = np.zeros(len(is_standing), bool), len(is_standing)
    continues_surface = find_continuing(scan, scan.hits)
    runs = find_runs(scan.hits, continues_surface)
    for (first_beam, beam_count), chord in zip(runs.tolist(), measure_chords(scan, runs), strict=True):
        beams = (first_beam + np.arange(beam_count)) % n
        if is_standing[beams].any():
            is_static[beams] = True
        elif (beam_count == n and continues_surface[first_beam]) or chord > width:
            is_static[beams] = is_inside[beams]
    return is_static


def _has_neighbour(is_chosen: np.ndarray) -> np.ndarray:
    """Return whether a beam beside is chosen, of all of a scan, (n,): an obstacle is hit by two beams at least."""
    return np.roll(is_chosen, 1) | np.roll(is_chosen, -1)


def _shift_cells(array: np.ndarray, empty_value: float, di: int, dj: int) -> np.ndarray:
    n = len(array)
    shifted_cells = np.full((n, n), empty_value, array.dtype)
    if abs(di) < n and abs(dj) < n:
        i, j = max(di, 0), max(dj, 0)
        overlap = array[i : n + min(di, 0), j : n + min(dj, 0)]
        shifted_cells[i - di : i - di + overlap.shape[0], j - dj : j - dj + overlap.shape[1]] = overlap
    return shifted_cells


def _are_standing(first_hit: np.ndarray, last_hit: np.ndarray, time: float) -> np.ndarray:
    """Return whether cells have been occupied for long enough."""
    age, hit_span = time - first_hit, last_hit - first_hit
    return (first_hit >= 0.0) & (age >= STANDING_AFTER) & (hit_span >= HIT_SHARE * STANDING_AFTER)


def _make_extremes(distance: np.ndarray) -> np.ndarray:
    """Return least and greatest distance of 2^k beams from each on, of two turns, shape (2, levels, 2 n)."""
    n = len(distance)
    table = np.empty((2, n.bit_length(), 2 * n))
    table[:, 0] = np.tile(distance, 2)
    for k in range(1, table.shape[1]):
        half = 1 << (k - 1)
        for extremum, values in ((np.minimum, table[0]), (np.maximum, table[1])):
            extremum(values[k - 1, :-half], values[k - 1, half:], out=values[k, :-half])
            extremum(values[k - 1, -half:], values[k - 1, -1], out=values[k, -half:])
    return table


@leaf
def _find_extremes(table, first, last):
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
def _is_known_free(first_hit, seen_free, large, i, j, side):
    """Return whether all cells of the square at (i, j) are known to be free, as they were seen last."""
    for a in range(i, min(i + side, len(first_hit))):
        for b in range(j, min(j + side, len(first_hit))):
            if not seen_free[a, b] or first_hit[a, b] >= 0.0 or large[a, b]:
                return False
    return True


@kernel
def _note_free_cells(first_hit, seen_free, large, origin, sensor, view, is_full_circle, extremes):
    """Note in square grids which cells all beams near them pass: those are free now.

    Squares of cells whose beams all end before them, or all beyond, are not looked at cell by cell, nor what is free
    anyway.

    Args:
        first_hit, seen_free, large: changed in place.
        origin: first cell of the grids, shape (2,).
        sensor: its place in the grids' frame, shape (2,), m.
        view: `FieldOfView` of the scan, of bearings in the grids' frame.
        is_full_circle: whether it is all around.
        extremes: as from `_make_extremes`, of the distance up to which each beam sees, m.
    """
    cells, square_count = len(first_hit), 0
    squares = np.empty((cells * cells // SQUARE + 4 * SQUARE, 3), np.int64)  # a list would take half as long again
    for i in range(0, cells, SQUARE):
        for j in range(0, cells, SQUARE):
            put(squares, square_count, (i, j, SQUARE))
            square_count += 1
    while square_count > 0:
        square_count -= 1
        i, j, side = squares[square_count]
        if _is_known_free(first_hit, seen_free, large, i, j, side):
            continue
        dx, dy = (i + origin[0] + 0.5 * side) * CELL - sensor[0], (j + origin[1] + 0.5 * side) * CELL - sensor[1]
        r, spread = math.sqrt(dx * dx + dy * dy), (side - 1) * HALF_DIAGONAL
        first_beam, last_beam = _find_beams_beside(dx, dy, r, spread, view)
        least_distance, greatest_distance = _find_extremes(extremes, first_beam, last_beam)
        is_looked_at = is_full_circle or (first_beam >= 0 and last_beam < view.beams)
        is_looked_at = is_looked_at or (side == 1 and last_beam - first_beam >= view.beams)
        needed_distance = r + HALF_DIAGONAL + RANGE_SLACK
        if is_looked_at and least_distance > (needed_distance if side == 1 else needed_distance + spread + 1e-9):
            for a in range(i, min(i + side, cells)):
                for b in range(j, min(j + side, cells)):
                    seen_free[a, b], first_hit[a, b], large[a, b] = True, NEVER, False
        elif side > 1 and (not is_looked_at or greatest_distance > needed_distance - spread - 1e-9):
            for k in range(4):
                a, b = i + k // 2 * (side // 2), j + k % 2 * (side // 2)
                if a < cells and b < cells:
                    put(squares, square_count, (a, b, side // 2))
                    square_count += 1


@leaf
def _find_beams_beside(dx, dy, r, spread, view):
    """Return the first and the last of the beams of which none may end before a square does that all of them pass.

    That are those through its cells and those beside. Its middle is at (dx, dy), at a distance r, and the middles of
    its cells within `spread` from there, m. The numbers may lie in the turns beside.
    """
    turn_share = (math.atan2(dy, dx) - view.angle_min) / (2.0 * math.pi)
    middle_beam = (turn_share - math.floor(turn_share)) * (2.0 * math.pi / view.angle_increment)
    half_width = math.asin(min(HALF_DIAGONAL / max(r - spread, HALF_DIAGONAL), 1.0)) / view.angle_increment + 1.0
    if spread > 0.0:
        half_width += math.asin(min(spread / max(r, spread), 1.0)) / view.angle_increment + 1.0
    return int(math.floor(middle_beam - half_width)), int(math.ceil(middle_beam + half_width))
