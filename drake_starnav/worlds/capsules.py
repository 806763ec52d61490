"""Obstacles inflated to capsules, in which the centre of a disc-shaped robot must not be."""

import numpy as np
from numba import njit

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


@njit(cache=True)
def _segment_to_segment_squared(
    ax: float, ay: float, bx: float, by: float, cx: float, cy: float, dx: float, dy: float
) -> float:
    """Squared distance between the segments a b and c d, m^2."""
    side_c = (bx - ax) * (cy - ay) - (by - ay) * (cx - ax)
    side_d = (bx - ax) * (dy - ay) - (by - ay) * (dx - ax)
    side_a = (dx - cx) * (ay - cy) - (dy - cy) * (ax - cx)
    side_b = (dx - cx) * (by - cy) - (dy - cy) * (bx - cx)
    if side_c * side_d < 0.0 and side_a * side_b < 0.0:
        return 0.0
    return min(
        min(point_to_segment_squared(ax, ay, cx, cy, dx, dy), point_to_segment_squared(bx, by, cx, cy, dx, dy)),
        min(point_to_segment_squared(cx, cy, ax, ay, bx, by), point_to_segment_squared(dx, dy, ax, ay, bx, by)),
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
    return _segment_to_segment_squared(ax, ay, bx, by, x1, y1, x2, y2) < (radius - TOLERANCE) ** 2


@njit(cache=True)
def blocker(ax: float, ay: float, bx: float, by: float, capsules: np.ndarray) -> int:
    """Index of a capsule that the segment a b enters, -1 if it is free."""
    for k in range(len(capsules)):
        if blocks(ax, ay, bx, by, capsules[k]):
            return k
    return -1
