"""Polylines and polygons: simplified, resampled, subdivided, and how far places are from them."""

import math

import numpy as np
import shapely
from numba.extending import register_jitable

from drake_starnav.geometry.compiled import kernel, leaf


def simplify_polyline(points: np.ndarray, tolerance: float) -> np.ndarray:
    """The corners (k, 2) of a polyline (n, 2) without those whose loss moves it by no more than `tolerance`, m.

    Source: D. H. Douglas and T. K. Peucker, Algorithms for the reduction of the number of points required to represent
    a digitized line or its caricature, 1973.
    """
    if len(points) < 3:
        return points
    return shapely.get_coordinates(shapely.LineString(points).simplify(tolerance, preserve_topology=False))


def measure_segment_distance(points: np.ndarray, start: np.ndarray, end: np.ndarray) -> np.ndarray:
    """Distance of points of shape (n, 2) to the segment between two of shape (2,), shape (n,), m."""
    segment_vector = end - start
    length_squared = float(segment_vector @ segment_vector)
    share = np.clip((points - start) @ segment_vector / length_squared, 0.0, 1.0) if length_squared > 0.0 else 0.0
    return np.hypot(*(points - start - np.multiply.outer(share, segment_vector)).T)


@register_jitable
def compute_third_side(a, b, cosine):
    """The third side of a triangle from two others and the cosine of the angle between them, m; or of many."""
    return np.sqrt(np.maximum(a * a + b * b - 2.0 * a * b * cosine, 0.0))


def measure_signed_distance(polygon: np.ndarray, points: np.ndarray) -> np.ndarray:
    """Distance of points (m, 2) to the outline of a polygon (n, 2), negative inside; shape (m,), m."""
    area, places = shapely.Polygon(polygon), shapely.points(points)
    edge_distance = shapely.distance(places, area.exterior)
    return np.where(shapely.contains(area, places), -edge_distance, edge_distance)


def around(polygon: np.ndarray, distance: float, step: float) -> np.ndarray:
    """Points (k, 2) along the outline of a polygon (n, 2), or on both sides of it at a distance, `step` apart, m."""
    ring = shapely.LinearRing(polygon)
    line = ring.buffer(distance).boundary if distance > 0.0 else ring
    return shapely.get_coordinates(shapely.segmentize(line, step))


@leaf
def square_segment_distance(x, y, ax, ay, bx, by):
    """Squared distance, m^2, from (x, y) to the segment a b, which may be a point; for compiled functions."""
    ex, ey = bx - ax, by - ay
    length_squared = ex * ex + ey * ey
    t = 0.0
    if length_squared > 0.0:
        t = min(1.0, max(0.0, ((x - ax) * ex + (y - ay) * ey) / length_squared))
    dx, dy = ax + t * ex - x, ay + t * ey - y
    return dx * dx + dy * dy


@kernel
def measure_capsule_distances(origin, shape, step, reach, capsules):
    """How far the points of a grid are from the nearest capsule, up to `reach`, m; shape as asked.

    Args:
        origin: the first point, shape (2,), m.
        shape: of the grid.
        step: between its points, m.
        reach: m.
        capsules: rows x1, y1, x2, y2, radius, m.
    """
    room = np.full(shape, reach)
    for c in range(len(capsules)):
        x1, y1, x2, y2, radius = capsules[c]
        farthest_distance = reach + radius
        i0 = int((min(x1, x2) - farthest_distance - origin[0]) / step)
        i1 = int((max(x1, x2) + farthest_distance - origin[0]) / step) + 2
        j0 = int((min(y1, y2) - farthest_distance - origin[1]) / step)
        j1 = int((max(y1, y2) + farthest_distance - origin[1]) / step) + 2
        for i in range(max(i0, 0), min(i1, shape[0])):
            for j in range(max(j0, 0), min(j1, shape[1])):
                x, y = origin[0] + i * step, origin[1] + j * step
                capsule_distance = math.sqrt(square_segment_distance(x, y, x1, y1, x2, y2)) - radius
                room[i, j] = min(room[i, j], capsule_distance)
    return room


def resample_polyline(points: np.ndarray, step: float) -> np.ndarray:
    """Points (k, 2) along a polyline (n, 2) at equal distances of at most `step`, both ends included, m."""
    travelled_length = measure_arc_lengths(points)
    at = np.linspace(0.0, travelled_length[-1], int(np.ceil(travelled_length[-1] / step)) + 1)
    return np.column_stack([np.interp(at, travelled_length, coordinate) for coordinate in points.T])


@kernel
def subdivide_polyline(points, step):
    """Points (k, 2) along a polyline (n, 2) at most `step` apart, all of its corners included, m."""
    counts = np.ones(len(points), np.int64)
    for k in range(1, len(points)):
        segment_length = math.hypot(points[k, 0] - points[k - 1, 0], points[k, 1] - points[k - 1, 1])
        counts[k] = int(segment_length / step) + 1
    out, n = np.empty((counts.sum(), 2)), 0
    for k in range(len(points)):
        for m in range(1, counts[k] + 1):
            for c in range(2):
                out[n, c] = (
                    points[k - 1, c] + (points[k, c] - points[k - 1, c]) * (m / counts[k]) if k else points[0, c]
                )
            n += 1
    return out


def measure_arc_lengths(points: np.ndarray) -> np.ndarray:
    """Length of a polyline up to each of its points; shape (n, 2) -> (n,), m."""
    return np.concatenate(([0.0], np.hypot(*np.diff(points, axis=0).T).cumsum()))
