"""The shortest path of a disc through a known world: the reference for path length ratios.

Three steps: A* on a grid whose edges are checked exactly finds the passages, a greedy pass straightens the grid
path, and a search over points on the obstacles' inflated corners near it pulls it taut. Every segment is checked
against every obstacle, so the path never comes nearer than asked.
"""

import heapq
import math

import numpy as np
from numba import njit

from drake_starnav.errors import StarnavError
from drake_starnav.geometry.polyline import arc_lengths, point_to_segment_squared
from drake_starnav.worlds.clearance import clearance as clearance_at
from drake_starnav.worlds.world import World

TOLERANCE = 1e-9  # m, a path may touch the capsules
_MOVES = np.array(
    [(1, 0), (-1, 0), (0, 1), (0, -1), (1, 1), (1, -1), (-1, 1), (-1, -1)]
    + [(1, 2), (2, 1), (2, -1), (1, -2), (-1, -2), (-2, -1), (-2, 1), (-1, 2)]
)
_LENGTHS = np.sqrt((_MOVES**2).sum(axis=1).astype(float))
_POINTS_PER_CIRCLE = 48  # arcs come out 0.14 % too long
_BAND = 0.3  # m, how far from the straightened path its corners are looked for
_LARGEST_GRID = 30_000_000  # cells
_JOINED = 3  # cells to each side, among which start and goal are joined to the grid
_OFF_GRID = 0.0275 * math.sqrt(2.0) * (_JOINED + 0.5)  # cells; a way along the grid is at most 2.75 % longer


def capsules_around(world: World, clearance: float) -> np.ndarray:
    """All obstacles inflated, shape (m, 5): axis x1, y1, x2, y2 and radius. A disc's axis is a point."""
    edges = np.column_stack((world.segments, np.zeros(len(world.segments))))
    return np.vstack((world.discs[:, [0, 1, 0, 1, 2]], edges)) + (0.0, 0.0, 0.0, 0.0, clearance)


@njit(cache=True)
def blocks(ax: float, ay: float, bx: float, by: float, capsule: np.ndarray) -> bool:
    """Whether the segment a b enters the capsule."""
    x1, y1, x2, y2, radius = capsule
    if (
        min(ax, bx) - radius > max(x1, x2)
        or max(ax, bx) + radius < min(x1, x2)
        or min(ay, by) - radius > max(y1, y2)
        or max(ay, by) + radius < min(y1, y2)
    ):
        return False
    side_1 = (bx - ax) * (y1 - ay) - (by - ay) * (x1 - ax)
    side_2 = (bx - ax) * (y2 - ay) - (by - ay) * (x2 - ax)
    side_a = (x2 - x1) * (ay - y1) - (y2 - y1) * (ax - x1)
    side_b = (x2 - x1) * (by - y1) - (y2 - y1) * (bx - x1)
    if side_1 * side_2 < 0.0 and side_a * side_b < 0.0:  # it crosses the axis
        return radius > TOLERANCE
    nearest = min(
        min(point_to_segment_squared(ax, ay, x1, y1, x2, y2), point_to_segment_squared(bx, by, x1, y1, x2, y2)),
        min(point_to_segment_squared(x1, y1, ax, ay, bx, by), point_to_segment_squared(x2, y2, ax, ay, bx, by)),
    )
    return nearest < (radius - TOLERANCE) ** 2


@njit(cache=True)
def blocker(ax: float, ay: float, bx: float, by: float, capsules: np.ndarray) -> int:
    """Index of a capsule that the segment a b enters, -1 if it is free."""
    for k in range(len(capsules)):
        if blocks(ax, ay, bx, by, capsules[k]):
            return k
    return -1


def shortest_path(world: World, clearance: float, resolution: float = 0.05) -> tuple[float, np.ndarray] | None:
    """The shortest way of a disc from the start to the goal of a world.

    The passages are found on a grid, so one narrower than the disc plus about two grid steps can be missed, and of
    two ways around an obstacle whose lengths differ by less than 2 % the longer may be chosen.

    Args:
        world: the obstacles, start and goal.
        clearance: radius of the disc, m: the least distance from the path to any obstacle.
        resolution: grid step, m.

    Returns:
        The length, m, and the path as a polyline of shape (k, 2), m, frame W; None if there is no way.

    Raises:
        StarnavError: clearance or resolution is not positive, or the grid would be too large.
    """
    for name, value in (("clearance", clearance), ("resolution", resolution)):
        if not (math.isfinite(value) and value > 0.0):
            raise StarnavError(f"shortest path: {name} is {value}; allowed: 0 < x m")
    ends = np.array([world.start[:2], world.goal])
    if (clearance_at(world, ends) < clearance).any():
        return None
    capsules = capsules_around(world, clearance)
    if blocker(ends[0, 0], ends[0, 1], ends[1, 0], ends[1, 1], capsules) < 0:
        path = ends
    else:
        origin, shape = _grid(world, clearance, resolution)
        blocked = _blocked_edges(origin, shape, resolution, capsules)
        path = _search_grid(ends, origin, resolution, blocked, capsules)
        if len(path) == 0:
            return None
        path = _pull_taut(_straighten(path, _around(path, capsules)), capsules)
    return _length(path), path


def _around(points: np.ndarray, capsules: np.ndarray) -> np.ndarray:
    """The capsules that reach into the bounding box of points: no other blocks a line between two of them."""
    low, high = points.min(axis=0), points.max(axis=0)
    axes = capsules[:, :4].reshape(-1, 2, 2)
    radius = capsules[:, 4:]
    reaches = (axes.min(axis=1) - radius <= high) & (axes.max(axis=1) + radius >= low)
    return capsules[reaches.all(axis=1)]


def _grid(world: World, clearance: float, resolution: float) -> tuple[np.ndarray, tuple[int, int]]:
    """Origin (2,) and shape of a grid over the world, with a way around the outermost obstacles of an open plane."""
    x0, y0, x1, y1 = world.extent
    pad = 0.0 if world.bounds is not None else clearance
    shape = (int((x1 - x0 + 2.0 * pad) / resolution) + 1, int((y1 - y0 + 2.0 * pad) / resolution) + 1)
    if shape[0] * shape[1] > _LARGEST_GRID:
        raise StarnavError(
            f"shortest path: world {world.name} has {shape[0]} x {shape[1]} grid cells of {resolution:g} m; "
            f"allowed: at most {_LARGEST_GRID} (take a larger resolution)"
        )
    return np.array([x0 - pad, y0 - pad]), shape


def _length(path: np.ndarray) -> float:
    return float(np.hypot(*np.diff(path, axis=0).T).sum())


@njit(cache=True)
def _blocked_edges(origin: np.ndarray, shape: tuple[int, int], resolution: float, capsules: np.ndarray) -> np.ndarray:
    """For every grid point, bit k is set if the edge along `_MOVES[k]` enters a capsule; all bits inside one."""
    blocked = np.zeros(shape, np.uint16)
    longest = math.sqrt(5.0) * resolution
    for c in range(len(capsules)):
        x1, y1, x2, y2, radius = capsules[c]
        reach = radius + longest
        i0 = max(0, int((min(x1, x2) - reach - origin[0]) / resolution))
        i1 = min(shape[0], int((max(x1, x2) + reach - origin[0]) / resolution) + 2)
        j0 = max(0, int((min(y1, y2) - reach - origin[1]) / resolution))
        j1 = min(shape[1], int((max(y1, y2) + reach - origin[1]) / resolution) + 2)
        for i in range(i0, i1):
            for j in range(j0, j1):
                x, y = origin[0] + i * resolution, origin[1] + j * resolution
                distance_squared = point_to_segment_squared(x, y, x1, y1, x2, y2)
                if distance_squared >= reach * reach:
                    continue
                if distance_squared < (radius - TOLERANCE) ** 2:
                    blocked[i, j] = 0xFFFF
                    continue
                for k in range(16):
                    if (blocked[i, j] >> k) & 1:
                        continue
                    u, v = x + _MOVES[k, 0] * resolution, y + _MOVES[k, 1] * resolution
                    if blocks(x, y, u, v, capsules[c]):
                        blocked[i, j] |= np.uint16(1 << k)
    return blocked


@njit(cache=True)
def _search_grid(
    ends: np.ndarray, origin: np.ndarray, resolution: float, blocked: np.ndarray, capsules: np.ndarray
) -> np.ndarray:
    """A* over the free grid edges, shape (k, 2) from start to goal, empty if there is no way."""
    nx, ny = blocked.shape
    goal_x, goal_y = ends[1]
    cost = np.full(nx * ny, np.inf)
    move = np.full(nx * ny, -1, np.int8)  # by which a grid point was reached
    lengths = resolution * _LENGTHS
    queue = [(np.inf, -1)]
    # the ends lie off the grid: join each to the grid points that it sees nearby
    to_goal = np.full((2 * _JOINED + 1, 2 * _JOINED + 1), np.inf)
    for end in range(2):
        i0 = int(round((ends[end, 0] - origin[0]) / resolution))
        j0 = int(round((ends[end, 1] - origin[1]) / resolution))
        for i in range(max(0, i0 - _JOINED), min(nx, i0 + _JOINED + 1)):
            for j in range(max(0, j0 - _JOINED), min(ny, j0 + _JOINED + 1)):
                x, y = origin[0] + i * resolution, origin[1] + j * resolution
                if blocker(ends[end, 0], ends[end, 1], x, y, capsules) < 0:
                    length = math.hypot(x - ends[end, 0], y - ends[end, 1])
                    if end == 1:
                        to_goal[i - i0 + _JOINED, j - j0 + _JOINED] = length
                    else:
                        cost[i * ny + j] = length
                        heapq.heappush(queue, (length + _least(goal_x - x, goal_y - y, resolution), i * ny + j))
    best, last = np.inf, -1
    while True:
        bound, node = heapq.heappop(queue)
        if bound >= best or node < 0:
            break
        i, j = node // ny, node % ny
        x, y = origin[0] + i * resolution, origin[1] + j * resolution
        if bound > cost[node] + _least(goal_x - x, goal_y - y, resolution) + 1e-9:
            continue  # a cheaper way here was found since
        a, b = i - i0 + _JOINED, j - j0 + _JOINED
        if 0 <= a < len(to_goal) and 0 <= b < len(to_goal) and cost[node] + to_goal[a, b] < best:
            best, last = cost[node] + to_goal[a, b], node
        for k in range(16):
            a, b = i + _MOVES[k, 0], j + _MOVES[k, 1]
            if a < 0 or b < 0 or a >= nx or b >= ny or (blocked[i, j] >> k) & 1:
                continue
            through = cost[node] + lengths[k]
            if through < cost[a * ny + b] - 1e-12:
                cost[a * ny + b] = through
                move[a * ny + b] = k
                u, v = origin[0] + a * resolution, origin[1] + b * resolution
                heapq.heappush(queue, (through + _least(goal_x - u, goal_y - v, resolution), a * ny + b))
    path = [(goal_x, goal_y)]
    node = last
    while node >= 0:
        i, j = node // ny, node % ny
        path.append((origin[0] + i * resolution, origin[1] + j * resolution))
        k = move[node]
        if k < 0:
            path.append((ends[0, 0], ends[0, 1]))
            break
        node = (i - _MOVES[k, 0]) * ny + j - _MOVES[k, 1]
    if last < 0:
        return np.empty((0, 2))
    return np.array(path[::-1])


@njit(cache=True)
def _least(dx: float, dy: float, resolution: float) -> float:
    """A lower bound of the way along the grid, m: that of an empty grid, less what the last piece, off it, may save."""
    far, near = max(abs(dx), abs(dy)), min(abs(dx), abs(dy))
    if near < 0.5 * far:
        way = far - 2.0 * near + math.sqrt(5.0) * near
    else:
        way = math.sqrt(5.0) * (far - near) + math.sqrt(2.0) * (2.0 * near - far)
    return (1.0 + 1e-6) * max(way - _OFF_GRID * resolution, 0.0)  # of equal ways, the one that is farthest first


def _straighten(path: np.ndarray, capsules: np.ndarray) -> np.ndarray:
    """The path without the points that the last kept point can see past, shape (k, 2)."""
    keep = [0]
    for k in range(2, len(path)):
        x, y = path[keep[-1]]
        if blocker(x, y, path[k, 0], path[k, 1], capsules) >= 0:
            keep.append(k - 1)
    keep.append(len(path) - 1)
    return path[np.array(keep)]


def _pull_taut(path: np.ndarray, capsules: np.ndarray) -> np.ndarray:
    """The locally shortest path near `path`, shape (k, 2), up to 1e-4 of its length."""
    angle = 2.0 * np.pi / _POINTS_PER_CIRCLE * np.arange(_POINTS_PER_CIRCLE)
    # Neighbours on this circle see one another: their chord touches the inflated obstacle. One end of each axis
    # is enough, since polygons are closed loops.
    around = np.column_stack((np.cos(angle), np.sin(angle))) / math.cos(np.pi / _POINTS_PER_CIRCLE)
    while True:
        band = np.vstack((path.min(axis=0) - _BAND, path.max(axis=0) + _BAND))
        bars = _around(band, capsules)
        corners = np.column_stack((path, arc_lengths(path)))  # with the distance travelled up to each
        points = np.vstack((corners[:-1], _points_near(path, bars, around), corners[-1:]))
        shorter = _shortest_through(points[np.argsort(points[:, 2], kind="stable")], bars)
        done = _length(shorter) > (1.0 - 1e-4) * _length(path)
        path = shorter
        if done:
            return path


@njit(cache=True)
def _points_near(path: np.ndarray, capsules: np.ndarray, around: np.ndarray) -> np.ndarray:
    """Free points on circles about the capsules' first ends, near a path (k, 2); `around` (c, 2) is the unit circle.
    Shape (n, 3): x, y, distance travelled along the path to the nearest point of it."""
    found = [(0.0, 0.0, 0.0)][:0]
    for c in range(len(capsules)):
        centre_x, centre_y, radius = capsules[c, 0], capsules[c, 1], capsules[c, 4] + TOLERANCE
        travelled = 0.0
        close = False
        for k in range(len(path) - 1):
            ax, ay, bx, by = path[k, 0], path[k, 1], path[k + 1, 0], path[k + 1, 1]
            limit = 1.01 * radius + _BAND
            close = close or point_to_segment_squared(centre_x, centre_y, ax, ay, bx, by) < limit * limit
        if not close:
            continue
        for n in range(len(around)):
            x, y = centre_x + radius * around[n, 0], centre_y + radius * around[n, 1]
            nearest, travel, travelled = _BAND * _BAND, -1.0, 0.0
            for k in range(len(path) - 1):
                ax, ay, bx, by = path[k, 0], path[k, 1], path[k + 1, 0], path[k + 1, 1]
                length = math.hypot(bx - ax, by - ay)
                distance = point_to_segment_squared(x, y, ax, ay, bx, by)
                if distance < nearest and length > 0.0:
                    along = ((x - ax) * (bx - ax) + (y - ay) * (by - ay)) / length
                    nearest, travel = distance, travelled + min(length, max(0.0, along))
                travelled += length
            if travel >= 0.0 and blocker(x, y, x, y, capsules) < 0:
                found.append((x, y, travel))
    points = np.empty((len(found), 3))
    for k in range(len(found)):
        points[k, 0], points[k, 1], points[k, 2] = found[k]
    return points


@njit(cache=True)
def _shortest_through(points: np.ndarray, capsules: np.ndarray) -> np.ndarray:
    """The shortest polyline (k, 2) from the first to the last of points (n, 3): x, y, distance travelled, ascending;
    neighbours in it see one another past all capsules (m, 5)."""
    n = len(points)
    cost = np.full(n, np.inf)
    parent = np.full(n, -1, np.int64)
    cost[0] = 0.0
    for j in range(1, n):
        hidden_by = -1  # what hid the last point probably hides the next
        for i in range(j - 1, -1, -1):
            through = cost[i] + math.hypot(points[j, 0] - points[i, 0], points[j, 1] - points[i, 1])
            if through >= cost[j]:
                continue
            ax, ay, bx, by = points[i, 0], points[i, 1], points[j, 0], points[j, 1]
            if hidden_by >= 0 and blocks(ax, ay, bx, by, capsules[hidden_by]):
                continue
            hidden_by = blocker(ax, ay, bx, by, capsules)
            if hidden_by < 0:
                cost[j] = through
                parent[j] = i
    chain = [n - 1]
    while parent[chain[-1]] >= 0:
        chain.append(parent[chain[-1]])
    return points[np.array(chain[::-1]), :2]
