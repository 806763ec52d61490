import math

import numpy as np
import pytest
import shapely

from drake_starnav.geometry.footprint import disc, find_covered_area, footprint
from drake_starnav.visualization import meshes

ICOSAGON = 10.0 * math.sin(math.pi / 10.0)
"""Area of a polygon of 20 corners on the unit circle, as which round shapes are drawn."""


def area(mesh):
    """Sum of the triangles' areas, each without a sign."""
    return shapely.area(shapely.polygons(mesh.vertices[mesh.faces][..., :2])).sum()


def is_sound(mesh):
    all_used = np.array_equal(np.unique(mesh.faces), np.arange(len(mesh.vertices)))
    return np.isfinite(mesh.vertices).all() and mesh.faces.dtype == np.int32 and all_used


def test_ribbon_has_the_area_of_its_line():
    straight = np.array([(0.0, 0.0), (1.0, 0.0), (3.0, 0.0)])
    assert area(meshes.make_ribbon(straight, 0.2, 0.0)) == pytest.approx(0.6)
    square = np.array([(0.0, 0.0), (2.0, 0.0), (2.0, 2.0), (0.0, 2.0)])
    assert area(meshes.make_ribbon(square, 0.2, 0.0, closed=True)) == pytest.approx(2.2**2 - 1.8**2)


def test_shapes_have_their_areas():
    centers = np.array([(0.0, 0.0), (3.0, 1.0), (-2.0, 5.0)])
    dodecagon = 3.0 * 0.2**2
    assert area(meshes.make_discs(centers, 0.2, 0.0)) == pytest.approx(3 * dodecagon)
    ring = meshes.make_ring(centers[1], 0.3, 0.5, 0.0)
    assert area(ring) == pytest.approx(ICOSAGON * (0.5**2 - 0.3**2))
    band = meshes.make_segments(np.array([[(0.0, 0.0), (3.0, 4.0)], [(1.0, 1.0), (1.0, 3.0)]]), 0.1, 0.0)
    assert area(band) == pytest.approx(0.7) and len(band.vertices) == 8
    crosses, star = meshes.make_crosses(centers, 0.1, 0.0), meshes.make_five_pointed_star(centers[2], 0.2, 0.0)
    assert all(map(is_sound, (ring, band, crosses, star)))
    assert len(meshes.make_discs(np.zeros((0, 2)), 0.2, 0.0)) == 0
    assert len(meshes.make_crosses(np.zeros((0, 2)), 0.2, 0.0)) == 0


@pytest.mark.parametrize("corners", [((0.6, 0.2), (-0.2, 0.2), (-0.2, -0.2), (0.6, -0.2)), None])
def test_rim_and_front_lie_inside_the_footprint(corners) -> None:
    shape = disc(0.3) if corners is None else footprint(corners)
    whole = find_covered_area(shape, np.zeros(3))
    for mesh in (meshes.make_rim(shape, 0.05), meshes.make_front(shape, 0.1)):
        drawn = shapely.union_all(shapely.polygons(mesh.vertices[mesh.faces][..., :2]))
        assert whole.buffer(1e-6).covers(drawn) and drawn.distance(whole.exterior) < 1e-6
    assert meshes.make_front(shape, 0.1).vertices[:, 0].max() == pytest.approx(0.3 if corners is None else 0.6)


def test_the_area_that_polygons_cover_is_what_is_drawn_once():
    shape = footprint(((0.3, 0.1), (-0.3, 0.1), (-0.3, -0.1), (0.3, -0.1)))
    poses = np.array([(0.0, 0.0, 0.0), (0.2, 0.0, 0.0), (0.2, 0.0, 0.5 * math.pi)])
    mesh = meshes.sweep_area(poses, shape, 0.05)
    assert area(mesh) == pytest.approx(0.8 * 0.2 + 0.6 * 0.2 - 0.2 * 0.2)
    assert (mesh.vertices[:, 2] == 0.05).all()
