"""Polylines: a driven path with as few corners as it can be drawn with."""

import numpy as np


def simplified(points: np.ndarray, tolerance: float) -> np.ndarray:
    """The corners that a polyline keeps if none of its points may lie farther than `tolerance` from what is left.

    Args:
        points: shape (n, 2), m; n >= 1.
        tolerance: m, >= 0.

    Returns:
        Shape (k, 2), 1 <= k <= n: the first point, the last, and those between that are needed.

    Source: D. H. Douglas and T. K. Peucker, Algorithms for the reduction of the number of points, 1973.
    """
    keep = np.zeros(len(points), dtype=bool)
    keep[[0, -1]] = True
    spans = [(0, len(points) - 1)]
    while spans:
        first, last = spans.pop()
        if last - first < 2:
            continue
        distance = distance_to_segment(points[first + 1 : last], points[first], points[last])
        worst = int(np.argmax(distance))
        if distance[worst] > tolerance:
            middle = first + 1 + worst
            keep[middle] = True
            spans += [(first, middle), (middle, last)]
    return points[keep]


def distance_to_segment(points: np.ndarray, start: np.ndarray, end: np.ndarray) -> np.ndarray:
    """Distance of points of shape (n, 2) to the segment between two of shape (2,), shape (n,), m."""
    along = end - start
    length_squared = float(along @ along)
    share = np.clip((points - start) @ along / length_squared, 0.0, 1.0) if length_squared > 0.0 else 0.0
    return np.hypot(*(points - start - np.multiply.outer(share, along)).T)


def resampled(points: np.ndarray, step: float) -> np.ndarray:
    """Points along a polyline at even distances of at most `step`, both ends among them.

    Args:
        points: shape (n, 2), m; n >= 1.
        step: m, > 0.

    Returns:
        Shape (k, 2), m.
    """
    travelled = np.concatenate(([0.0], np.hypot(*np.diff(points, axis=0).T).cumsum()))
    at = np.linspace(0.0, travelled[-1], int(np.ceil(travelled[-1] / step)) + 1)
    return np.column_stack([np.interp(at, travelled, coordinate) for coordinate in points.T])
