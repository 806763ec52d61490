"""The polygon lies inside its boundary, has few edges and nearly the area; the points are spread evenly in it."""

import numpy as np
from hypothesis import given

from drake_starnav.regions.inner_polygon import even_points, inner_polygon
from drake_starnav.regions.star_region import StarRegion, scan_region
from tests.helpers.scans import MARGINS, cast, free_point, scattered, seeds


def boundary(seed: int) -> tuple[StarRegion, np.ndarray, np.ndarray]:
    """A region, the rays of its samples, and its reach between each and the next, m."""
    rng = np.random.default_rng(seed)
    world = scattered(rng)
    pose = np.append(free_point(rng, world, 0.45), rng.uniform(-3.0, 3.0))
    region = scan_region(cast(world, pose), pose, 0.25, MARGINS)
    values = region.boundary.values
    bearings = region.bearing_0 + 2.0 * np.pi / len(values) * np.arange(len(values))
    return region, np.column_stack((np.cos(bearings), np.sin(bearings))), np.minimum(values, np.roll(values, -1))


def area(polygon: np.ndarray) -> float:
    following = np.roll(polygon, -1, axis=0)
    return 0.5 * float(np.sum(polygon[:, 0] * following[:, 1] - polygon[:, 1] * following[:, 0]))


@given(seed=seeds)
def test_it_is_inside_with_few_edges_and_nearly_all_of_the_area(seed: int) -> None:
    region, rays, reach = boundary(seed)
    polygon = inner_polygon(rays, reach)
    following = np.roll(polygon, -1, axis=0)
    across = polygon[:, 0] * following[:, 1] - polygon[:, 1] * following[:, 0] > 1e-9  # the others lie on rays
    edges = np.linspace(polygon[across], following[across], 50)[1:-1].reshape(-1, 2)
    assert region.contains(region.center + (1.0 - 1e-9) * edges).all()
    assert len(polygon) < len(reach) / 3
    assert area(polygon) > 0.96 * np.pi * np.mean(reach**2)


def test_points_are_inside_and_half_of_them_in_half_of_the_area() -> None:
    region, rays, reach = boundary(3)
    polygon = inner_polygon(rays, reach)
    points = even_points(polygon, 1000)
    assert region.contains(region.center + points).all()
    shrunk = np.hypot(*points.T) ** 2 <= 0.5 * region.phi(np.arctan2(points[:, 1], points[:, 0])) ** 2
    assert abs(shrunk.mean() - 0.5) < 0.03


def test_a_flat_polygon_holds_no_points() -> None:
    assert len(even_points(np.zeros((4, 2)), 10)) == 0


@given(seed=seeds)
def test_a_reach_of_nearly_or_entirely_zero_ends_in_no_more_vertices_than_two_a_ray(seed: int) -> None:
    rng = np.random.default_rng(seed)
    bearings = rng.uniform(-3.0, 3.0) + 2.0 * np.pi / 720 * np.arange(720)
    rays = np.column_stack((np.cos(bearings), np.sin(bearings)))
    tiny = 10.0 ** rng.uniform(-18.0, 0.0, 720) * (rng.random(720) < 0.7)
    reach = np.where(np.sin(bearings + rng.uniform(0.0, 6.0)) > 0.0, rng.uniform(0.5, 3.0), tiny)
    polygon = inner_polygon(rays, reach)
    assert len(polygon) <= 2 * len(rays)
    assert np.isfinite(polygon).all()
    assert (np.hypot(*polygon.T) <= reach.max() + 1e-9).all()
