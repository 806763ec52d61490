"""The optimistic path from the target to the goal, and whether a new scan blocks it."""

import numpy as np
from numba import njit

from drake_starnav.geometry.polyline import arc_lengths
from drake_starnav.planning.cost_field import CostField
from drake_starnav.planning.distance_grid import HIT_ERROR
from drake_starnav.planning.frontiers import Frontiers

NEXT = 1.0
"""Length of the next part of the optimistic path, to which the robot may turn, m."""


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
    distance = robot_radius - HIT_ERROR
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
