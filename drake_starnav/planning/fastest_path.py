"""The fastest known path to the goal: steepest descent of the time-to-go, with unknown space assumed free.

The time-to-go follows from the robot's speed limit, which decreases with the clearance. The grid holds the distance of
every cell to the nearest hit, at most 0.6 of a cell too large. Cells in which the robot would touch a hit at that
distance are blocked, so that a gap too narrow by more than a cell stays closed. If the robot makes no progress although
the grid has a path, the narrowest place ahead is closed, too. The roadmap of regions keeps growing and is searched when
the grid has no path.
"""

import dataclasses
import math
from dataclasses import field

import numpy as np
from numba import njit

from drake_starnav.geometry.polyline import arc_lengths
from drake_starnav.planning.cost_field import UNREACHED, DistanceGrid, bucket_dijkstra
from drake_starnav.robot import RobotParameters
from drake_starnav.utils.snapshot import snapshot

SPARE = 0.004
"""Cells nearer to a hit than the robot's radius plus this are blocked, m."""
BORDER = 3.0
"""The grid reaches this far beyond the goal and where the robot has been, m."""
DOUBLINGS = 3
"""While no path is found, the border is doubled, at most this many times."""
PATH_LENGTH = 3.5
"""Length of the path, m."""
BEYOND_ROBOT = 0.4
"""The search continues until cells on detours of this length are reached, too, m."""
ENTRY = 0.12
"""The path may begin in a cell this far from the robot; the distance to that cell counts three times, m."""
PROGRESS = 0.1
"""The robot makes progress if its time-to-go falls by this, in metres at full speed."""
PATIENCE = 1.5
"""After this time without progress the robot has stalled, s."""
NARROWEST_WITHIN = 0.75
"""If the robot has stalled, the narrowest place within this length of its path is closed, m."""
NARROW = 0.06
"""A place with more clearance than this is not closed, m."""
SETBACK = 0.5
"""A time-to-go that has grown by this belongs to another path, in metres at full speed."""
GOAL_REACH = 0.5
"""A goal in a blocked cell is replaced by the nearest free cell within this, m."""


@snapshot
class ProgressMonitor:
    """Progress monitor of the fastest path. Immutable.

    Attributes:
        best: time-to-go at the last progress, in metres at full speed.
        since: when the last progress was made, s.
        stall_points: shape (k, 2), places treated as blocked, W, m.
        followed: whether the robot follows the fastest path.
    """

    best: float = math.inf
    since: float = 0.0
    stall_points: np.ndarray = field(default_factory=lambda: np.zeros((0, 2)))
    followed: bool = False

    def watched(self, to_go: float, time: float) -> tuple["ProgressMonitor", bool]:
        """The monitor updated with a new time-to-go, and whether the robot has stalled.

        Args:
            to_go: the time-to-go, in metres at full speed.
            time: s.
        """
        if to_go < self.best - PROGRESS or to_go > self.best + SETBACK:
            return dataclasses.replace(self, best=to_go, since=time), False
        if time - self.since > PATIENCE:
            return dataclasses.replace(self, best=math.inf, since=time), True
        return self, False


def fastest_path(
    memory: DistanceGrid,
    position: np.ndarray,
    goal: np.ndarray,
    low: np.ndarray,
    high: np.ndarray,
    stall_points: np.ndarray,
    robot: RobotParameters,
) -> tuple[np.ndarray, float]:
    """The path of least time to the goal, and its time as a length at full speed.

    Args:
        memory: distances to known hits.
        position: of the robot, shape (2,), W, m.
        goal: shape (2,), W, m.
        low, high: corners of the box to be searched, W, m; it is enlarged while no path is found.
        stall_points: shape (k, 2), places treated as blocked, W, m.
        robot: its size, and its speed limit at each clearance.

    Returns:
        The first PATH_LENGTH of the path, shape (k, 2), W, m, and the length, m; no points and infinity if there is no
        path.

    Raises:
        StarnavError: the box has too many cells.
    """
    border = BORDER
    for _ in range(DOUBLINGS + 1):
        distance, first = memory.window(low - border, high + border, stride=1)
        path, to_go = _path_in_window(distance, first, memory.resolution, position, goal, stall_points, robot)
        if len(path):
            return path, to_go
        border *= 2.0
    return np.zeros((0, 2)), math.inf


def narrowest_place(memory: DistanceGrid, path: np.ndarray, robot_radius: float) -> np.ndarray | None:
    """The place with the least clearance at the beginning of the path, shape (2,), W, m; None if none is narrow."""
    ahead = path[arc_lengths(path) <= NARROWEST_WITHIN]
    clearance = memory.distance(ahead) - robot_radius
    least = int(np.argmin(clearance))
    return ahead[least] if clearance[least] < NARROW else None


def _path_in_window(
    distance: np.ndarray,
    first: np.ndarray,
    cell: float,
    position: np.ndarray,
    goal: np.ndarray,
    stall_points: np.ndarray,
    robot: RobotParameters,
) -> tuple[np.ndarray, float]:
    for i, j in np.rint(stall_points / cell).astype(np.int64) - first:
        if i >= 0 and j >= 0:
            distance[max(i - 2, 0) : i + 3, max(j - 2, 0) : j + 3] = 0.0
    weight = _time_weights(
        distance,
        robot.radius,
        SPARE,
        robot.max_speed,
        min(robot.close_speed, robot.max_speed) if robot.speed_per_clearance > 0.0 else robot.max_speed,
        robot.speed_per_clearance,
    )
    last = np.array(distance.shape) - 1
    start_cell = np.clip(np.rint(position / cell).astype(np.int64) - first, 0, last) + 1
    goal_cell = _free_cell_near(weight, np.clip(np.rint(goal / cell).astype(np.int64) - first, 0, last) + 1, cell)
    if goal_cell is None:
        return np.zeros((0, 2)), math.inf
    cost_to_come = np.full(weight.shape, UNREACHED, np.int32)
    cost_to_come[start_cell[0], start_cell[1]] = 0
    margin = round(100.0 * BEYOND_ROBOT / cell)
    cost, _ = bucket_dijkstra(weight, *goal_cell, cost_to_come, margin, *start_cell)
    steps = int(PATH_LENGTH / cell)
    cells, to_go = _descent(cost, start_cell[0], start_cell[1], int(ENTRY / cell), steps)
    return (cells - 1 + first) * cell, to_go * cell / 100.0


def _free_cell_near(weight: np.ndarray, wanted: np.ndarray, cell: float) -> np.ndarray | None:
    """The free cell nearest to the wanted one, within GOAL_REACH; None if there is none."""
    if weight[wanted[0], wanted[1]] > 0:
        return wanted
    reach = int(GOAL_REACH / cell)
    low = np.maximum(wanted - reach, 0)
    free = np.argwhere(weight[low[0] : wanted[0] + reach + 1, low[1] : wanted[1] + reach + 1] > 0) + low
    if not len(free):
        return None
    return free[np.argmin(((free - wanted) ** 2).sum(axis=1))]


@njit(cache=True)
def _time_weights(distance, radius, spare, max_speed, close_speed, per_clearance):
    """Time through each cell relative to full speed, in tenths; 0 in blocked cells and in a border around the grid."""
    nx, ny = distance.shape
    weight = np.zeros((nx + 2, ny + 2), np.int32)
    for i in range(nx):
        for j in range(ny):
            clearance = distance[i, j] - radius
            if clearance >= spare:
                speed = min(max_speed, close_speed + per_clearance * clearance)
                weight[i + 1, j + 1] = int(10.0 * max_speed / speed + 0.5)
    return weight


@njit(cache=True)
def _descent(cost, i, j, entry, steps):
    """Cells of the steepest descent from near (i, j), shape (n, 2), and the cost at the first one."""
    nx, ny = cost.shape
    least, bi, bj = np.inf, -1, -1
    for a in range(max(i - entry, 0), min(i + entry + 1, nx)):
        for b in range(max(j - entry, 0), min(j + entry + 1, ny)):
            if cost[a, b] < UNREACHED:
                worth = cost[a, b] + 300.0 * math.hypot(a - i, b - j)
                if worth < least:
                    least, bi, bj = worth, a, b
    cells = np.empty((steps, 2), np.int64)
    count = 0
    if bi < 0:
        return cells[:0], np.inf
    i, j = bi, bj
    while count < steps:
        cells[count, 0], cells[count, 1] = i, j
        count += 1
        lowest, bi, bj = cost[i, j], -1, -1
        for a in range(max(i - 1, 0), min(i + 2, nx)):
            for b in range(max(j - 1, 0), min(j + 2, ny)):
                if cost[a, b] < lowest:
                    lowest, bi, bj = cost[a, b], a, b
        if bi < 0:
            break
        i, j = bi, bj
    return cells[:count].copy(), least
