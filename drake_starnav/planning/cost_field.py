"""The optimistic cost-to-go: what the shortest way to the goal would cost if all unknown space were free."""

import math
from dataclasses import dataclass
from typing import NamedTuple

import numpy as np
from numba import njit

from drake_starnav.planning.bucket_search import NEIGHBOURHOOD, UNREACHED, bucket_dijkstra, heuristic
from drake_starnav.planning.distance_grid import STRIDE, TILE, DistanceGrid

NEAR_WALL_COST = 0.4
"""Additional cost of a metre right at an obstacle, as a multiple of its length: wide paths are preferred."""
TIGHT_COST = 8.0
"""Additional cost of a metre where a robot that is no disc only just fits, and where hits may only seem to leave it no
room, as a multiple of its length."""
BLOCKED_SLACK = 0.01
"""Cells this much nearer to a hit than the robot's radius still count as passable in the cost-to-go, m."""
SOFT_ZONE = 0.12
"""Beyond the robot's radius, over this distance, cells cost more, by up to NEAR_WALL_COST, m."""
BLACKLIST_RADIUS = 0.2
"""Cells this near to a closed place are blocked, where hits are near enough, m."""


@dataclass(frozen=True)
class CostField:
    """Length of the shortest path to the goal from every cell, as far as it was searched.

    Attributes:
        cost: shape (nx, ny) with a border, in hundredths of a cell, less UNREACHED; 0 where blocked or not reached.
        weight: same shape, uint8, what crossing a cell costs in tenths; 0 where blocked.
        origin: position of cell (1, 1), shape (2,), W, m.
        cell: size of a cell, m.
        source: cell (i, j) towards which the search went; (-1, -1) if it went all ways alike.
        f_limit: cells that were not reached have at least this sum of the cost and the heuristic from `source`, in
            hundredths of a cell; -1 if the whole box was searched.
        grid: the hits, which tell the freest place in a cell.
    """

    cost: np.ndarray
    weight: np.ndarray
    origin: np.ndarray
    cell: float
    source: tuple[int, int]
    f_limit: int
    grid: DistanceGrid

    def at(self, points: np.ndarray) -> np.ndarray:
        """From each point to the goal, shape (n, 2) in W -> (n,), m.

        Infinity where the goal cannot be reached inside the box; where the search ended before, a lower bound.
        """
        return _nearest_cost(self.cost, points, self.origin, self.cell, self.f_limit, *self.source)

    def path(self, start: np.ndarray) -> np.ndarray:
        """The shortest path from near `start` (2,) to the goal, shape (k, 2), W, m, maybe without a point.

        One point a cell: its centre, or in a narrow place the centre of that cell of the grid of hits in it which is
        freest.
        """
        x, y = (np.asarray(start) - self.origin) / self.cell + 1.0
        middles = self.origin + (_descent(self.cost, self.weight, x, y) - 1) * self.cell
        places, clear = self.grid.coarse(middles)
        freest = places[np.arange(len(places)), clear.argmax(axis=1)]
        return np.where((clear.max(axis=1) > clear.min(axis=1))[:, None], freest, middles)


class Terrain(NamedTuple):
    """Which cells the robot may cross, and at what cost.

    Attributes:
        robot_radius: cells nearer than this to a hit are blocked, m.
        blacklist: shape (k, 3), places (x, y) in W around which cells are blocked too, those with hits nearer than the
            third number and the one that holds the place; all in m.
        doubt: cells that hits block by no more than this are passable, at TIGHT_COST, m.
        swept_radius: cells nearer than this, where the robot cannot turn, cost more, by up to TIGHT_COST, m.
    """

    robot_radius: float
    blacklist: np.ndarray = np.zeros((0, 3))
    doubt: float = 0.0
    swept_radius: float = 0.0


class Origins(NamedTuple):
    """Where ways to the goal may begin: the search ends once the best of them is known.

    The others' cost-to-go may then be a lower bound, with which their sums of both costs are no smaller.

    Attributes:
        points: shape (n, 2), W, m.
        cost_to_come: shape (n,), to each point, m; no less than the straight line from `source`.
        source: shape (2,), W, m: the search goes towards it. None: all ways alike.
        margin: points whose sums exceed the least by no more than this are known too, m.
    """

    points: np.ndarray = np.zeros((0, 2))
    cost_to_come: np.ndarray = np.zeros(0)
    source: np.ndarray | None = None
    margin: float = 0.0


def cost_to_go(
    grid: DistanceGrid,
    goal: np.ndarray,
    low: np.ndarray,
    high: np.ndarray,
    terrain: Terrain,
    origins: Origins | None = None,
) -> CostField:
    """Length of the shortest path to the goal if all unknown space were free.

    Args:
        grid: the hits.
        goal: shape (2,), W, m.
        low, high: corners of the box that is searched, W, m; it must contain the goal.
        terrain: which cells may be crossed.
        origins: where the ways begin; without them the whole box is searched.

    Raises:
        StarnavError: the box has too many cells.
    """
    first, count = grid.box(low, high)
    cell, origin = grid.resolution * STRIDE, (first + 0.5 * (STRIDE - 1)) * grid.resolution
    blocked = terrain.robot_radius - BLOCKED_SLACK
    soft = terrain.robot_radius + SOFT_ZONE
    swept = terrain.swept_radius if terrain.swept_radius > terrain.robot_radius else 0.0  # of a disc nothing
    half_diagonal = math.hypot(0.5, 0.5) * grid.resolution  # a path is up to so far off its cells' centres
    limits = blocked - terrain.doubt, blocked, soft, swept
    weight = _weights(grid.arrays, first, count, limits, (NEAR_WALL_COST, TIGHT_COST))
    for x, y, clearance in terrain.blacklist:
        _close(weight, grid, origin, np.array((x, y)), BLACKLIST_RADIUS + half_diagonal, clearance)
    points, cost_to_come, source, margin = origins or Origins()
    margin_cells = NEIGHBOURHOOD + round(100.0 * margin / cell)
    cost, come = np.zeros(weight.shape, np.int32), np.zeros(weight.shape, np.int32)
    _come_by(come, weight, (points, cost_to_come), origin, cell)
    end = np.clip(np.rint((goal - origin) / cell).astype(np.int64), 0, np.array(weight.shape) - 3) + 1
    towards = (-1, -1) if source is None else (np.rint((source - origin) / cell).astype(np.int64) + 1).tolist()
    f_limit = bucket_dijkstra(weight, cost, *end.tolist(), come, margin_cells, *towards)
    return CostField(cost, weight, origin, cell, (towards[0], towards[1]), f_limit, grid)


@njit(cache=True)
def _weights(grid, corner, count, limits, costs):
    """What crossing each cell costs in tenths, 0 where blocked, by the greatest distance in it; with a blocked border.

    Args:
        grid: `DistanceGrid.arrays`. Where it has no tile, cells are wide.
        corner, count: as of `DistanceGrid.box`.
        limits: distances from which on a cell may be open, is open, is no longer near a wall, and is wide, m.
        costs: near a wall, and where it is tight.
    """
    tiles, rows, first, _, _ = grid
    (shut, blocked, soft, swept), (near_wall_cost, tight_cost) = limits, costs
    out, side, wide = np.zeros((count[0] + 2, count[1] + 2), np.uint8), TILE // STRIDE, max(soft, swept)
    out[1:-1, 1:-1] = 10
    for t in range(rows.shape[0]):
        for u in range(rows.shape[1]):
            if rows[t, u] < 0:
                continue
            tile = tiles[rows[t, u]]
            p, q = ((first[0] + t) * TILE - corner[0]) // STRIDE, ((first[1] + u) * TILE - corner[1]) // STRIDE
            for i in range(max(-p, 0), min(side, count[0] - p)):
                for j in range(max(-q, 0), min(side, count[1] - q)):
                    clear = tile[i * STRIDE, j * STRIDE]
                    for a in range(STRIDE):
                        for b in range(STRIDE):
                            clear = max(clear, tile[i * STRIDE + a, j * STRIDE + b])
                    if clear >= wide:
                        continue
                    if clear < blocked:
                        out[p + i + 1, q + j + 1] = int(10.0 * (1.0 + tight_cost)) if clear >= shut else 0
                        continue
                    near_wall = near_wall_cost * (max(soft, clear) - clear) / (soft - blocked)
                    if clear < swept:
                        near_wall += tight_cost * (swept - clear) / (swept - blocked)
                    out[p + i + 1, q + j + 1] = int(10.0 * (1.0 + near_wall))
    return out


def _close(
    weight: np.ndarray, grid: DistanceGrid, origin: np.ndarray, place: np.ndarray, radius: float, clearance: float
) -> None:
    """Block cells about a place (2,), as `Terrain.blacklist`; the origin is that of `weight`. In W, m."""
    cell = grid.resolution * STRIDE
    middle, reach = (place - origin) / cell + 1.0, radius / cell
    low = np.maximum(np.ceil(middle - reach), 1.0).astype(int)
    high = np.minimum(np.floor(middle + reach), np.array(weight.shape) - 2.0).astype(int) + 1
    if (high <= low).any():
        return
    cells = low + np.moveaxis(np.indices(high - low), 0, -1).reshape(-1, 2)
    squared = ((cells - middle) ** 2).sum(axis=1)
    clear = grid.coarse(origin + (cells - 1) * cell)[1].max(axis=1)
    narrow = (squared <= reach * reach) & (clear < clearance)
    holds = np.abs(cells - middle).max(axis=1) <= 0.5
    weight[tuple(cells[narrow | holds].T)] = 0


@njit(cache=True)
def _come_by(out, weight, come, origin, cell):
    """Note the cost-to-come of points in their cells, in hundredths of a cell less UNREACHED; 0 without points.

    A point in a blocked cell counts in the cells around it, as it does for `CostField.at`.
    """
    points, cost_to_point = come
    nx, ny = out.shape
    for n in range(len(points)):
        i, j = int(round((points[n, 0] - origin[0]) / cell + 1.0)), int(round((points[n, 1] - origin[1]) / cell + 1.0))
        cost = 100.0 * cost_to_point[n] / cell
        if not np.isfinite(cost) or i < 0 or j < 0 or i >= nx or j >= ny:
            continue
        around = 1 if weight[i, j] == 0 else 0
        for a in range(max(i - around, 0), min(i + around + 1, nx)):
            for b in range(max(j - around, 0), min(j + around + 1, ny)):
                there = int(round(cost + 100.0 * math.hypot(a - i, b - j)))
                out[a, b] = min(out[a, b], there - UNREACHED)


@njit(cache=True)
def _nearest_cost(field, points, origin, cell, f_limit, si, sj):
    """Smallest cost over the 3 x 3 cells about each point, or a lower bound where none was reached, m."""
    nx, ny = field.shape
    out = np.full(len(points), np.inf)
    for n in range(len(points)):
        i = int(round((points[n, 0] - origin[0]) / cell)) + 1
        j = int(round((points[n, 1] - origin[1]) / cell)) + 1
        for a in range(max(i - 1, 0), min(i + 2, nx)):
            for b in range(max(j - 1, 0), min(j + 2, ny)):
                if field[a, b] < 0:
                    detour = cell * math.hypot(a - i, b - j)
                    out[n] = min(out[n], (field[a, b] + UNREACHED) * cell / 100.0 + detour)
        if f_limit >= 0 and out[n] == np.inf:
            out[n] = max(f_limit - heuristic(i, j, si, sj), 0) * cell / 100.0
    return out


@njit(cache=True)
def _descent(cost, weight, x, y):
    """Cells (i, j) from the best of the 3 x 3 about (x, y) down to the goal, shape (k, 2); none if it is cut off."""
    nx, ny = cost.shape
    i0, j0 = int(round(x)), int(round(y))
    i, j, least = 0, 0, 0
    for a in range(max(i0 - 1, 0), min(i0 + 2, nx)):
        for b in range(max(j0 - 1, 0), min(j0 + 2, ny)):
            if cost[a, b] < least:
                i, j, least = a, b, cost[a, b]
    out = np.empty((nx + ny, 2), np.int64)
    n = 0
    while least < 0:
        if n == len(out):
            longer = np.empty((2 * n, 2), np.int64)
            longer[:n] = out
            out = longer
        out[n, 0], out[n, 1] = i, j
        n += 1
        if least == -UNREACHED:
            break
        least = 0  # of the neighbours, the one through which this cell was reached
        for a in (-1, 0, 1):
            for b in (-1, 0, 1):
                if cost[i + a, j + b] < cost[i, j]:
                    through = cost[i + a, j + b] + np.int64(weight[i, j]) * (10 if a == 0 or b == 0 else 14)
                    if through < least:
                        least, p, q = through, i + a, j + b
        if least < 0:
            i, j = p, q
            least = cost[i, j]
    return out[:n].copy()
