"""How far a point is from the nearest obstacle of a world."""

import math

import numpy as np
from numba import njit

from drake_starnav.errors import StarnavError
from drake_starnav.worlds.world import World


def clearance(world: World, points: np.ndarray) -> np.ndarray:
    """Signed distance from points to the nearest obstacle surface.

    Negative inside a disc, inside a polygon and outside the bounds. Where obstacles overlap it is the smallest of
    their signed distances: exact outside, at least as deep as the deepest single obstacle inside.

    Args:
        world: the obstacles.
        points: shape (n, 2), m, frame W.

    Returns:
        Shape (n,), m; +inf everywhere in a world without obstacles.
    """
    return _nearest(world, points)[0]


def nearest_obstacle(world: World, point: tuple[float, float]) -> tuple[str, float]:
    """What is nearest to a point: a name for messages such as `cylinders[3]`, and the clearance to it, m."""
    distance, index = _nearest(world, np.array([point], dtype=float))
    k = int(index[0])
    for name, count in (
        ("cylinders", len(world.cylinders)),
        ("spheres", len(world.spheres)),
        ("polygons", len(world.polygons)),
    ):
        if k < count:
            return f"{name}[{k}]", float(distance[0])
        k -= count
    return ("bounds", "nothing")[k], float(distance[0])


def _nearest(world: World, points: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    points = np.asarray(points, dtype=float)
    if points.ndim != 2 or points.shape[1] != 2:
        raise StarnavError(f"clearance: points has shape {points.shape}; allowed: (n, 2)")
    bounds = np.array(world.bounds or (-np.inf, -np.inf, np.inf, np.inf), dtype=float)
    return _signed_distances(np.ascontiguousarray(points), world.discs, *world.outlines, bounds)


@njit(cache=True)
def _signed_distances(
    points: np.ndarray, discs: np.ndarray, corners: np.ndarray, first: np.ndarray, boxes: np.ndarray, bounds: np.ndarray
) -> tuple[np.ndarray, np.ndarray]:
    """Signed distance and the number of the nearest obstacle: discs, then polygons, then bounds, then none.

    Args:
        points: shape (n, 2).
        discs: shape (d, 3): x, y, radius.
        corners: shape (c, 2), all polygons' corners one after another.
        first: shape (p + 1,), where each polygon's corners begin.
        boxes: shape (p, 4), each polygon's bounding box; most polygons are ruled out by it alone.
        bounds: shape (4,).
    """
    n_discs, n_polygons = len(discs), len(boxes)
    distance = np.empty(len(points))
    index = np.empty(len(points), np.int64)
    for n in range(len(points)):
        x, y = points[n]
        best = min(min(x - bounds[0], bounds[2] - x), min(y - bounds[1], bounds[3] - y))
        which = n_discs + n_polygons + (1 if math.isinf(best) and best > 0.0 else 0)
        for k in range(n_discs):
            dx, dy, reach = discs[k, 0] - x, discs[k, 1] - y, best + discs[k, 2]
            if reach > 0.0 and dx * dx + dy * dy < reach * reach:
                best = math.sqrt(dx * dx + dy * dy) - discs[k, 2]
                which = k
        for k in range(n_polygons):
            dx = max(boxes[k, 0] - x, x - boxes[k, 2], 0.0)
            dy = max(boxes[k, 1] - y, y - boxes[k, 3], 0.0)
            if dx * dx + dy * dy > max(best, 0.0) ** 2:
                continue
            d = _polygon_distance(x, y, corners[first[k] : first[k + 1]])
            if d < best:
                best = d
                which = n_discs + k
        distance[n] = best
        index[n] = which
    return distance, index


@njit(cache=True)
def _polygon_distance(x: float, y: float, corners: np.ndarray) -> float:
    """Distance to the outline of a polygon, negative inside (even-odd rule)."""
    best = np.inf
    inside = False
    ax, ay = corners[-1]
    for k in range(len(corners)):
        bx, by = corners[k]
        best = min(best, point_to_segment_squared(x, y, ax, ay, bx, by))
        if (ay > y) != (by > y) and x < ax + (y - ay) * (bx - ax) / (by - ay):
            inside = not inside
        ax, ay = bx, by
    return -math.sqrt(best) if inside else math.sqrt(best)


@njit(cache=True, inline="always")
def point_to_segment_squared(x: float, y: float, ax: float, ay: float, bx: float, by: float) -> float:
    """Squared distance from (x, y) to the segment a b, which may be a single point, m^2."""
    ex, ey = bx - ax, by - ay
    length_squared = ex * ex + ey * ey
    t = 0.0
    if length_squared > 0.0:
        t = min(1.0, max(0.0, ((x - ax) * ex + (y - ay) * ey) / length_squared))
    dx, dy = ax + t * ex - x, ay + t * ey - y
    return dx * dx + dy * dy
