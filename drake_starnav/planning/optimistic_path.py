"""The optimistic path to the goal: where it leaves the regions, how it goes on from a target, and what blocks it."""

import math

import numpy as np
from numba import njit

from drake_starnav.geometry.polyline import arc_lengths
from drake_starnav.planning.cost_field import CostField
from drake_starnav.planning.distance_grid import STRIDE
from drake_starnav.planning.frontiers import Frontiers
from drake_starnav.planning.roadmap import StarRoadmap
from drake_starnav.regions.region_union import cover_at

NEXT = 1.0
"""Length of the next part of the optimistic path, to which the robot may turn, m."""
OBSTRUCTION_SLACK = 0.06
"""A hit blocks a path if it is nearer than the robot's radius minus this, m: noise and the size of cells."""
VIRTUAL_FRONTIER_LENGTH = 0.2
"""The optimistic path leaves the regions where it stays outside for this length, m."""


def optimistic_path_beyond(to_go: CostField, target: Frontiers) -> np.ndarray:
    """From the probe of a target (a single row) to the goal, shape (k, 2), W, m; only the probe if there is no way."""
    return np.vstack((target.probe, to_go.path(target.probe[0])))


def next_segment_of(path: np.ndarray, to_go: CostField, position: np.ndarray) -> np.ndarray:
    """The next part of an optimistic path (k, 2), for a robot at `position` (2,).

    Only the probe if that is no nearer to the goal than the robot, since the path would lead back past the robot.
    """
    here, there = to_go.at(np.vstack((position, path[:1])))
    return path[:1] if there >= here else path[: 1 + index_along(path, NEXT)]


def index_along(path: np.ndarray, length: float) -> int:
    """Number of segments of a path (k, 2) that end before `length`, m."""
    return int(np.searchsorted(arc_lengths(path)[1:], length))


@njit(cache=True)
def is_obstructed(path, points, robot_radius):
    """Whether points (n, 2) that the robot must not touch block an optimistic path (k, 2), all in W, m.

    Every second point of the path counts, as its steps are shorter than the robot. The first one, the probe, does not:
    it may lie near the obstacle at which the target was found.
    """
    distance = robot_radius - OBSTRUCTION_SLACK
    low_x = low_y = np.inf
    high_x = high_y = -np.inf
    for j in range(len(points)):
        x, y = points[j]
        low_x, high_x, low_y, high_y = min(low_x, x), max(high_x, x), min(low_y, y), max(high_y, y)
    for i in range(1, len(path), 2):
        x, y = path[i]
        if x < low_x - distance or x > high_x + distance or y < low_y - distance or y > high_y + distance:
            continue  # most of a long path is out of the scan's reach
        for j in range(len(points)):
            dx, dy = points[j, 0] - x, points[j, 1] - y
            if dx * dx + dy * dy < distance * distance:
                return True
    return False


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
