"""The convex sets of a region lie inside it, are connected, and cover most of it."""

import numpy as np
import pytest
import shapely
from pydrake.geometry.optimization import HPolyhedron, VPolytope

from drake_starnav.surroundings.erosion import FreeRange
from drake_starnav.surroundings.star_region import StarRegion, fit_region, scan_region
from drake_starnav.systems import convex_cover
from tests.helpers.scans import MARGINS, cast, free_point, scattered


def region_of(seed: int) -> StarRegion:
    rng = np.random.default_rng(seed)
    world = scattered(rng)
    pose = np.append(free_point(rng, world, 0.45), rng.uniform(-3.0, 3.0))
    return scan_region(cast(world, pose), pose, 0.25, MARGINS)


def region_with_its_centre_on_its_boundary(seed: int) -> StarRegion:
    """As seen from within the margin of a wall."""
    rng, bearing = np.random.default_rng(seed), 2.0 * np.pi / 720 * np.arange(720)
    wall = np.maximum(0.0, np.sin(bearing - 0.2))
    samples = np.where(wall > 0.0, np.minimum(3.0, 2.0 / np.maximum(wall, 0.1)), 0.0)
    return fit_region(
        FreeRange(samples, np.full(720, 3.0), 0.0, 0.25), rng.uniform(-2.0, 2.0, 2), rng.uniform(-3.0, 3.0)
    )


def area_of(polyhedron: HPolyhedron) -> shapely.Polygon:
    return shapely.MultiPoint(VPolytope(polyhedron).vertices().T).convex_hull


def grid(region: StarRegion) -> np.ndarray:
    """Points evenly spread in a region, by `contains`, shape (n, 2), W, m."""
    steps = np.linspace(-region.reach, region.reach, 121)
    points = region.center + np.column_stack([axis.ravel() for axis in np.meshgrid(steps, steps)])
    return points[region.contains(points)]


@pytest.mark.parametrize("kind", [region_of, region_with_its_centre_on_its_boundary])
@pytest.mark.parametrize("seed", range(4))
def test_each_set_is_inside_and_overlaps_an_earlier_one_and_most_is_covered(kind, seed: int) -> None:
    region = kind(seed)
    sets = convex_cover(region)
    areas = [area_of(each) for each in sets]
    assert sets[0].PointInSet(region.center) or kind is not region_of
    for k, area in enumerate(areas):
        assert region.contains(shapely.get_coordinates(area.segmentize(0.01))).all()
        assert k == 0 or area.intersection(shapely.union_all(areas[:k])).area > 0.0
    points = grid(region)
    covered = np.any([(points @ each.A().T <= each.b()).all(axis=1) for each in sets], axis=0)
    assert len(sets) <= 8 and covered.mean() > 0.85


def test_fewer_sets_are_the_first_ones() -> None:
    sets = convex_cover(region_of(0), 3)
    assert len(sets) == 3 and sets[0].IsBounded()
    for few, many in zip(sets, convex_cover(region_of(0), 4), strict=False):
        assert np.array_equal(few.A(), many.A())


def test_a_region_without_area_has_no_sets() -> None:
    region = fit_region(FreeRange(np.zeros(720), np.full(720, 3.0), 0.0, 0.25), np.zeros(2), 0.0)
    assert convex_cover(region) == []
