"""Where obstacles have been hit: a sparse grid of distances, and the optimistic cost-to-go over it.

The grid holds, for every cell near a hit, the distance from the cell's centre to the nearest hit. Cells are kept
in square tiles that are never changed once made: an updated memory shares all untouched tiles with the old one.
"""

import math
from collections.abc import Iterator
from dataclasses import dataclass, field
from typing import NamedTuple

import numpy as np
from numba import njit

from drake_starnav.errors import StarnavError

TILE = 64
"""Cells along a tile's side."""
STRIDE = 2
"""A cell of the cost-to-go holds so many cells of the memory in each direction."""
KEPT_BEYOND = 0.2
"""The grid holds distances up to the robot's radius plus this, m."""
NEAR_WALL_COST = 0.4
"""Additional cost of a metre right at an obstacle, as a multiple of its length: wide paths are preferred."""
BLOCKED_SLACK = 0.01
"""Cells this much nearer to a hit than the robot's radius still count as passable in the cost-to-go, m."""
SOFT_ZONE = 0.12
"""Beyond the robot's radius, over this distance, cells cost more, by up to NEAR_WALL_COST, m."""
BLACKLIST_RADIUS = 0.2
"""Cells this near to a closed place are blocked, where hits are near enough, m."""
BLACKLIST_CORE = 0.75
"""Cells this near to a closed place are blocked however far hits are, in cells: at least the one it lies in."""
UNREACHED = 2**30
"""Costs are stored less this, so that 0, of which memory is full at no cost, stands for what was not reached."""
LARGEST_GRID = 5e7
"""A grid that is searched has no more cells than this."""
FIRST_ENTRIES = 4096
"""Entries of the search's queue at first; it grows with what is reached."""
NO_PLACES = np.zeros((0, 3))
NEIGHBOURHOOD = 150
"""The margin of a search that reaches all 3 x 3 cells about a point, hundredths of a cell."""


@dataclass(frozen=True)
class DistanceGrid:
    """Distance to the nearest hit on a grid over W. Immutable.

    Attributes:
        resolution: cell size, m; cell (i, j) has its centre at (i, j) * resolution.
        cap: distances from here on are not kept, m.
        tiles: (I, J) -> distances of cells I*TILE.., J*TILE.., shape (TILE, TILE), m.
    """

    resolution: float
    cap: float
    tiles: dict[tuple[int, int], np.ndarray] = field(default_factory=dict)

    @staticmethod
    def empty(resolution: float, robot_radius: float) -> "DistanceGrid":
        """A memory without hits; cell size and the robot's radius in m."""
        return DistanceGrid(resolution, robot_radius + KEPT_BEYOND)

    def stamped(self, points: np.ndarray) -> "DistanceGrid":
        """This memory with more hits; points of shape (n, 2) in W, m."""
        if not len(points):
            return self
        border = int(self.cap / self.resolution) + 2
        cells = np.rint(points / self.resolution).astype(np.int64)
        low, high = (cells.min(axis=0) - border) // TILE, (cells.max(axis=0) + border) // TILE + 1
        patch = self._patch(low, high)
        touched = np.zeros(high - low, np.bool_)
        _stamp(patch, low * TILE, self.resolution, points, self.cap, touched)
        tiles = dict(self.tiles)
        for i, j in np.argwhere(touched):
            tile = patch[i * TILE : (i + 1) * TILE, j * TILE : (j + 1) * TILE].copy()
            tile.flags.writeable = False
            tiles[int(low[0] + i), int(low[1] + j)] = tile
        return DistanceGrid(self.resolution, self.cap, tiles)

    def distance(self, points: np.ndarray) -> np.ndarray:
        """Distance from each point's cell to the nearest hit, at most `cap`; shape (n, 2) -> (n,), m."""
        out = np.full(len(points), self.cap)
        owners, starts, members, inside = _by_owner(np.asarray(points, float), self.resolution)
        for k, (i, j) in enumerate(owners.tolist()):
            tile = self.tiles.get((i, j))
            if tile is not None:
                _read(tile, members[starts[k] : starts[k + 1]], inside, out)
        return out

    def window(self, low: np.ndarray, high: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        """A coarser grid over a box in W, whose cells hold STRIDE x STRIDE cells of the memory.

        A coarse cell has the greatest distance of its cells, so that no passage falls between them.

        Returns:
            Distances, shape (nx, ny), m, and the index of the first cell of the first coarse cell, shape (2,).

        Raises:
            StarnavError: there would be more than LARGEST_GRID cells.
        """
        first, count = self._coarse_cells(low, high)
        out = np.full(count, self.cap, np.float32)
        for tile, p, q in self._coarse_tiles(first, count):
            _coarsen(tile, p, q, out)
        return out, first

    def weights(self, low: np.ndarray, high: np.ndarray, terrain: "Terrain") -> tuple[np.ndarray, np.ndarray]:
        """What crossing each cell of `window` costs in tenths, 0 where blocked, with a blocked border.

        Returns:
            Weights, shape (nx + 2, ny + 2), uint8, and the index of the first cell as from `window`.

        Raises:
            StarnavError: as `window`.
        """
        first, count = self._coarse_cells(low, high)
        costs = terrain.robot_radius - BLOCKED_SLACK, terrain.robot_radius + SOFT_ZONE, NEAR_WALL_COST
        out = np.zeros(count + 2, np.uint8)
        out[1:-1, 1:-1] = _cell_weight(np.float32(self.cap), *costs)
        for tile, p, q in self._coarse_tiles(first, count):
            _weigh(tile, p, q, out, *costs)
        return out, first

    def _coarse_cells(self, low: np.ndarray, high: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        """The index of the first cell of the first coarse cell in a box in W, and the number of coarse cells."""
        cell = self.resolution * STRIDE
        if float(np.prod((high - low) / cell)) > LARGEST_GRID:
            raise StarnavError(
                f"the goal is too far: a grid from {low.tolist()} to {high.tolist()} would have more than "
                f"{LARGEST_GRID:.0e} cells of {cell:g} m; allowed: a nearer goal, or a larger planner.grid_resolution"
            )
        first = np.floor(low / self.resolution / STRIDE).astype(np.int64) * STRIDE
        return first, np.ceil((high - low) / self.resolution / STRIDE).astype(np.int64) + 1

    def _coarse_tiles(self, first: np.ndarray, count: np.ndarray) -> Iterator[tuple[np.ndarray, int, int]]:
        """The tiles that such a grid needs, each with the coarse cell of its first; that is a multiple of the stride,
        as `first` is."""
        side, (nx, ny) = TILE // STRIDE, count.tolist()
        for (i, j), tile in self.tiles.items():
            p, q = (i * TILE - int(first[0])) // STRIDE, (j * TILE - int(first[1])) // STRIDE
            if -side < p < nx and -side < q < ny:
                yield tile, p, q

    def _patch(self, low: np.ndarray, high: np.ndarray) -> np.ndarray:
        patch = np.full((high - low) * TILE, self.cap, np.float32)
        for i in range(int(low[0]), int(high[0])):
            for j in range(int(low[1]), int(high[1])):
                tile = self.tiles.get((i, j))
                if tile is not None:
                    a, b = (i - int(low[0])) * TILE, (j - int(low[1])) * TILE
                    patch[a : a + TILE, b : b + TILE] = tile
        return patch


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
        memory: the hits, which tell the freest place in a cell.
    """

    cost: np.ndarray
    weight: np.ndarray
    origin: np.ndarray
    cell: float
    source: tuple[int, int]
    f_limit: int
    memory: DistanceGrid

    def at(self, points: np.ndarray) -> np.ndarray:
        """From each point to the goal, shape (n, 2) in W -> (n,), m.

        Infinity where the goal cannot be reached inside the box; where the search ended before, a lower bound.
        """
        return _nearest_cost(self.cost, points, self.origin, self.cell, self.f_limit, *self.source)

    def path(self, start: np.ndarray) -> np.ndarray:
        """The shortest path from near `start` (2,) to the goal, shape (k, 2), W, m, maybe without a point.

        One point a cell: its centre, or in a narrow place the centre of that cell of the memory in it which is freest.
        """
        cells = _descent(self.cost, self.weight, (start - self.origin) / self.cell + 1.0) - 1
        centers = self.origin + cells * self.cell
        parts = (np.arange(STRIDE) - 0.5 * (STRIDE - 1)) * self.memory.resolution
        places = centers[:, None] + np.stack(np.meshgrid(parts, parts), axis=-1).reshape(-1, 2)
        clear = self.memory.distance(places.reshape(-1, 2)).reshape(places.shape[:2])
        freest = places[np.arange(len(places)), clear.argmax(axis=1)]
        return np.where((np.ptp(clear, axis=1) > 0.0)[:, None], freest, centers)


class Terrain(NamedTuple):
    """Which cells the robot may cross, and at what cost.

    Attributes:
        robot_radius: cells nearer than this to a hit are blocked, m.
        blacklist: shape (k, 3), places (x, y) in W around which cells are blocked too, those with hits nearer than the
            third number; all in m.
    """

    robot_radius: float
    blacklist: np.ndarray = NO_PLACES


class Origins(NamedTuple):
    """Where ways to the goal may begin: the search ends once the best of them is known.

    The others' cost-to-go may then be a lower bound, with which their sums of both costs are no smaller.

    Attributes:
        points: shape (n, 2), W, m.
        cost_to_come: shape (n,), to each point, m; no less than the straight line from `source`.
        source: shape (2,), W, m: the search goes towards it. None: all ways alike.
        margin: points whose sums exceed the least by no more than this are known too, m.
    """

    points: np.ndarray
    cost_to_come: np.ndarray
    source: np.ndarray | None = None
    margin: float = 0.0


def cost_to_go(
    memory: DistanceGrid,
    goal: np.ndarray,
    low: np.ndarray,
    high: np.ndarray,
    terrain: Terrain,
    origins: Origins | None = None,
) -> CostField:
    """Length of the shortest path to the goal if all unknown space were free.

    Args:
        memory: the hits.
        goal: shape (2,), W, m.
        low, high: corners of the box that is searched, W, m; it must contain the goal.
        terrain: which cells may be crossed.
        origins: where the ways begin; without them the whole box is searched.

    Raises:
        StarnavError: the box has too many cells.
    """
    cell = memory.resolution * STRIDE
    weight, first = memory.weights(low, high, terrain)
    origin = (first + 0.5 * (STRIDE - 1)) * memory.resolution
    half_diagonal = math.hypot(0.5, 0.5) * memory.resolution  # a path is up to so far off its cells' centres
    for x, y, clearance in terrain.blacklist:
        place, radius = np.array((x, y)), BLACKLIST_RADIUS + half_diagonal
        distance, corner = memory.window(place - radius - cell, place + radius + cell)
        around = (corner - first) // STRIDE
        _apply_blacklist(weight, distance, *around, *((place - origin) / cell + 1.0), clearance, radius / cell)
    i, j = np.clip(np.rint((goal - origin) / cell).astype(np.int64), 0, np.array(weight.shape) - 3)
    grid = _cost_to_come_grid(weight, origin, cell, origins)
    source, margin = (-1, -1), NEIGHBOURHOOD
    if origins is not None:
        margin += round(100.0 * origins.margin / cell)
        if origins.source is not None:
            p, q = np.rint((origins.source - origin) / cell).astype(np.int64) + 1
            source = (int(p), int(q))
    cost = np.zeros(weight.shape, np.int32)
    f_limit = bucket_dijkstra(weight, cost, i + 1, j + 1, grid, margin, *source)
    return CostField(cost, weight, origin, cell, source, f_limit, memory)


@njit(cache=True)
def _by_owner(points, resolution):
    """The tiles that points lie in, shape (k, 2); where each one's points begin, shape (k + 1,), among the points'
    indices, tile by tile; and each point's cell inside its tile."""
    owners, count = np.empty((len(points), 2), np.int64), 0
    which, inside = np.empty(len(points), np.int64), np.empty((len(points), 2), np.int64)
    k = 0
    for p in range(len(points)):
        i, j = int(np.rint(points[p, 0] / resolution)), int(np.rint(points[p, 1] / resolution))
        tile_i, tile_j = i // TILE, j // TILE
        if count == 0 or owners[k, 0] != tile_i or owners[k, 1] != tile_j:  # rarely: neighbours share a tile
            k = 0
            while k < count and (owners[k, 0] != tile_i or owners[k, 1] != tile_j):
                k += 1
            if k == count:
                owners[k, 0], owners[k, 1] = tile_i, tile_j
                count += 1
        which[p], inside[p, 0], inside[p, 1] = k, i - tile_i * TILE, j - tile_j * TILE
    starts, members = np.zeros(count + 1, np.int64), np.empty(len(points), np.int64)
    for owner in which:
        starts[owner + 1] += 1
    starts = np.cumsum(starts)
    fill = starts[:-1].copy()
    for p in range(len(points)):
        members[fill[which[p]]] = p
        fill[which[p]] += 1
    return owners[:count], starts, members, inside


@njit(cache=True)
def _read(tile, members, inside, out):
    """Fill in the distances of the points in a tile."""
    for p in members:
        out[p] = tile[inside[p, 0], inside[p, 1]]


@njit(cache=True)
def _stamp(patch, first, resolution, points, cap, touched):
    reach = int(cap / resolution) + 1
    for n in range(len(points)):
        i = int(round(points[n, 0] / resolution)) - first[0]
        j = int(round(points[n, 1] / resolution)) - first[1]
        # a hit closer than half a cell to one already known adds nothing that the grid resolves
        if patch[i, j] < 0.6 * resolution:
            continue
        for a in range(i - reach, i + reach + 1):
            dx = (first[0] + a) * resolution - points[n, 0]
            for b in range(j - reach, j + reach + 1):
                dy = (first[1] + b) * resolution - points[n, 1]
                squared = dx * dx + dy * dy
                if squared < patch[a, b] * patch[a, b]:
                    patch[a, b] = math.sqrt(squared)
        for a in range((i - reach) // TILE, (i + reach) // TILE + 1):
            for b in range((j - reach) // TILE, (j + reach) // TILE + 1):
                touched[a, b] = True


@njit(cache=True)
def _coarsen(tile, p, q, out):
    """Write the greatest of each STRIDE x STRIDE cells of a tile into a coarse grid, from cell (p, q) of it on."""
    count = tile.shape[0] // STRIDE
    for i in range(max(-p, 0), min(count, out.shape[0] - p)):
        for j in range(max(-q, 0), min(count, out.shape[1] - q)):
            most = tile[i * STRIDE, j * STRIDE]
            for a in range(STRIDE):
                for b in range(STRIDE):
                    most = max(most, tile[i * STRIDE + a, j * STRIDE + b])
            out[p + i, q + j] = most


@njit(cache=True)
def _cell_weight(distance, blocked, soft, near_wall_cost):
    """Cost of a cell in tenths, 0 where blocked."""
    if distance >= soft:
        return 10
    if distance >= blocked:
        return int(10.0 * (1.0 + near_wall_cost * (soft - distance) / (soft - blocked)))
    return 0


@njit(cache=True)
def _weigh(tile, p, q, out, blocked, soft, near_wall_cost):
    """Write the weights of a tile's coarse cells, as from `_coarsen`, into a grid with a border."""
    count = tile.shape[0] // STRIDE
    for i in range(max(-p, 0), min(count, out.shape[0] - 2 - p)):
        for j in range(max(-q, 0), min(count, out.shape[1] - 2 - q)):
            most = tile[i * STRIDE, j * STRIDE]
            for a in range(STRIDE):
                for b in range(STRIDE):
                    most = max(most, tile[i * STRIDE + a, j * STRIDE + b])
            out[p + i + 1, q + j + 1] = _cell_weight(most, blocked, soft, near_wall_cost)


@njit(cache=True)
def _apply_blacklist(weight, distance, p, q, x, y, clearance, radius):
    """Block cells about a place (x, y), in cells of `weight`, with the distances from its cell (p, q) + 1 on."""
    for i in range(max(math.ceil(x - radius), 1), min(math.floor(x + radius), weight.shape[0] - 2) + 1):
        for j in range(max(math.ceil(y - radius), 1), min(math.floor(y + radius), weight.shape[1] - 2) + 1):
            squared = (i - x) ** 2 + (j - y) ** 2
            narrow = squared <= radius * radius and distance[i - 1 - p, j - 1 - q] < clearance
            if narrow or squared <= BLACKLIST_CORE * BLACKLIST_CORE:
                weight[i, j] = 0


def _cost_to_come_grid(weight: np.ndarray, origin: np.ndarray, cell: float, origins: Origins | None) -> np.ndarray:
    """The least cost-to-come of the points in each cell, in hundredths of a cell less UNREACHED; 0 without points.

    A point in a blocked cell counts in the cells around it, as it does for `CostField.at`.
    """
    out = np.zeros(weight.shape, np.int32)
    if origins is not None:
        index = (origins.points - origin) / cell + 1.0
        _fill_cost_to_come(out, weight, index, 100.0 * origins.cost_to_come / cell)
    return out


@njit(cache=True)
def _fill_cost_to_come(out, weight, index, cost):
    nx, ny = out.shape
    for n in range(len(index)):
        i, j = int(round(index[n, 0])), int(round(index[n, 1]))
        if not np.isfinite(cost[n]) or i < 0 or j < 0 or i >= nx or j >= ny:
            continue
        around = 1 if weight[i, j] == 0 else 0
        for a in range(max(i - around, 0), min(i + around + 1, nx)):
            for b in range(max(j - around, 0), min(j + around + 1, ny)):
                there = int(round(cost[n] + 100.0 * math.hypot(a - i, b - j)))
                out[a, b] = min(out[a, b], there - UNREACHED)


@njit(cache=True)
def bucket_dijkstra(weight, cost, gi, gj, cost_to_come_grid, margin=NEIGHBOURHOOD, si=-1, sj=-1):
    """Dial's bucket-queue A* from the goal (gi, gj) to the source (si, sj); Dijkstra's search without a source (-1).

    It fills `cost`, which begins as zeros. It stops once every open cell's f = cost_to_go + heuristic exceeds the best
    cost_to_go + cost_to_come by more than `margin`, and returns that f, else -1; cells not reached by then have a
    cost_to_go of at least f - heuristic. All costs are in hundredths of a cell, in both grids less UNREACHED.
    """
    ny = weight.shape[1]
    w, costs = weight.ravel(), cost.ravel()
    cost_to_come = cost_to_come_grid.ravel()
    best = UNREACHED
    buckets = 1
    while buckets <= 28 * np.int64(w.max()) + 1:
        buckets *= 2
    head = np.full(buckets, -1, np.int32)
    entries = np.empty((FIRST_ENTRIES, 3), np.int32)  # cell, cost less UNREACHED, next entry
    rows, columns = np.array([1, -1, 0, 0, 1, 1, -1, -1]), np.array([0, 0, 1, -1, 1, -1, 1, -1])
    lengths = np.array([10, 10, 10, 10, 14, 14, 14, 14])
    start = gi * ny + gj
    costs[start] = -UNREACHED
    entries[0, 0], entries[0, 1], entries[0, 2] = start, -UNREACHED, -1
    bucket = _heuristic(gi, gj, si, sj) & (buckets - 1)
    head[bucket] = 0
    used = 1
    waiting = 1
    while waiting > 0:
        while head[bucket] < 0:
            bucket = (bucket + 1) & (buckets - 1)
        e = head[bucket]
        head[bucket] = entries[e, 2]
        waiting -= 1
        c, reached = entries[e, 0], entries[e, 1]
        if reached > costs[c]:
            continue
        cost_to_go = reached + UNREACHED
        if cost_to_come[c] < 0:
            best = min(best, cost_to_go + cost_to_come[c] + UNREACHED)
        i = np.int64(c) // ny
        j = c - i * ny
        f = cost_to_go + _heuristic(i, j, si, sj)
        if f > best + margin:
            return f
        if used + 8 > len(entries):
            larger = np.empty((2 * len(entries), 3), np.int32)
            larger[:used] = entries[:used]
            entries = larger
        for k in range(8):
            n = c + rows[k] * ny + columns[k]
            if w[n] == 0:
                continue
            candidate = reached + w[n] * lengths[k]
            if candidate < costs[n]:
                costs[n] = candidate
                b = (candidate + UNREACHED + _heuristic(i + rows[k], j + columns[k], si, sj)) & (buckets - 1)
                entries[used, 0], entries[used, 1], entries[used, 2] = n, candidate, head[b]
                head[b] = used
                used += 1
                waiting += 1
    return -1


@njit(cache=True)
def _heuristic(i, j, si, sj):
    """A lower bound of the cost from the source (si, sj), in hundredths of a cell; 0 without a source (-1).

    It is no more than the straight line, which is no more than the way from cell to cell.
    """
    if si < 0:
        return 0
    di, dj = abs(i - si), abs(j - sj)
    return (100 * max(di, dj) + 40 * min(di, dj)) * 12 // 13


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
            out[n] = max(f_limit - _heuristic(i, j, si, sj), 0) * cell / 100.0
    return out


@njit(cache=True)
def _descent(cost, weight, start):
    """Cells (i, j) from the best of the 3 x 3 about `start` down to the goal, shape (k, 2); none if it is cut off."""
    nx, ny = cost.shape
    i0, j0 = int(round(start[0])), int(round(start[1]))
    i, j, least = 0, 0, 0
    for a in range(max(i0 - 1, 0), min(i0 + 2, nx)):
        for b in range(max(j0 - 1, 0), min(j0 + 2, ny)):
            if cost[a, b] < least:
                i, j, least = a, b, cost[a, b]
    out = np.empty((nx * ny, 2), np.int64)
    n = 0
    while least < 0:
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
