"""String pulling: paths shortened inside the union of regions."""

import math

import numpy as np

from drake_starnav.geometry.compiled import kernel
from drake_starnav.geometry.polyline import subdivide_polyline
from drake_starnav.surroundings.region_union import RegionUnion, find_covering_region, find_first_departure

FORWARD_STEP, BACKWARD_STEP = 0.8, 0.4
"""Spacing of the points that the path may skip to, in the first and in the second pass, in radii of the robot."""
LOOKAHEAD = 4.0
"""Length of the part of a path in which its farthest visible point is sought, in radii of the robot."""


def pull_string(path: np.ndarray, position: np.ndarray, regions: RegionUnion, radius: float) -> np.ndarray:
    """Return the path shortened inside the union of regions: from the robot forwards, then, finer, backwards.

    Args:
        path: shape (k, 2), way points after the robot, W, m.
        position: of the robot, shape (2,), W, m.
        regions: whose union bounds the path.
        radius: of the robot, m.

    Returns:
        Shape (m, 2), W, m; ends where the path ends. A path of less than two points is as it was.
    """
    return _pull_line(np.vstack((position, path)), regions, radius) if len(path) > 1 else path


@kernel
def _pull_line(line, regions, radius):
    """Run the loop of `pull_string`, of a path that begins at the robot, shape (k, 2)."""
    forward = _pull(subdivide_polyline(line, FORWARD_STEP * radius), regions, radius)
    points = subdivide_polyline(forward, BACKWARD_STEP * radius)[::-1].copy()
    points[0, 0], points[0, 1] = forward[-1, 0], forward[-1, 1]  # without its rounding
    backward = _pull(points, regions, radius)
    is_whole = math.hypot(backward[-1, 0] - line[0, 0], backward[-1, 1] - line[0, 1]) <= 1e-6
    return (backward[::-1][1:] if is_whole and len(backward) > 1 else forward[1:]).copy()


@kernel
def find_last_in_sight(points, x, y, union, radius):
    """Return the index of the last of some points (n, 2) in sight from (x, y) inside a union, or -1, for a robot."""
    if find_covering_region(union, x, y, 0.0) < 0:
        return -1
    departure = 0.0  # where the last line left the union: the next one probably does, too
    for j in range(len(points) - 1, -1, -1):
        departure = find_first_departure(union, (x, y), (points[j, 0], points[j, 1]), departure, radius)
        if departure < 0.0:
            return j
    return -1


@kernel
def find_farthest_in_sight(path, x, y, union, radius):
    """Return the index of the last point of a path (k, 2) in line of sight from (x, y) inside a union, or -1.

    None is farther along the path than LOOKAHEAD; all in W, m, for a robot of a radius.
    """
    union, count, path_length = RegionUnion(*union), 0, 0.0
    while count < len(path) and path_length < LOOKAHEAD * radius:
        count += 1
        if count < len(path):
            path_length += math.hypot(path[count, 0] - path[count - 1, 0], path[count, 1] - path[count - 1, 1])
    return find_last_in_sight(path[:count], x, y, union, radius)


@kernel
def _pull(points, regions, radius):
    """Return the first of some points (n, 2), and on from it repeatedly the last one in line of sight."""
    kept_points, n, i = np.empty_like(points), 1, 1
    kept_points[0, 0] = points[0, 0]
    kept_points[0, 1] = points[0, 1]  # not as rows: Numba would compile an error's text
    while i < len(points):
        i += max(find_last_in_sight(points[i:], kept_points[n - 1, 0], kept_points[n - 1, 1], regions, radius), 0)
        kept_points[n, 0], kept_points[n, 1] = points[i, 0], points[i, 1]
        n, i = n + 1, i + 1
    return kept_points[:n]
