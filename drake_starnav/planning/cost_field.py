"""The optimistic cost-to-go: what the shortest way to the goal would cost if all unknown space were free."""

import math
from dataclasses import dataclass
from typing import NamedTuple

import numpy as np

from drake_starnav.geometry.compiled import kernel
from drake_starnav.planning.bucket_search import UNREACHED_COST, search_buckets
from drake_starnav.planning.grid import OFF, STRIDE, TILE, Grid
from drake_starnav.planning.roadmap import CLOSURE_RADIUS

NEAR_WALL_COST = 0.4
"""Additional cost of a metre right at an obstacle, as a multiple of its length: wide paths are preferred."""
TIGHT_COST = 8.0
"""Additional cost of a metre where a robot that is no disc only just fits, as a multiple of its length."""
UNCERTAIN_COST = 20.0
"""Additional cost of a metre where hits may only seem to leave no room, as a multiple of its length."""
UNKNOWN_COST = 0.3
"""Additional cost of a metre through the unknown, as a multiple of its length: it may be blocked."""
BLOCKED_SLACK = 0.04
"""Cells nearer to a hit than the robot's radius by this share of it still count as passable in the cost-to-go."""
SOFT_ZONE = 0.48
"""Beyond the robot's radius, over this distance, in radii, cells cost more, by up to NEAR_WALL_COST."""


@dataclass(frozen=True)
class CostField:
    """Length of the shortest path to the goal from every cell, as far as it was searched.

    Attributes:
        cost: shape (nx, ny) with a border, in hundredths of a cell, less UNREACHED_COST; 0 where blocked or not
            reached.
        weight: same shape, uint8, what crossing a cell costs in tenths; 0 where blocked.
        first_middle: middle of cell (1, 1), shape (2,), W, in cells: places do not depend on the box that is searched.
        cell: size of a cell, m.
        grid: the hits, which tell the freest place in a cell.
    """

    cost: np.ndarray
    weight: np.ndarray
    first_middle: np.ndarray
    cell: float
    grid: Grid

    def path(self, start: np.ndarray) -> np.ndarray:
        """Return the shortest path from near `start` (2,) to the goal, shape (k, 2), W, m, maybe without a point.

        One point a cell: its centre, or in a narrow place the centre of that cell of the grid of hits in it which is
        freest.
        """
        x, y = np.asarray(start) / self.cell - self.first_middle + 1.0
        middles = (self.first_middle + trace_path(self.cost, self.weight, x, y) - 1) * self.cell
        places, clear_distances = self.grid.coarse(middles)
        freest = places[np.arange(len(places)), clear_distances.argmax(axis=1)]
        return np.where((clear_distances.max(axis=1) > clear_distances.min(axis=1))[:, None], freest, middles)


class CostmapParams(NamedTuple):
    """Which cells the robot may cross, and at what cost.

    Attributes:
        cover_radius: cells nearer than this to a hit are blocked, m.
        failed_places: shape (k, 2), W, m: cells within CLOSURE_RADIUS of one are blocked.
        clearance_uncertainty: cells that hits block by no more than this are passable, at UNCERTAIN_COST, m.
        outer_radius: cells nearer than this, where the robot cannot turn, cost more, by up to TIGHT_COST, m.
    """

    cover_radius: float
    failed_places: np.ndarray = np.zeros((0, 2))
    clearance_uncertainty: float = 0.0
    outer_radius: float = 0.0


def compute_cost_to_go(
    grid: Grid,
    goal: np.ndarray,
    low: np.ndarray,
    high: np.ndarray,
    params: CostmapParams,
    source: np.ndarray | None = None,
) -> CostField:
    """Return the cost of the cheapest path to the goal if all unknown space were free.

    Args:
        grid: hits and coverage: cells in no region cost more by UNKNOWN_COST, unless there is no region at all.
        goal: shape (2,), W, m.
        low, high: corners of the box that is searched, W, m; it must contain the goal.
        params: which cells may be crossed.
        source: where the way begins, shape (2,), W, m: the search ends once its cost is known; None: the whole box is
            searched.

    Raises:
        StarnavError: the box has too many cells.
    """
    first_cell, cell_counts = grid.box(low, high)
    cell, first_middle = grid.resolution * STRIDE, first_cell + OFF
    weight = _weigh_cells(grid.arrays, first_cell, cell_counts, _find_clearance_limits(params), NEAR_WALL_COST)
    if grid.coverage.counts.size:
        _raise_unknown(weight, grid.coverage, first_cell, round(10.0 * UNKNOWN_COST))
    half_diagonal = math.hypot(0.5, 0.5) * grid.resolution  # a path is up to this far off its cells' centres
    closed_reach = CLOSURE_RADIUS * params.cover_radius + half_diagonal
    _close(weight, params.failed_places / cell - first_middle + 1.0, closed_reach / cell)
    cost = np.zeros(weight.shape, np.int32)
    goal_cell = np.clip(_find_cell(goal, cell, first_middle), 1, np.array(weight.shape) - 2)
    source_cell = np.full(2, -1) if source is None else _find_cell(source, cell, first_middle)
    search_buckets(weight, cost, tuple(goal_cell.tolist()), tuple(source_cell.tolist()))
    return CostField(cost, weight, first_middle, cell, grid)


def _find_cell(place: np.ndarray, cell: float, first_middle: np.ndarray) -> np.ndarray:
    """Return the indices (i, j) of the cell of a `CostField` that holds a place (2,), W, m."""
    return np.rint(place / cell - first_middle).astype(np.int64) + 1


class _ClearanceLimits(NamedTuple):
    """Distances to hits from which on a cell may be open, is open, is no longer near a wall, and is wide, m."""

    uncertain: float
    open: float
    soft: float
    wide: float


def _find_clearance_limits(params: CostmapParams) -> _ClearanceLimits:
    radius = params.cover_radius
    open_distance = radius - BLOCKED_SLACK * radius
    wide_distance = params.outer_radius if params.outer_radius > radius else 0.0  # of a disc nothing
    return _ClearanceLimits(
        open_distance - params.clearance_uncertainty, open_distance, radius + SOFT_ZONE * radius, wide_distance
    )


@kernel
def _weigh_cells(grid, first_cell, cell_counts, limits, near_wall_cost):
    """Return what crossing each cell costs in tenths, by the greatest distance in it; 0: blocked, as the border is.

    Args:
        grid: `Grid.arrays`. Where it has no tile, cells are wide.
        first_cell, cell_counts: as of `Grid.box`.
        limits: `_ClearanceLimits`.
        near_wall_cost: the constant; compiled code would keep its value.
    """
    tiles, rows, first_tile = grid.tiles, grid.rows, grid.first
    weight = np.zeros((cell_counts[0] + 2, cell_counts[1] + 2), np.uint8)
    tile_side = TILE // STRIDE
    widest = max(limits.soft, limits.wide)
    weight[1:-1, 1:-1] = 10
    for t in range(rows.shape[0]):
        for u in range(rows.shape[1]):
            if rows[t, u] < 0:
                continue
            tile = tiles[rows[t, u]]
            p, q = (first_tile[0] + t) * tile_side - first_cell[0], (first_tile[1] + u) * tile_side - first_cell[1]
            for i in range(max(-p, 0), min(tile_side, cell_counts[0] - p)):
                for j in range(max(-q, 0), min(tile_side, cell_counts[1] - q)):
                    clear_distance = tile[i * STRIDE, j * STRIDE]
                    for a in range(STRIDE):
                        for b in range(STRIDE):
                            clear_distance = max(clear_distance, tile[i * STRIDE + a, j * STRIDE + b])
                    if clear_distance >= widest:
                        continue
                    if clear_distance < limits.open:
                        weight[p + i + 1, q + j + 1] = (
                            int(10.0 * (1.0 + UNCERTAIN_COST)) if clear_distance >= limits.uncertain else 0
                        )
                        continue
                    near_wall = (
                        near_wall_cost
                        * (max(limits.soft, clear_distance) - clear_distance)
                        / (limits.soft - limits.open)
                    )
                    if clear_distance < limits.wide:
                        near_wall += TIGHT_COST * (limits.wide - clear_distance) / (limits.wide - limits.open)
                    weight[p + i + 1, q + j + 1] = int(10.0 * (1.0 + near_wall))
    return weight


@kernel
def _raise_unknown(weight, coverage, first_cell, more):
    """Raise the weights of open cells that are unknown by `more`; cell (1, 1) is number `first_cell`."""
    counts = coverage.counts
    for i in range(1, weight.shape[0] - 1):
        p = first_cell[0] + i - 1 - coverage.first[0]
        for j in range(1, weight.shape[1] - 1):
            q = first_cell[1] + j - 1 - coverage.first[1]
            is_known = 0 <= p < counts.shape[0] and 0 <= q < counts.shape[1] and counts[p, q] > 0
            if weight[i, j] and not is_known:
                weight[i, j] += more


@kernel
def _close(weight, middles, reach):
    """Block the cells within `reach` of some places (k, 2), and those that hold them; all in cells."""
    for x, y in middles:
        for i in range(max(int(math.ceil(x - reach)), 1), min(int(math.floor(x + reach)), weight.shape[0] - 2) + 1):
            for j in range(max(int(math.ceil(y - reach)), 1), min(int(math.floor(y + reach)), weight.shape[1] - 2) + 1):
                if (i - x) ** 2 + (j - y) ** 2 <= reach * reach or max(abs(i - x), abs(j - y)) <= 0.5:
                    weight[i, j] = 0


@kernel
def trace_path(cost, weight, x, y):
    """Return cells from the best of the 3 x 3 about (x, y) down to the goal, shape (k, 2); none if it is cut off."""
    nx, ny = cost.shape
    i0, j0 = int(round(x)), int(round(y))
    i, j, least_cost = 0, 0, 0
    for a in range(max(i0 - 1, 0), min(i0 + 2, nx)):
        for b in range(max(j0 - 1, 0), min(j0 + 2, ny)):
            if cost[a, b] < least_cost:
                i, j, least_cost = a, b, cost[a, b]
    path_cells = np.empty((nx + ny, 2), np.int64)
    n = 0
    while least_cost < 0:
        if n == len(path_cells):
            longer = np.empty((2 * n, 2), np.int64)
            for k in range(n):  # an assignment to a slice takes Numba 2 s to compile
                longer[k, 0], longer[k, 1] = path_cells[k, 0], path_cells[k, 1]
            path_cells = longer
        path_cells[n, 0], path_cells[n, 1] = i, j
        n += 1
        if least_cost == -UNREACHED_COST:
            break
        least_cost = 0  # of the neighbours, the one through which this cell was reached
        for a in (-1, 0, 1):
            for b in (-1, 0, 1):
                if cost[i + a, j + b] < cost[i, j]:
                    through = cost[i + a, j + b] + np.int64(weight[i, j]) * (10 if a == 0 or b == 0 else 14)
                    if through < least_cost:
                        least_cost, p, q = through, i + a, j + b
        if least_cost < 0:
            i, j = p, q
            least_cost = cost[i, j]
    return path_cells[:n].copy()
