"""The obstacles that DSM needs: circles, each with a reference point that overlapping circles share.

A wall is also a circle, so large that it is practically straight. Circles that overlap when inflated leave no gap
between them, and the flow around each must divide at the same place: for each group that place is the mean of the
midpoints of their overlaps, or the point nearest to it that still lies in the circle. A wall cannot be passed on its
other side, so the flow around a group that overlaps a wall divides in that overlap, and the wall keeps its centre.
Source: Huber, Billard and Slotine, "Avoidance of convex and concave obstacles with convergence ensured through
contraction", RA-L 2019, on overlapping obstacles.
"""

import numpy as np
from scipy.sparse.csgraph import connected_components

from drake_starnav.errors import UnsupportedError
from drake_starnav.utils.snapshot import snapshot
from drake_starnav.worlds.world import World

WALL_RADIUS = 1e5
"""Radius of the circle that stands for a wall: over 20 m it is straight to half a millimetre, m."""
DEPTH = 0.99
"""A reference point is at most this share of the inflated radius away from its circle's centre."""


@snapshot
class KnownObstacles:
    """Circles (n, 3), x, y, radius, and reference points (n, 2), one in each circle inflated by the robot's radius; W,
    m."""

    circles: np.ndarray
    reference_points: np.ndarray

    @staticmethod
    def none() -> "KnownObstacles":
        """An empty world, as the model value of ports."""
        return KnownObstacles(np.zeros((0, 3)), np.zeros((0, 2)))


def find_known_obstacles(world: World, inflation: float) -> KnownObstacles:
    """Return the obstacles of a world as circles, for a robot that keeps `inflation` from them, m.

    Raises:
        UnsupportedError: the world has others than cylinders and spheres that stand still.
    """
    count = len(world.polygons)
    if count or world.model is not None or len(world.moving_obstacles):
        others = "a model file" if world.model is not None else "obstacles that move"
        what = f"{count} polygon{'s' * (count > 1)}" if count else others
        raise UnsupportedError(
            f"a method that knows its obstacles as circles in world {world.name}, which has {what}; "
            "allowed: a world of cylinders and spheres"
        )
    return make_known_obstacles(world.discs, world.bounds, inflation)


def make_known_obstacles(
    discs: np.ndarray, bounds: tuple[float, float, float, float] | None, inflation: float
) -> KnownObstacles:
    """Discs (n, 3), x, y, radius, and the walls at the bounds as circles with common reference points; W, m.

    The bounds are (x_min, y_min, x_max, y_max), None for an open plane; circles are inflated, m.
    """
    circles = np.vstack((discs, _make_walls(bounds)))
    disc_count, centres, radii = len(discs), circles[:, :2], circles[:, 2] + inflation
    offset = centres[None, :, :] - centres[:disc_count, None, :]
    distance = np.hypot(offset[..., 0], offset[..., 1])
    do_overlap = (distance < radii[:disc_count, None] + radii) & (distance > 0.0)
    references = centres.copy()
    group_count, disc_groups = connected_components(do_overlap[:, :disc_count], directed=False)
    for k in range(group_count):
        one, other = np.nonzero(do_overlap & (disc_groups == k)[:, None])
        if not len(one):
            continue
        at_wall = other >= disc_count
        if at_wall.any():
            one, other = one[at_wall], other[at_wall]
        middle_distance = 0.5 * (distance[one, other] + radii[one] - radii[other])
        middle = centres[one] + (middle_distance / distance[one, other])[:, None] * offset[one, other]
        members = np.flatnonzero(disc_groups == k)
        references[members] = _find_nearest_inside(middle.mean(axis=0), centres[members], DEPTH * radii[members])
    return KnownObstacles(circles, references)


def _make_walls(bounds: tuple[float, float, float, float] | None) -> np.ndarray:
    if bounds is None:
        return np.zeros((0, 3))
    x0, y0, x1, y1 = bounds
    x, y, r = 0.5 * (x0 + x1), 0.5 * (y0 + y1), WALL_RADIUS
    return np.array([(x0 - r, y, r), (x1 + r, y, r), (x, y0 - r, r), (x, y1 + r, r)])


def _find_nearest_inside(point: np.ndarray, centres: np.ndarray, radii: np.ndarray) -> np.ndarray:
    """The point of each disc that is nearest to `point`, shape (n, 2)."""
    offset = point - centres
    distance = np.hypot(*offset.T)
    return centres + np.minimum(1.0, radii / np.maximum(distance, 1e-9))[:, None] * offset
