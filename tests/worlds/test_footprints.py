"""Footprints of solids between two heights, against points sampled in the solids."""

import numpy as np
import pytest
import shapely
from hypothesis import given
from hypothesis import strategies as st
from scipy.spatial import ConvexHull

from drake_starnav.worlds.footprints import (
    make_ball_vertices,
    make_convex_footprint,
    make_cylinder_vertices,
    make_sphere_footprint,
)

LOW, HIGH = 0.0, 0.13


@given(st.integers(0, 10_000), st.integers(5, 40), st.floats(-0.6, 0.8))
def test_the_footprint_is_the_shadow_of_the_slab(seed: int, count: int, height: float) -> None:
    rng = np.random.default_rng(seed)
    vertices = rng.normal(0.0, 0.4, (count, 3)) + (1.0, -2.0, height)
    polygon = make_convex_footprint(vertices, LOW, HIGH)
    inside = rng.dirichlet(np.full(count, 0.2), 5000) @ vertices
    slab = inside[(inside[:, 2] >= LOW) & (inside[:, 2] <= HIGH), :2]
    if polygon is None:
        assert len(slab) == 0
        return
    if len(slab):
        assert shapely.distance(shapely.Polygon(polygon), shapely.points(slab)).max() < 1e-9
    hull = ConvexHull(vertices).equations
    for corner in polygon:  # each corner has a point of the slab above it: the footprint is no larger than that
        rate, level = hull[:, 2], hull[:, :2] @ corner + hull[:, 3]
        with np.errstate(divide="ignore", invalid="ignore"):
            z = -level / rate
        top = min([HIGH, *z[rate > 1e-12]])
        bottom = max([LOW, *z[rate < -1e-12]])
        assert bottom <= top + 1e-6


def test_spheres_are_widest_at_their_middle() -> None:
    assert make_sphere_footprint(np.array([1.0, 2.0, 0.1]), 0.5, LOW, HIGH) == (1.0, 2.0, 0.5)
    x, y, radius = make_sphere_footprint(np.array([1.0, 2.0, 0.43]), 0.5, LOW, HIGH)
    assert (x, y, radius) == pytest.approx((1.0, 2.0, 0.4))


@given(st.integers(0, 10_000))
def test_round_solids_are_a_little_too_wide_and_never_too_narrow(seed: int) -> None:
    rng = np.random.default_rng(seed)
    direction = rng.normal(size=(200, 3))
    direction /= np.linalg.norm(direction, axis=1)[:, None]
    semi_axes = rng.uniform(0.1, 1.0, 3)
    reach = np.linalg.norm(direction * semi_axes, axis=1)
    support = (direction @ make_ball_vertices(semi_axes).T).max(axis=1)
    assert (support >= reach - 1e-12).all()
    assert (support <= 1.002 * reach).all()
    radius, length = semi_axes[:2]
    reach = radius * np.hypot(*direction[:, :2].T) + 0.5 * length * abs(direction[:, 2])
    support = (direction @ make_cylinder_vertices(radius, length).T).max(axis=1)
    assert (support >= reach - 1e-12).all()
    assert (support <= 1.001 * reach).all()
