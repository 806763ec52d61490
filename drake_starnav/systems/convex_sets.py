"""Star-shaped regions as the convex sets of Drake's planners, by its IRIS among the edges of their outlines."""

import numpy as np
import shapely
from pydrake.geometry.optimization import HPolyhedron, Iris, IrisOptions, VPolytope

from drake_starnav.errors import StarnavError
from drake_starnav.surroundings.star_region import StarRegion

TOLERANCE = 0.004
"""The outline that is given to IRIS lies inside the region by this share of its reach, or a little more."""
LEAST_LEFT = 0.01
"""A region counts as covered once no more than this share of its area is left."""


def convex_cover(region: StarRegion, count: int = 8) -> list[HPolyhedron]:
    """Up to `count` convex sets inside a region, e.g. for `GcsTrajectoryOptimization`, in W.

    Each grows from the point that lies deepest in what is not covered yet, the first from the region's centre, unless
    that lies on the boundary; and each other one overlaps an earlier one. In 8 sets lie about 90 % of a region's area.

    Args:
        region: e.g. one of a roadmap's.
        count: most sets.

    Raises:
        StarnavError: `count` is less than 1.

    Source: Deits and Tedrake, "Computing large convex regions of obstacle-free space through semidefinite programming",
    2014.
    """
    if count < 1:
        raise StarnavError(f"convex_cover: count is {count}; allowed: a whole number 1 <= x")
    free = _simplified(region)
    if free.is_empty:
        return []
    ring = shapely.get_coordinates(free.exterior)
    edges = [VPolytope(np.column_stack(ends)) for ends in zip(ring, ring[1:], strict=False)]
    x0, y0, x1, y1 = free.bounds
    box, options = HPolyhedron.MakeBox((x0, y0), (x1, y1)), IrisOptions()
    options.require_sample_point_is_contained = True
    center = shapely.Point(region.center)
    seed, left, covered = center if free.contains(center) else free.representative_point(), free, shapely.Polygon()
    sets: list[HPolyhedron] = []
    while len(sets) < count and left.area > LEAST_LEFT * free.area:
        grown = Iris(edges, np.array(seed.coords[0]), box, options)
        area = shapely.MultiPoint(VPolytope(grown).vertices().T).convex_hull
        if not sets or area.intersection(covered).area > 0.0:
            sets.append(grown)
            covered = covered.union(area)
        left = left.difference(area)
        seed = shapely.Point(shapely.maximum_inscribed_circle(left).coords[0])
    return sets


def _simplified(region: StarRegion) -> shapely.Polygon:
    """A polygon of few edges inside a region; empty where it has no area."""
    values, tolerance = region.boundary.values, TOLERANCE * region.reach
    bearing = region.bearing_0 + 2.0 * np.pi / len(values) * np.arange(len(values))
    rays, reach = np.column_stack((np.cos(bearing), np.sin(bearing))), np.minimum(values, np.roll(values, -1))[:, None]
    corners = region.center + np.hstack((reach * rays, reach * np.roll(rays, -1, axis=0))).reshape(-1, 2)
    inner = shapely.Polygon(corners).buffer(0.0).buffer(-tolerance).simplify(tolerance)
    return max(shapely.get_parts(inner), key=shapely.area, default=shapely.Polygon())
