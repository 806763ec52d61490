"""The shortest path of a disc through a known world: the reference for path length ratios.

The planner's search finds the passages on a grid over the true map, and string pulling shortens the path. A grid
prefers its own directions; so two are searched, turned to each other, and the shorter path counts. Every segment is
checked against every obstacle, so the path never comes nearer than asked.
"""

import math

import numpy as np

from drake_starnav.errors import StarnavError
from drake_starnav.geometry.compiled import kernel
from drake_starnav.geometry.polyline import (
    measure_arc_lengths,
    measure_capsule_distances,
    square_segment_distance,
    subdivide_polyline,
)
from drake_starnav.geometry.se2 import transform_points
from drake_starnav.planning.bucket_search import search_buckets
from drake_starnav.planning.cost_field import trace_path
from drake_starnav.planning.grid import LARGEST_GRID
from drake_starnav.worlds.clearance import compute_clearance
from drake_starnav.worlds.world import World

TOLERANCE = 1e-9  # m, a path may touch the capsules
_GRID_ANGLES = (0.0, -math.pi / 8.0)  # rad, of the grids: where one makes the worst of a way, the other makes the best
_SPACINGS = (0.2, 0.1, 0.05)  # m, of the points among which a path is shortened
_JOINED_CELLS = 3  # cells to each side, among which start and goal are joined to the grid


def make_capsules(world: World, clearance: float) -> np.ndarray:
    """All obstacles inflated, shape (m, 5): axis x1, y1, x2, y2 and radius. A disc's axis is a point."""
    edges = np.column_stack((world.segments, np.zeros(len(world.segments))))
    return np.vstack((world.discs[:, [0, 1, 0, 1, 2]], edges)) + (0.0, 0.0, 0.0, 0.0, clearance)


@kernel
def is_segment_blocked(ax: float, ay: float, bx: float, by: float, capsule: np.ndarray) -> bool:
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
        min(square_segment_distance(ax, ay, x1, y1, x2, y2), square_segment_distance(bx, by, x1, y1, x2, y2)),
        min(square_segment_distance(x1, y1, ax, ay, bx, by), square_segment_distance(x2, y2, ax, ay, bx, by)),
    )
    return nearest < (radius - TOLERANCE) ** 2


@kernel
def find_blocking_capsule(ax: float, ay: float, bx: float, by: float, capsules: np.ndarray) -> int:
    """Index of a capsule that the segment a b enters, -1 if it is free."""
    for k in range(len(capsules)):
        if is_segment_blocked(ax, ay, bx, by, capsules[k]):
            return k
    return -1


def find_shortest_path(world: World, clearance: float, resolution: float = 0.05) -> tuple[float, np.ndarray] | None:
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
    end_points = np.array([world.start[:2], world.goal])
    if (compute_clearance(world, end_points) < clearance).any():
        return None
    capsules = make_capsules(world, clearance)
    if find_blocking_capsule(*end_points[0], *end_points[1], capsules) < 0:
        return math.dist(*end_points), end_points
    ways = []
    for angle in _GRID_ANGLES:
        between = _search_turned_grid(world, capsules, angle, resolution, clearance)
        if len(between):
            way = _shorten_path(np.vstack((end_points[:1], between, end_points[1:])), capsules)
            ways.append((float(measure_arc_lengths(way)[-1]), way))
    return min(ways, key=lambda found: found[0], default=None)


def _search_turned_grid(world: World, capsules: np.ndarray, angle: float, step: float, radius: float) -> np.ndarray:
    """Points (k, 2) of a free grid, turned by an angle, rad, each in sight of the next, from near the start of a world
    to near its goal; none without a way. `radius` is that of the narrowest capsule, m."""
    x0, y0, x1, y1 = world.extent
    pad = 0.0 if world.bounds is not None else radius  # a way around the outermost obstacles of an open plane
    corners = np.array([(x, y) for x in (x0 - pad, x1 + pad) for y in (y0 - pad, y1 + pad)])
    frame, frame_back = np.array(((0.0, 0.0, angle), (0.0, 0.0, -angle)))
    outer = transform_points(frame, corners)
    box = np.array((outer.min(axis=0), outer.max(axis=0)))
    if math.prod((box[1] - box[0]) / step) > LARGEST_GRID:
        raise StarnavError(
            f"shortest path: the grid of world {world.name} has more than {LARGEST_GRID:.0e} cells of {step:g} m; "
            "allowed: a larger resolution"
        )
    axes = [transform_points(frame, capsules[:, k : k + 2]) for k in (0, 2)]
    places = transform_points(frame, np.array([world.start[:2], world.goal]))
    between = _search_grid(places, box, np.column_stack((*axes, capsules[:, 4])), step, radius)
    return transform_points(frame_back, between)


def _search_grid(places: np.ndarray, box: np.ndarray, capsules: np.ndarray, step: float, radius: float) -> np.ndarray:
    """The same of two places in a box, for a grid along its sides."""
    spare = math.hypot(radius, math.hypot(0.5, 0.5) * step) - radius  # of two such neighbours, their line is free
    nx, ny = ((box[1] - box[0]) / step).astype(int) + 1
    free = measure_capsule_distances(box[0], (nx, ny), step, spare + step, capsules) > spare
    begin, goal = (_find_nearest_in_sight(end, box[0], step, free, capsules) for end in places)
    if begin is None or goal is None:
        return np.empty((0, 2))
    weight = np.pad(10 * free.astype(np.uint8), 1)
    cost = np.zeros(weight.shape, np.int32)
    search_buckets(weight, cost, goal, begin)
    return box[0] + (trace_path(cost, weight, *map(float, begin)) - 1) * step


def _find_nearest_in_sight(end, origin, step, free, capsules) -> tuple[int, int] | None:
    """The nearest free cell of a grid with a border that an end (2,) sees, among _JOINED_CELLS to each side."""
    low = np.maximum(np.rint((end - origin) / step).astype(int) - _JOINED_CELLS, 0)
    cells = low + np.argwhere(free[low[0] :, low[1] :][: 2 * _JOINED_CELLS + 1, : 2 * _JOINED_CELLS + 1])
    for k in np.hypot(*(origin + cells * step - end).T).argsort(kind="stable"):
        if find_blocking_capsule(*end, *(origin + cells[k] * step), capsules) < 0:
            return int(cells[k, 0]) + 1, int(cells[k, 1]) + 1
    return None


def _shorten_path(path: np.ndarray, capsules: np.ndarray) -> np.ndarray:
    """The path (k, 2) shortened among points along it, to 0.2 % of what capsules allow near it."""
    capsules = _select_capsules_near(path, capsules)
    path, previous_length = _straighten(path, capsules), np.inf
    while measure_arc_lengths(path)[-1] < (1.0 - 1e-4) * previous_length:
        previous_length = measure_arc_lengths(path)[-1]
        for spacing in _SPACINGS:
            points = subdivide_polyline(path, spacing)
            points[-1] = path[-1]  # without its rounding
            path = _find_shortest_polyline(points, capsules)
    return path


def _select_capsules_near(points: np.ndarray, capsules: np.ndarray) -> np.ndarray:
    """The capsules that reach into the bounding box of points: no other blocks a line between two of them."""
    low, high = points.min(axis=0), points.max(axis=0)
    axes = capsules[:, :4].reshape(-1, 2, 2)
    radius = capsules[:, 4:]
    reaches = (axes.min(axis=1) - radius <= high) & (axes.max(axis=1) + radius >= low)
    return capsules[reaches.all(axis=1)]


def _straighten(path: np.ndarray, capsules: np.ndarray) -> np.ndarray:
    """The path without the points that the last kept point can see past, shape (k, 2)."""
    keep = [0]
    for k in range(2, len(path)):
        x, y = path[keep[-1]]
        if find_blocking_capsule(x, y, path[k, 0], path[k, 1], capsules) >= 0:
            keep.append(k - 1)
    keep.append(len(path) - 1)
    return path[np.array(keep)]


@kernel
def _find_shortest_polyline(points: np.ndarray, capsules: np.ndarray) -> np.ndarray:
    """The shortest polyline (k, 2) from the first to the last of points (n, 2), in their order; neighbours in it see
    one another past all capsules (m, 5)."""
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
            if hidden_by >= 0 and is_segment_blocked(ax, ay, bx, by, capsules[hidden_by]):
                continue
            hidden_by = find_blocking_capsule(ax, ay, bx, by, capsules)
            if hidden_by < 0:
                cost[j] = through
                parent[j] = i
    chain = [n - 1]
    while parent[chain[-1]] >= 0:
        chain.append(parent[chain[-1]])
    return points[np.array(chain[::-1])]


@kernel
def compute_capsule_distance(capsules, x, y):
    """Distance of a place to the nearest capsule, m; less than 0 in one."""
    least = np.inf
    for c in range(len(capsules)):
        x1, y1, x2, y2, radius = capsules[c]
        least = min(least, math.sqrt(square_segment_distance(x, y, x1, y1, x2, y2)) - radius)
    return least
