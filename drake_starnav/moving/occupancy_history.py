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
from drake_starnav.lidar.laser_scan import DYNAMIC, HIT, LOST, STATIC, UNKNOWN, LaserScan, place_ends
from drake_starnav.moving.parameters import DynamicObstacleParameters
from drake_starnav.moving.surfaces import find_continuing_beams, find_runs, measure_chord
from drake_starnav.utils.snapshot import snapshot

CELL = 0.05
"""Size of a cell, m; cell (i, j) of W spans [i, i+1) x [j, j+1) cells."""
WIDEST_REACH = 11.0
"""The grid reaches as far from the robot as the lidar does, but no farther than this, m."""
RECENTRED_WITHIN = 1.0
"""The grid follows the robot when it is this far from the grid's middle, m."""
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
        grids = self.first_hit, self.last_hit, self.seen_free, self.large
        return BeamMotion(
            *_classify_beams(
                grids, self._find_hit_cells(scan, pose), scan.beams, scan.time, on_large_surface, parameters.max_radius
            )
        )

    def find_walls(self, time: float, places: np.ndarray, farthest_distances: np.ndarray) -> np.ndarray:
        """Return the centres of cells that at a time (s) have been occupied for STANDING_AFTER, shape (n, 2), W, m.

        All that are within reach (k,) of places (k, 2), m, are among them.
        """
        return _find_standing_cells(self.first_hit, self.last_hit, time, self.first, places, farthest_distances)

    def add_scan(self, scan: LaserScan, pose: np.ndarray, on_large_surface: np.ndarray) -> "OccupancyHistory":
        """The grid with one more scan; arguments as for `classify_beams`."""
        grid = self.follow_robot(pose[:2])
        grids = [array.copy() for array in (grid.first_hit, grid.last_hit, grid.seen_free, grid.large)]
        first_beam = float(pose[0]), float(pose[1]), scan.angle_min + float(pose[2])
        cells = grid.first, grid._find_hit_cells(scan, pose)
        _note_scan(tuple(grids), cells, scan.beams, scan.time, first_beam, on_large_surface)
        return OccupancyHistory(grid.first, *grids)

    def _find_hit_cells(self, scan: LaserScan, pose: np.ndarray) -> np.ndarray:
        """Row and column of the cell that each beam hits, shape (n, 2); negative where it hits none."""
        return _find_hit_cells(scan.beams, float(pose[0]), float(pose[1]), float(pose[2]), self.first)


@kernel
def _find_hit_cells(beams, x, y, yaw, first_cell):
    """The loop of `OccupancyHistory._find_hit_cells`."""
    all_beams = np.ones(len(beams.kinds), np.bool_)
    end_points = place_ends(beams.directions, beams.distances, all_beams, x, y, math.cos(yaw), math.sin(yaw))
    hit_cells = np.full((len(end_points), 2), -1)
    for k in range(len(end_points)):
        if beams.kinds[k] & HIT:
            hit_cells[k, 0] = math.floor(end_points[k, 0] / CELL) - first_cell[0]
            hit_cells[k, 1] = math.floor(end_points[k, 1] / CELL) - first_cell[1]
    return hit_cells


@leaf
def _is_inside(grid, cells, k, border):
    """Whether a beam hits a cell of a grid, without a border of this many cells."""
    return border <= min(cells[k, 0], cells[k, 1]) and max(cells[k, 0], cells[k, 1]) < len(grid) - border


@kernel
def _classify_beams(grids, hit_cells, beams, time, on_large_surface, max_radius):
    """The loop of `OccupancyHistory.classify_beams`; `max_radius` is that of the largest obstacle that moves, m."""
    first_hit, last_hit, seen_free, seen_large = grids
    n, is_hit = len(hit_cells), beams.kinds & HIT != 0
    is_standing, was_free, may_start = np.zeros(n, np.bool_), np.zeros(n, np.bool_), is_hit & ~on_large_surface
    is_static = on_large_surface.copy()  # outside the grid nothing else is evidence
    for k in range(n):
        if not _is_inside(first_hit, hit_cells, k, 1):
            continue
        i, j = hit_cells[k]
        was_free[k] = seen_free[i, j]
        for a in range(i - 1, i + 2):
            for b in range(j - 1, j + 2):
                is_standing[k] |= _is_standing(first_hit[a, b], last_hit[a, b], time)
                may_start[k] &= not seen_large[a, b]
    continues_surface = find_continuing_beams(beams, is_hit)
    for first_beam, beam_count in find_runs(
        is_hit, continues_surface
    ):  # static if too wide, all around, or if some of it certainly stands
        run_beams = (first_beam + np.arange(beam_count)) % n
        chord = measure_chord(beams.distances, beams.increment, first_beam, beam_count)
        if is_standing[run_beams].any():
            is_static[run_beams] = True
        elif (beam_count == n and continues_surface[first_beam]) or chord > 2.0 * max_radius:
            for k in run_beams:
                is_static[k] |= _is_inside(first_hit, hit_cells, k, 1)
    motion, newly_occupied = np.full(n, STATIC), np.zeros(n, np.bool_)
    for k in range(n):
        previous_beam, next_beam = k - 1, k + 1 if k + 1 < n else 0  # an obstacle is hit by two beams at least
        newly_occupied[k] = was_free[k] and (was_free[previous_beam] or was_free[next_beam])
        neighbour_moves = (was_free[previous_beam] and not is_standing[previous_beam]) or (
            was_free[next_beam] and not is_standing[next_beam]
        )
        if was_free[k] and not is_standing[k] and neighbour_moves:
            motion[k] = DYNAMIC
        elif is_hit[k] and not is_standing[k] and (was_free[k] or not is_static[k]):
            motion[k] = UNKNOWN
    return motion, newly_occupied, may_start


@kernel
def _find_standing_cells(first_hit, last_hit, time, first_cell, places, reach):
    """The loop of `OccupancyHistory.find_walls`, over the cells near the places; `first_cell` is the grid's first
    cell."""
    begin_cell, end_cell, last_index = np.full(2, len(first_hit) - 1), np.zeros(2, np.int64), len(first_hit) - 1
    for k in range(len(places)):
        for i in range(2):
            begin_cell[i] = min(begin_cell[i], max(math.floor((places[k, i] - reach[k]) / CELL) - first_cell[i], 0))
            end_cell[i] = max(
                end_cell[i], min(math.floor((places[k, i] + reach[k]) / CELL) - first_cell[i], last_index)
            )
    centers, n = np.empty((max(end_cell[0] + 1 - begin_cell[0], 0) * max(end_cell[1] + 1 - begin_cell[1], 0), 2)), 0
    for i in range(begin_cell[0], end_cell[0] + 1):
        for j in range(begin_cell[1], end_cell[1] + 1):
            if _is_standing(first_hit[i, j], last_hit[i, j], time):
                put(centers, n, ((i + first_cell[0] + 0.5) * CELL, (j + first_cell[1] + 0.5) * CELL))
                n += 1
    return centers[:n].copy()


@kernel
def _note_scan(grids, cell_indices, beams, time, first_beam, on_large_surface):
    """Note in grids of first and last hits, when seen free, and large surfaces, what a scan shows at a time, s.

    Args:
        grids: four, changed in place.
        cell_indices: the grid's first cell, and the cell that each beam hits.
        beams: of the scan.
        time: s.
        first_beam: x, y and the bearing of the first beam, in W.
        on_large_surface: which beams hit a large surface.
    """
    (first_hit, last_hit, seen_free, seen_large), (origin, cells), (x, y, bearing) = grids, cell_indices, first_beam
    distance = np.where(beams.kinds & LOST != 0, 0.0, beams.distances)
    _note_free_cells(
        first_hit, seen_free, seen_large, (origin, x, y), (bearing, beams.increment, beams.seam < np.inf), distance
    )
    for k in range(len(cells)):
        if _is_inside(first_hit, cells, k, 0):
            i, j = cells[k]
            last_hit[i, j] = time
            if first_hit[i, j] < 0.0:
                first_hit[i, j] = time
            if on_large_surface[k]:
                seen_large[i, j] = True


def _shift_cells(array: np.ndarray, empty_value: float, di: int, dj: int) -> np.ndarray:
    n = len(array)
    shifted_cells = np.full((n, n), empty_value, array.dtype)
    if abs(di) < n and abs(dj) < n:
        i, j = max(di, 0), max(dj, 0)
        overlap = array[i : n + min(di, 0), j : n + min(dj, 0)]
        shifted_cells[i - di : i - di + overlap.shape[0], j - dj : j - dj + overlap.shape[1]] = overlap
    return shifted_cells


@leaf
def _is_standing(first_hit, last_hit, time):
    """Whether a cell has been occupied for long enough."""
    age, hit_span = time - first_hit, last_hit - first_hit
    return first_hit >= 0.0 and age >= STANDING_AFTER and hit_span >= HIT_SHARE * STANDING_AFTER


@kernel
def _make_extremes(distance):
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
def _is_known_free(first_hit, seen_free, large, square):
    """Whether all cells of a square (i, j, side) are known to be free, as they were seen last."""
    i, j, side = square
    for a in range(i, min(i + side, len(first_hit))):
        for b in range(j, min(j + side, len(first_hit))):
            if not seen_free[a, b] or first_hit[a, b] >= 0.0 or large[a, b]:
                return False
    return True


@kernel
def _note_free_cells(first_hit, seen_free, large, origin_and_sensor, beams, distance):
    """Note in square grids which cells all beams near them pass: those are free now.

    Squares of cells whose beams all end before them, or all beyond, are not looked at cell by cell, nor what is free
    anyway.

    Args:
        first_hit, seen_free, large: changed in place.
        origin_and_sensor: first cell of the grids, shape (2,), and x, y of the sensor, m.
        beams: bearing of the first one in the grids' frame and the step, rad, and whether they are a full circle.
        distance: up to which each sees, shape (n,), m.
    """
    (origin, x, y), (bearing_0, increment, is_full_circle), cells = origin_and_sensor, beams, len(first_hit)
    n, table = len(distance), _make_extremes(distance)
    half, turn_beams = 0.5 * math.sqrt(2.0) * CELL, 2.0 * math.pi / increment
    squares, square_count = np.empty((cells * cells // SQUARE + 4 * SQUARE, 3), np.int64), 0
    for i in range(0, cells, SQUARE):
        for j in range(0, cells, SQUARE):
            squares[square_count, 0], squares[square_count, 1], squares[square_count, 2] = i, j, SQUARE
            square_count += 1
    while square_count > 0:
        square_count -= 1
        i, j, side = squares[square_count, 0], squares[square_count, 1], squares[square_count, 2]
        if _is_known_free(first_hit, seen_free, large, (i, j, side)):
            continue
        dx, dy = (i + origin[0] + 0.5 * side) * CELL - x, (j + origin[1] + 0.5 * side) * CELL - y
        r, spread = math.sqrt(dx * dx + dy * dy), (side - 1) * half
        turn_share = (math.atan2(dy, dx) - bearing_0) / (2.0 * math.pi)
        middle_beam = (turn_share - math.floor(turn_share)) * turn_beams
        # no beam that passes through the cell, nor the one beside it, may end before the cell does
        half_width = math.asin(min(half / max(r - spread, half), 1.0)) / increment + 1.0
        if side > 1:
            half_width += math.asin(min(spread / max(r, spread), 1.0)) / increment + 1.0
        first_beam, last_beam = int(math.floor(middle_beam - half_width)), int(math.ceil(middle_beam + half_width))
        least_distance, greatest_distance = _find_extremes(table, first_beam, last_beam)
        is_looked_at = (
            is_full_circle or (first_beam >= 0 and last_beam < n) or (side == 1 and last_beam - first_beam >= n)
        )
        needed_distance = r + half + RANGE_SLACK
        if is_looked_at and least_distance > (needed_distance if side == 1 else needed_distance + spread + 1e-9):
            for a in range(i, min(i + side, cells)):
                for b in range(j, min(j + side, cells)):
                    seen_free[a, b], first_hit[a, b], large[a, b] = True, NEVER, False
        elif side > 1 and (not is_looked_at or greatest_distance > needed_distance - spread - 1e-9):
            for k in range(4):
                a, b = i + k // 2 * (side // 2), j + k % 2 * (side // 2)
                if a < cells and b < cells:
                    squares[square_count, 0], squares[square_count, 1], squares[square_count, 2] = a, b, side // 2
                    square_count += 1
