"""Whether a body that is no disc has a way through a known world: a search over places and headings."""

import heapq
import math

import numpy as np
import shapely

from drake_starnav.geometry.compiled import kernel
from drake_starnav.geometry.footprint import Footprint
from drake_starnav.geometry.polyline import measure_capsule_distances, resample_polyline
from drake_starnav.worlds.shortest_path import make_capsules
from drake_starnav.worlds.world import World

LATTICES = ((0.05, 64), (0.025, 128))
"""Grid step, m, and number of headings: the second where the first finds no way."""
MOST_STATES = 60_000_000
"""A lattice of more states is not searched."""
_DISC_DEPTH = 0.04  # m, from the outline to the middles of the discs along it
_CELL_STEPS = np.array([(1, 0), (-1, 0), (0, 1), (0, -1), (1, 1), (1, -1), (-1, 1), (-1, -1)])


def has_passage(world: World, robot: Footprint, spare: float = 0.0, yaw: float | None = None) -> bool:
    """Whether a robot that is no disc has a way from the start of a world to its goal.

    It may turn and move as it likes, which no base can in less room. Passages in which it has less than 2 to 3 cm to
    both sides can be missed.

    Args:
        world: the obstacles, start and goal.
        robot: what it covers.
        spare: kept to all sides, m.
        yaw: its heading at the goal, rad; any without one.
    """
    capsules = make_capsules(world, spare)
    x0, y0, x1, y1 = world.extent
    pad = 0.0 if world.bounds is not None else 2.0 * robot.radius
    box = np.array((x0 - pad, y0 - pad, x1 + pad, y1 + pad))
    discs = _make_inner_discs(robot)
    end = np.array((*world.goal, math.nan if yaw is None else yaw))
    for step, headings in LATTICES:
        if np.prod((box[2:] - box[:2]) / step + 2.0) * headings > MOST_STATES:
            return False
        if _search_poses(np.array(world.start), end, box, (step, headings), discs, capsules):
            return True
    return False


def _make_inner_discs(robot: Footprint) -> np.ndarray:
    """Discs (x, y, radius) that reach the outline of each part from inside, and its corners, shape (n, 3).

    The first is about the origin and has the robot's radius: where that one is free, all are.
    """
    rows = [np.array([(0.0, 0.0, robot.radius)])]
    for part in robot.parts:
        inner_depths = _DISC_DEPTH
        while (inner := shapely.Polygon(part).buffer(-inner_depths, join_style="mitre")).is_empty:
            inner_depths *= 0.5
        line = resample_polyline(shapely.get_coordinates(inner.exterior), inner_depths)
        # discs of this radius so far apart leave nothing of the line's parallel open
        radius = math.hypot(inner_depths, 0.5 * inner_depths)
        rows += [np.column_stack((line, np.full(len(line), radius))), np.column_stack((part, np.zeros(len(part))))]
    return np.vstack(rows)


@kernel
def _is_free(x, y, yaw, room, origin, step, discs):
    """Whether all discs of a body at a pose are free, by distances between grid points."""
    cosine, sine = math.cos(yaw), math.sin(yaw)
    for k in range(len(discs)):
        dx, dy, radius = discs[k]
        u = (x + cosine * dx - sine * dy - origin[0]) / step
        v = (y + sine * dx + cosine * dy - origin[1]) / step
        i, j = int(math.floor(u)), int(math.floor(v))
        if i < 0 or j < 0 or i + 1 >= room.shape[0] or j + 1 >= room.shape[1]:
            return False
        a, b = u - i, v - j
        low = (1.0 - a) * room[i, j] + a * room[i + 1, j]
        high = (1.0 - a) * room[i, j + 1] + a * room[i + 1, j + 1]
        distance = (1.0 - b) * low + b * high
        if k == 0 and distance > radius:
            return True
        if k > 0 and distance <= radius:
            return False
    return True


@kernel
def _search_poses(start, end, box, lattice, discs, capsules):
    """Whether a search from the start, nearest to the goal first, comes within a grid step of the goal."""
    step, headings = lattice
    turn = 2.0 * math.pi / headings
    start_column, start_row = int((start[0] - box[0]) / step) + 1, int((start[1] - box[1]) / step) + 1
    origin = np.array((start[0] - start_column * step, start[1] - start_row * step))
    shape = (start_column + int((box[2] - start[0]) / step) + 2, start_row + int((box[3] - start[1]) / step) + 2)
    room = measure_capsule_distances(origin, shape, step, discs[0, 2] + step, capsules)
    is_visited = np.zeros((shape[0], shape[1], headings), np.bool_)
    is_visited[start_column, start_row, 0] = True
    queue = [(0.0, start_column, start_row, 0)]
    while len(queue):
        _, i, j, k = heapq.heappop(queue)
        x, y, yaw = origin[0] + i * step, origin[1] + j * step, start[2] + k * turn
        heading_error = abs((yaw - end[2] + math.pi) % (2.0 * math.pi) - math.pi)
        if math.hypot(x - end[0], y - end[1]) <= step and not heading_error > turn:
            return True
        for m in range(len(_CELL_STEPS) + 2):
            a, b, c = i, j, k
            if m < len(_CELL_STEPS):
                a, b = i + _CELL_STEPS[m, 0], j + _CELL_STEPS[m, 1]
            else:
                c = (k + (1 if m == len(_CELL_STEPS) else headings - 1)) % headings
            if a < 0 or b < 0 or a >= shape[0] or b >= shape[1] or is_visited[a, b, c]:
                continue
            is_visited[a, b, c] = True
            u, v = origin[0] + a * step, origin[1] + b * step
            if _is_free(u, v, start[2] + c * turn, room, origin, step, discs):
                heapq.heappush(queue, (math.hypot(u - end[0], v - end[1]), a, b, c))
    return False
