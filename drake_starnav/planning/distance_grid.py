"""Where obstacles have been hit: a sparse grid of the distances to the nearest hit.

Cells are kept in square tiles that are never changed once made: a grid with more hits shares all untouched tiles with
the one before.
"""

import math
from dataclasses import dataclass, field, replace

import numpy as np

from drake_starnav.errors import StarnavError
from drake_starnav.geometry.compiled import kernel, leaf

TILE = 64
"""Cells along a tile's side."""
STRIDE = 2
"""Cells of the grid, in each direction, in a cell of the cost-to-go."""
KEPT_BEYOND = 0.8
"""The grid holds distances up to the robot's radius plus this, in its radii."""
HIT_ERROR = 0.16
"""Distances to hits count up to this error, in radii of the robot: noise, and the size of cells."""
LARGEST_GRID = 5e7
"""A grid that is searched has no more cells than this."""


@dataclass
class TilePool:
    """Tiles with spare ones; of the grids that share them, the first to use a row owns it.

    Attributes:
        tiles: shape (n, TILE, TILE), m.
        used: how many of them are in use.
    """

    tiles: np.ndarray
    used: int = 0

    def copied(self, rows: np.ndarray, spare: int) -> "TilePool":
        """Copy the tiles in some rows, shape (k,), with room for `spare` more and for as many again."""
        used = len(rows)
        larger = np.empty((2 * (used + spare) + 16, TILE, TILE), self.tiles.dtype)
        np.take(self.tiles, rows, axis=0, out=larger[:used], mode="clip")
        return TilePool(larger, used)


@dataclass(frozen=True)
class DistanceGrid:
    """Distance to the nearest hit on a grid over W. Immutable.

    Attributes:
        resolution: cell size, m; cell (i, j) has its centre at (i, j) * resolution.
        cap: distances from here on are not kept, m.
        first: the tile that comes first, shape (2,); tile (p, q) has the cells from (p, q) * TILE on.
        rows: where each tile lies in the pool, shape (I, J), int32; -1 where no hit is near.
        used: rows of the pool that were in use when this grid was made.
        pool: the tiles, which grids share that extend one another.
    """

    resolution: float
    cap: float
    first: np.ndarray = field(compare=False)
    rows: np.ndarray = field(compare=False)
    used: int = field(compare=False)
    pool: TilePool = field(compare=False)

    @staticmethod
    def empty(resolution: float, robot_radius: float) -> "DistanceGrid":
        """Return a grid without hits; cell size and the robot's radius in m."""
        first, rows = np.zeros(2, np.int64), np.full((0, 0), -1, np.int32)
        return DistanceGrid(
            resolution,
            robot_radius + KEPT_BEYOND * robot_radius,
            first,
            rows,
            0,
            TilePool(np.zeros((0, TILE, TILE), np.float32)),
        )

    def without_hits(self) -> "DistanceGrid":
        """Return a grid of the same cells without hits."""
        return replace(DistanceGrid.empty(self.resolution, 0.0), cap=self.cap)

    @property
    def tiles(self) -> dict[tuple[int, int], np.ndarray]:
        """(p, q) -> the distances of that tile's cells, shape (TILE, TILE), m; only where hits are near."""
        found, (p, q) = np.argwhere(self.rows >= 0).tolist(), self.first.tolist()
        return {(p + i, q + j): self.pool.tiles[self.rows[i, j]] for i, j in found}

    @property
    def bounds(self) -> np.ndarray:
        """Corners of a box that holds all cells near hits, shape (2, 2), W, m; shape (0, 2) without hits."""
        corners = np.vstack((self.first, self.first + self.rows.shape)) if self.rows.size else np.zeros((0, 2))
        return corners * (TILE * self.resolution)

    @property
    def arrays(self) -> tuple[np.ndarray, np.ndarray, np.ndarray, float, float]:
        """For compiled loops: tiles, rows, first, resolution, cap."""
        return self.pool.tiles, self.rows, self.first, self.resolution, self.cap

    def add_hits(self, points: np.ndarray) -> "DistanceGrid":
        """Return this grid with more hits; points of shape (n, 2) in W, m."""
        if not len(points):
            return self
        border = int(self.cap / self.resolution) + 2
        nearest = np.rint(points.min(axis=0) / self.resolution), np.rint(points.max(axis=0) / self.resolution)
        low, high = (nearest[0].astype(int) - border) // TILE, (nearest[1].astype(int) + border) // TILE + 1
        first, rows = _widen_rows(self.first, self.rows, low, high)
        pool, most = self.pool, int((high - low).prod())
        if pool.used != self.used or pool.used + most > len(pool.tiles):
            live = rows >= 0
            pool = pool.copied(rows[live], most)
            rows[live] = np.arange(pool.used)
        pool.used = _stamp(pool.tiles, pool.used, rows, first, self.resolution, self.cap, points)
        return DistanceGrid(self.resolution, self.cap, first, rows, pool.used, pool)

    def distance(self, points: np.ndarray) -> np.ndarray:
        """Return the distance from each point's cell to the nearest hit, at most `cap`; shape (n, 2) -> (n,), m."""
        return _distances(self.arrays, np.ascontiguousarray(points, dtype=float))

    def coarse(self, middles: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        """Return the STRIDE x STRIDE cells in coarse cells of these centres, shape (k, 2), W, m.

        Returns:
            Their centres, shape (k, STRIDE^2, 2), W, and distances, shape (k, STRIDE^2); in m.
        """
        offsets = (np.arange(STRIDE) - 0.5 * (STRIDE - 1)) * self.resolution
        places = middles[:, None] + np.stack(np.meshgrid(offsets, offsets), axis=-1).reshape(-1, 2)
        return places, self.distance(places.reshape(-1, 2)).reshape(places.shape[:2])

    def box(self, low: np.ndarray, high: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        """Return the coarse cells that cover a box in W, of STRIDE x STRIDE cells each.

        Returns:
            The index of the first cell of the first of them, and how many there are along each axis; shape (2,).

        Raises:
            StarnavError: there would be more than LARGEST_GRID cells.
        """
        cell = self.resolution * STRIDE
        if float(np.prod((high - low) / cell)) > LARGEST_GRID:
            raise StarnavError(
                f"the goal is too far: a grid from {low.tolist()} to {high.tolist()} would have more than "
                f"{LARGEST_GRID:.0e} cells of {cell:g} m; allowed: a nearer goal, or a larger planner.grid_resolution"
            )
        first = np.floor(low / self.resolution / STRIDE).astype(np.int64) * STRIDE
        return first, np.ceil((high - low) / self.resolution / STRIDE).astype(np.int64) + 1


def _widen_rows(
    first: np.ndarray, rows: np.ndarray, low: np.ndarray, high: np.ndarray
) -> tuple[np.ndarray, np.ndarray]:
    """Return a copy of the rows of tiles that has those from `low` to `high` too, and its first tile."""
    last = first + rows.shape
    if not rows.size:
        first, last = low, low
    elif (low >= first).all() and (high <= last).all():
        return first, rows.copy()
    new_first = np.minimum(first, low)
    out = np.full(np.maximum(last, high) - new_first, -1, np.int32)
    i, j = first - new_first
    out[i : i + rows.shape[0], j : j + rows.shape[1]] = rows
    return new_first, out


@kernel
def _stamp(tiles, used, rows, first, resolution, cap, points):
    """Write the tiles that change into the pool from row `used` on; return how many rows are in use then."""
    reach = int(cap / resolution) + 1
    before = used
    for n in range(len(points)):
        x, y = points[n, 0], points[n, 1]
        i, j = int(round(x / resolution)), int(round(y / resolution))
        row = rows[i // TILE - first[0], j // TILE - first[1]]
        # a hit in a cell whose centre has one within 0.6 cells adds nothing that the grid resolves
        if row >= 0 and tiles[row, i % TILE, j % TILE] < 0.6 * resolution:
            continue
        for p in range((i - reach) // TILE, (i + reach) // TILE + 1):
            for q in range((j - reach) // TILE, (j + reach) // TILE + 1):
                row = rows[p - first[0], q - first[1]]
                if row < before:
                    for a in range(TILE):
                        for b in range(TILE):
                            tiles[used, a, b] = tiles[row, a, b] if row >= 0 else cap
                    row = rows[p - first[0], q - first[1]] = used
                    used += 1
                for a in range(max(i - reach, p * TILE), min(i + reach, p * TILE + TILE - 1) + 1):
                    dx = a * resolution - x
                    for b in range(max(j - reach, q * TILE), min(j + reach, q * TILE + TILE - 1) + 1):
                        dy = b * resolution - y
                        squared = dx * dx + dy * dy
                        known = tiles[row, a - p * TILE, b - q * TILE]
                        if squared < known * known:
                            tiles[row, a - p * TILE, b - q * TILE] = math.sqrt(squared)
    return used


@kernel
def _distances(grid, points):
    """Run the loop of `DistanceGrid.distance`."""
    out = np.empty(len(points))
    for n in range(len(points)):
        out[n] = distance_at(grid, points[n, 0], points[n, 1])
    return out


@leaf
def distance_at(grid, x, y):
    """Return the distance from the cell of (x, y) to the nearest hit, at most the cap, m, by the `arrays` of a grid."""
    tiles, rows, first, resolution, cap = grid
    i, j = int(round(x / resolution)), int(round(y / resolution))
    p, q = i // TILE - first[0], j // TILE - first[1]
    if 0 <= p < rows.shape[0] and 0 <= q < rows.shape[1] and rows[p, q] >= 0:
        return float(tiles[rows[p, q], i % TILE, j % TILE])
    return cap
