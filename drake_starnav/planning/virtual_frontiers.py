"""Virtual frontiers: places where the optimistic path leaves the regions though no region shows a frontier."""

import math

import numpy as np
from numba import njit

from drake_starnav.planning.distance_grid import STRIDE
from drake_starnav.planning.frontiers import Frontiers
from drake_starnav.planning.roadmap import StarRoadmap
from drake_starnav.regions.region_union import cover_at

VIRTUAL_FRONTIER_LENGTH = 0.2
"""The optimistic path leaves the regions where it stays outside for this length, m."""


def virtual_frontier(roadmap: StarRoadmap, path: np.ndarray) -> tuple[Frontiers, np.ndarray]:
    """Where the optimistic path leaves the union of regions, as a frontier of one row, and the path up to there.

    Edge frontiers appear where the boundary of a region jumps. A gap that is seen at a slant, or is thinner than the
    fit resolves, has none although the hits leave it open. The way to a frontier over nodes may also be a detour.

    Args:
        roadmap: its regions.
        path: shape (k, 2), from the robot to the goal in small steps, W, m.
    """
    union = roadmap.union
    path, last, end = _leaving(path, 0.5 * STRIDE * roadmap.hits.resolution, union)
    if end < 0:
        return Frontiers.none(), path[:0]
    viewpoint, probe = path[last], path[end]
    owner = cover_at(union, *viewpoint, 0.0) if last else len(roadmap) - 1
    return Frontiers(viewpoint[None, :].copy(), probe[None, :].copy(), np.array([owner])), path[: last + 1]


@njit(cache=True)
def _leaving(path, half_cell, union):
    """Where a path (k, 2) leaves a union for longer than VIRTUAL_FRONTIER_LENGTH, or ends outside.

    Returns the path, each point moved to a place inside in its cell if there is one, the index of the last one inside,
    or 0, as the robot may stand a little outside, and of the one where the path has left; -1 if it does not.
    """
    path, last, outside = path.copy(), 0, 0.0
    for i in range(len(path)):
        inside = False
        for k in range(9):  # the centre, then around it
            turn = 0.25 * math.pi * (k - 1)
            x = path[i, 0] + (half_cell * math.cos(turn) if k else 0.0)
            y = path[i, 1] + (half_cell * math.sin(turn) if k else 0.0)
            if cover_at(union, x, y, 0.0) >= 0:
                path[i, 0], path[i, 1], inside = x, y, True
                break
        if inside:
            last, outside = i, 0.0
        elif i > 0:
            outside += math.hypot(path[i, 0] - path[i - 1, 0], path[i, 1] - path[i - 1, 1])
            if outside >= VIRTUAL_FRONTIER_LENGTH or i == len(path) - 1:
                return path, last, i
    return path, last, -1
