"""Star-shaped regions as the convex sets of Drake's planners."""

from pydrake.geometry.optimization import HPolyhedron

from drake_starnav.regions.convex_cover import half_plane_cover
from drake_starnav.regions.star_region import StarRegion


def convex_cover(region: StarRegion, count: int = 8) -> list[HPolyhedron]:
    """Up to `count` convex sets inside a region, e.g. for `GcsTrajectoryOptimization`, in W.

    The first contains the region's centre, and each other one overlaps an earlier one: in 8 sets lie about 97 % of a
    region's area. See `regions.convex_cover`.

    Args:
        region: e.g. one of a roadmap's.
        count: most sets.

    Raises:
        StarnavError: `count` is less than 1.
    """
    return [HPolyhedron(normals, offsets) for normals, offsets in half_plane_cover(region, count)]
