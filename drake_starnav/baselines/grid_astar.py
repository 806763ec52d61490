"""A plain A* on a grid of hits, in which what is unknown is free: what a planner needs at the least."""

import numpy as np
from scipy.spatial import cKDTree

from drake_starnav.planning.bucket_search import search_buckets
from drake_starnav.planning.cost_field import CostField
from drake_starnav.planning.grid import Grid

CELL = 0.4
"""Size of a cell, in radii of the robot."""
SLACK = 0.1
"""Cells count as free up to this much nearer to a hit than the radius, in radii: a tight way may miss centres."""
SOFT_ZONE, SOFT_COST = 0.5, 1.0
"""Beyond the radius, over this distance in radii, cells cost more, by up to this share."""
BORDER = 4.0
"""The grid reaches this far beyond hits, robot and goal, in radii."""


def add_hits(hits: np.ndarray, new: np.ndarray, radius: float) -> np.ndarray:
    """Return hits (n, 2) and new ones (m, 2), W, m, one in each quarter of a cell of a robot of this radius."""
    all_hits = np.vstack((hits, new))
    _, first_indices = np.unique(np.floor(all_hits / (0.25 * CELL * radius)), axis=0, return_index=True)
    return all_hits[np.sort(first_indices)]


def plan_on_grid(hits: np.ndarray, position: np.ndarray, goal: np.ndarray, radius: float) -> np.ndarray:
    """Return the shortest way from the robot to the goal over cells that no hit blocks.

    Args:
        hits: shape (n, 2), W, m.
        position, goal: shape (2,), W, m.
        radius: of the robot, m.

    Returns:
        Way points, shape (k, 2), W, m: the farthest in straight reach, the cells after it, the goal. Empty: no way.
    """
    cell_size = CELL * radius
    known_points = np.vstack((hits, position, goal))
    origin = known_points.min(axis=0) - BORDER * radius
    grid_shape = np.ceil((known_points.max(axis=0) + BORDER * radius - origin) / cell_size).astype(int)
    cell_centers = origin + cell_size * np.stack(np.meshgrid(*map(np.arange, grid_shape), indexing="ij"), axis=-1)
    weight = _weigh_cells(cell_centers, hits, radius)
    start, end = (np.rint((place - origin) / cell_size).astype(int) for place in (position, goal))
    cost = np.zeros(weight.shape, np.int32)
    search_buckets(weight, cost, tuple(end.tolist()), tuple(start.tolist()))
    field = CostField(cost, weight, origin / cell_size + 1.0, cell_size, Grid.empty(0.5 * cell_size, 0.0))
    path = field.path(position)
    if not len(path):
        return path
    path = np.vstack((path, goal))
    reach = next((k for k in range(len(path) - 1, 0, -1) if _is_free(weight, position, path[k], origin, cell_size)), 0)
    return path[reach:]


def _weigh_cells(cell_centers: np.ndarray, hits: np.ndarray, radius: float) -> np.ndarray:
    """Return what it costs to cross each cell, more near hits; 0 of those that hits block, and along the border."""
    hit_distances = np.full(cell_centers.shape[:2], np.inf)
    if len(hits):
        hit_distances, _ = cKDTree(hits).query(cell_centers, distance_upper_bound=(1.0 + SOFT_ZONE) * radius)
    soft = np.clip(1.0 - (hit_distances / radius - 1.0) / SOFT_ZONE, 0.0, 1.0)
    weight = np.where(hit_distances < (1.0 - SLACK) * radius, 0.0, 10.0 * (1.0 + SOFT_COST * soft)).astype(np.uint8)
    weight[0] = weight[-1] = weight[:, 0] = weight[:, -1] = 0
    return weight


def _is_free(weight: np.ndarray, begin: np.ndarray, end: np.ndarray, origin: np.ndarray, cell: float) -> bool:
    """Return whether a straight line leads over free cells only, but for the one where it begins."""
    count = int(2.0 * np.hypot(*(end - begin)) / cell) + 2
    cells = np.rint((np.linspace(begin, end, count)[2:] - origin) / cell).astype(int)
    return bool((weight[cells[:, 0], cells[:, 1]] > 0).all())
