"""The convex sets of a region as Drake's."""

import numpy as np

from drake_starnav.regions.convex_cover import half_plane_cover
from drake_starnav.systems.convex_sets import convex_cover
from tests.helpers.scans import smooth_region


def test_they_are_bounded_polyhedra_inside_the_region() -> None:
    region = smooth_region(np.random.default_rng(2), np.array([2.0, -1.0]))
    sets = convex_cover(region, 4)
    assert 1 <= len(sets) <= 4
    assert sets[0].PointInSet(region.center)
    for polyhedron, half_planes in zip(sets, half_plane_cover(region, 4), strict=True):
        assert polyhedron.IsBounded()
        assert np.array_equal(polyhedron.A(), half_planes.normals)
        assert region.contains(polyhedron.ChebyshevCenter())
