"""The grid over W: how far the nearest hit is from each cell, and how many regions cover it.

Distances are kept in square tiles that are never changed once made: a grid with more hits shares all untouched tiles
with the one before. Coverage is counted on cells of STRIDE x STRIDE of these, on which paths are searched.
"""

import math
from dataclasses import dataclass, field, replace
from typing import NamedTuple

import numpy as np

from drake_starnav.errors import StarnavError
from drake_starnav.geometry.compiled import kernel, leaf
from drake_starnav.surroundings.region_union import RegionUnion, covers

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
OFF = 0.5 * (STRIDE - 1) / STRIDE
"""Cell p has its middle at p + OFF, in cells."""


@dataclass
class TilePool:
    """A growing array of tiles that successive grids share; only the newest grid may append rows.

    Attributes:
        tiles: shape (n, TILE, TILE), m.
        used: how many of them are in use.
    """

    tiles: np.ndarray
    used: int = 0

    def copy_rows(self, rows: np.ndarray, spare: int) -> "TilePool":
        """Copy the tiles in some rows, shape (k,), with room for `spare` more and for as many again."""
        used = len(rows)
        larger = np.empty((2 * (used + spare) + 16, TILE, TILE), self.tiles.dtype)
        np.take(self.tiles, rows, axis=0, out=larger[:used], mode="clip")
        return TilePool(larger, used)


class Coverage(NamedTuple):
    """How many regions cover the middles of cells of W. Immutable.

    Attributes:
        first: number of the cell that comes first, for both axes, shape (2,).
        counts: of each cell, shape (I, J), uint16.
    """

    first: np.ndarray = np.zeros(2, np.int64)
    counts: np.ndarray = np.zeros((0, 0), np.uint16)

    def update_counts(
        self, cell: float, regions: RegionUnion, new_values: np.ndarray, bounds: np.ndarray
    ) -> "Coverage":
        """Return the counts after regions have changed.

        Args:
            cell: size of a cell, m.
            regions: those that have changed, as they were; of new ones, all samples are 0.
            new_values: their samples now, shape (n, M), m; 0 of those that are gone.
            bounds: corners of a box that holds the regions, shape (2, 2), W, m.
        """
        low_cell, high_cell = np.floor(bounds / cell).astype(np.int64) + ((0,), (1,))
        first_cell = self.first if self.counts.size else low_cell
        last_cell = first_cell + self.counts.shape
        low_cell, high_cell = np.minimum(low_cell, first_cell), np.maximum(high_cell, last_cell)
        counts = np.pad(self.counts, np.stack((first_cell - low_cell, high_cell - last_cell), axis=1))
        _recount(counts, low_cell, cell, regions, new_values)
        return Coverage(low_cell, counts)


class GridArrays(NamedTuple):
    """The distances of a `Grid`; its fields, and the tiles of its pool."""

    tiles: np.ndarray
    rows: np.ndarray
    first: np.ndarray
    resolution: float
    cap: float


@dataclass(frozen=True)
class Grid:
    """Distances to the nearest hit, and counts of regions, over W. Immutable.

    Attributes:
        resolution: cell size, m; cell (i, j) has its centre at (i, j) * resolution.
        cap: distances from here on are not kept, m.
        first: the tile that comes first, shape (2,); tile (p, q) has the cells from (p, q) * TILE on.
        rows: where each tile lies in the pool, shape (I, J), int32; -1 where no hit is near.
        used: rows of the pool that were in use when this grid was made.
        pool: the tiles, which grids share that extend one another.
        coverage: how many regions cover the coarse cells.
    """

    resolution: float
    cap: float
    first: np.ndarray = field(compare=False)
    rows: np.ndarray = field(compare=False)
    used: int = field(compare=False)
    pool: TilePool = field(compare=False)
    coverage: Coverage = field(default=Coverage(), compare=False)

    @staticmethod
    def empty(resolution: float, radius: float) -> "Grid":
        """Return a grid without hits; cell size and a radius of the robot, up to which distances matter, m."""
        first, rows = np.zeros(2, np.int64), np.full((0, 0), -1, np.int32)
        return Grid(
            resolution,
            radius + KEPT_BEYOND * radius,
            first,
            rows,
            0,
            TilePool(np.zeros((0, TILE, TILE), np.float32)),
        )

    def without_hits(self) -> "Grid":
        """Return a grid of the same cells without hits."""
        return replace(Grid.empty(self.resolution, 0.0), cap=self.cap, coverage=self.coverage)

    @property
    def tiles(self) -> dict[tuple[int, int], np.ndarray]:
        """(p, q) -> the distances of that tile's cells, shape (TILE, TILE), m; only where hits are near."""
        tile_places, (p, q) = np.argwhere(self.rows >= 0).tolist(), self.first.tolist()
        return {(p + i, q + j): self.pool.tiles[self.rows[i, j]] for i, j in tile_places}

    @property
    def bounds(self) -> np.ndarray:
        """Corners of a box that holds all cells near hits, shape (2, 2), W, m; shape (0, 2) without hits."""
        corners = np.vstack((self.first, self.first + self.rows.shape)) if self.rows.size else np.zeros((0, 2))
        return corners * (TILE * self.resolution)

    @property
    def arrays(self) -> GridArrays:
        """The distances, for compiled loops."""
        return GridArrays(self.pool.tiles, self.rows, self.first, self.resolution, self.cap)

    def add_hits(self, points: np.ndarray) -> "Grid":
        """Return this grid with more hits; points of shape (n, 2) in W, m."""
        if not len(points):
            return self
        border = int(self.cap / self.resolution) + 2
        nearest = np.rint(points.min(axis=0) / self.resolution), np.rint(points.max(axis=0) / self.resolution)
        low_tile, high_tile = (nearest[0].astype(int) - border) // TILE, (nearest[1].astype(int) + border) // TILE + 1
        first_tile, rows = _widen_rows(self.first, self.rows, low_tile, high_tile)
        pool, most_tiles = self.pool, int((high_tile - low_tile).prod())
        if pool.used != self.used or pool.used + most_tiles > len(pool.tiles):
            live = rows >= 0
            pool = pool.copy_rows(rows[live], most_tiles)
            rows[live] = np.arange(pool.used)
        pool.used = _stamp(pool.tiles, pool.used, rows, first_tile, self.resolution, self.cap, points)
        return Grid(self.resolution, self.cap, first_tile, rows, pool.used, pool, self.coverage)

    def count_regions(self, regions: RegionUnion, new_values: np.ndarray, bounds: np.ndarray) -> "Grid":
        """Return this grid with the coverage after regions have changed; arguments as for `Coverage.update_counts`."""
        coverage = self.coverage.update_counts(self.resolution * STRIDE, regions, new_values, bounds)
        return replace(self, coverage=coverage)

    def distance(self, points: np.ndarray) -> np.ndarray:
        """Return the distance from each point's cell to the nearest hit, at most `cap`; shape (n, 2) -> (n,), m."""
        return _measure_distances(self.arrays, np.ascontiguousarray(points, dtype=float))

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
            The number of the first of them, and how many there are along each axis; shape (2,).

        Raises:
            StarnavError: there would be more than LARGEST_GRID cells.
        """
        cell = self.resolution * STRIDE
        if float(np.prod((high - low) / cell)) > LARGEST_GRID:
            raise StarnavError(
                f"the goal is too far: a grid from {low.tolist()} to {high.tolist()} would have more than "
                f"{LARGEST_GRID:.0e} cells of {cell:g} m; allowed: a nearer goal, or a larger planner.grid_resolution"
            )
        return np.floor(low / cell).astype(np.int64), np.ceil((high - low) / cell).astype(np.int64) + 1


def _widen_rows(
    first_tile: np.ndarray, rows: np.ndarray, low_tile: np.ndarray, high_tile: np.ndarray
) -> tuple[np.ndarray, np.ndarray]:
    """Return a copy of the rows of tiles that has those from `low_tile` to `high_tile` too, and its first tile."""
    last_tile = first_tile + rows.shape
    if not rows.size:
        first_tile, last_tile = low_tile, low_tile
    elif (low_tile >= first_tile).all() and (high_tile <= last_tile).all():
        return first_tile, rows.copy()
    new_first = np.minimum(first_tile, low_tile)
    widened_rows = np.full(np.maximum(last_tile, high_tile) - new_first, -1, np.int32)
    i, j = first_tile - new_first
    widened_rows[i : i + rows.shape[0], j : j + rows.shape[1]] = rows
    return new_first, widened_rows


@kernel
def _stamp(tiles, used, rows, first_tile, resolution, cap, points):
    """Write the tiles that change into the pool from row `used` on; return how many rows are in use then."""
    reach_cells = int(cap / resolution) + 1
    used_before = used
    for n in range(len(points)):
        x, y = points[n, 0], points[n, 1]
        i, j = int(round(x / resolution)), int(round(y / resolution))
        row = rows[i // TILE - first_tile[0], j // TILE - first_tile[1]]
        # a hit in a cell whose centre has one within 0.6 cells adds nothing that the grid resolves
        if row >= 0 and tiles[row, i % TILE, j % TILE] < 0.6 * resolution:
            continue
        for p in range((i - reach_cells) // TILE, (i + reach_cells) // TILE + 1):
            for q in range((j - reach_cells) // TILE, (j + reach_cells) // TILE + 1):
                row = rows[p - first_tile[0], q - first_tile[1]]
                if row < used_before:
                    for a in range(TILE):
                        for b in range(TILE):
                            tiles[used, a, b] = tiles[row, a, b] if row >= 0 else cap
                    row = rows[p - first_tile[0], q - first_tile[1]] = used
                    used += 1
                for a in range(max(i - reach_cells, p * TILE), min(i + reach_cells, p * TILE + TILE - 1) + 1):
                    dx = a * resolution - x
                    for b in range(max(j - reach_cells, q * TILE), min(j + reach_cells, q * TILE + TILE - 1) + 1):
                        dy = b * resolution - y
                        squared = dx * dx + dy * dy
                        known_distance = tiles[row, a - p * TILE, b - q * TILE]
                        if squared < known_distance * known_distance:
                            tiles[row, a - p * TILE, b - q * TILE] = math.sqrt(squared)
    return used


@kernel
def _measure_distances(grid, points):
    """Run the loop of `Grid.distance`."""
    distances = np.empty(len(points))
    for n in range(len(points)):
        distances[n] = measure_distance_at(grid, points[n, 0], points[n, 1])
    return distances


@leaf
def measure_distance_at(grid, x, y):
    """Return the distance from the cell of (x, y) to the nearest hit, at most the cap, m, by the `arrays` of a grid."""
    i, j = int(round(x / grid.resolution)), int(round(y / grid.resolution))
    p, q = i // TILE - grid.first[0], j // TILE - grid.first[1]
    if 0 <= p < grid.rows.shape[0] and 0 <= q < grid.rows.shape[1] and grid.rows[p, q] >= 0:
        return float(grid.tiles[grid.rows[p, q], i % TILE, j % TILE])
    return grid.cap


@kernel
def _recount(counts, first_cell, cell, regions, new_values):
    """Count each region anew in the box about those of its samples that have changed."""
    center, bearing_0, old_values = regions.center, regions.bearing_0, regions.values
    sample_angle = 2.0 * math.pi / new_values.shape[1]
    for k in range(len(center)):
        left, right, bottom, top = np.inf, -np.inf, np.inf, -np.inf
        for m in range(new_values.shape[1]):
            if old_values[k, m] != new_values[k, m]:
                for n in range(m - 1, m + 2):
                    u, v = math.cos(bearing_0[k] + n * sample_angle), math.sin(bearing_0[k] + n * sample_angle)
                    for r in (old_values[k, m], new_values[k, m]):
                        left, right = min(left, r * u), max(right, r * u)
                        bottom, top = min(bottom, r * v), max(top, r * v)
        if left > right:
            continue
        (x, y), (p, q), (nx, ny) = center[k], first_cell, counts.shape
        for i in range(max(int((x + left) / cell - p) - 1, 0), min(int((x + right) / cell - p) + 2, nx)):
            for j in range(max(int((y + bottom) / cell - q) - 1, 0), min(int((y + top) / cell - q) + 2, ny)):
                u, v = (p + i + OFF) * cell, (q + j + OFF) * cell
                counts[i, j] += np.int64(covers(center, bearing_0, new_values, k, u, v, 0.0)) - np.int64(
                    covers(center, bearing_0, old_values, k, u, v, 0.0)
                )
