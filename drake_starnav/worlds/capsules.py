"""Obstacles inflated to capsules, in which the centre of a disc-shaped robot must not be."""

import numpy as np
from numba import njit

from drake_starnav.geometry.polyline import point_to_segment_squared
from drake_starnav.worlds.world import World

TOLERANCE = 1e-9  # m, a path may touch the capsules


def capsules_around(world: World, clearance: float) -> np.ndarray:
    """All obstacles inflated, shape (m, 5): axis x1, y1, x2, y2 and radius. A disc's axis is a point."""
    discs, segments = world.discs, world.segments
    return np.vstack(
        (
            np.column_stack((discs[:, :2], discs[:, :2], discs[:, 2] + clearance)),
            np.column_stack((segments, np.full(len(segments), clearance))),
        )
    )


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
