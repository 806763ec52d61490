"""Convex sets lie inside their region, are connected, and cover nearly all of it."""

import numpy as np
import pytest
from hypothesis import given
from scipy.optimize import linprog
from scipy.spatial import ConvexHull, HalfspaceIntersection

from drake_starnav.errors import StarnavError
from drake_starnav.regions.convex_cover import HalfPlanes, half_plane_cover
from drake_starnav.regions.erosion import FreeRange
from drake_starnav.regions.star_region import StarRegion, fit_region, scan_region
from tests.helpers.scans import MARGINS, cast, free_point, scattered, seeds


def region_of(seed: int, clear: float = 0.45) -> StarRegion:
    rng = np.random.default_rng(seed)
    world = scattered(rng)
    pose = np.append(free_point(rng, world, clear), rng.uniform(-3.0, 3.0))
    return scan_region(cast(world, pose), pose, 0.25, MARGINS)


def grid(region: StarRegion) -> np.ndarray:
    """Points evenly spread in a region, by `contains`, shape (n, 2), W, m."""
    steps = np.linspace(-region.reach, region.reach, 121)
    points = region.center + np.column_stack([axis.ravel() for axis in np.meshgrid(steps, steps)])
    return points[region.contains(points)]


def held(sets: list[HalfPlanes], points: np.ndarray) -> np.ndarray:
    """Whether each set contains each point, shape (sets, n)."""
    return np.array([(points @ normals.T <= offsets).all(axis=1) for normals, offsets in sets])


def hull(half_planes: HalfPlanes) -> tuple[np.ndarray, np.ndarray]:
    """A point well inside a bounded set, and the set's corners in order, shape (n, 2), W, m."""
    normals, offsets = half_planes
    middle = largest_circle([half_planes])[0]
    room = offsets - normals @ middle
    corners = HalfspaceIntersection(np.column_stack((normals, -offsets)), middle).intersections
    assert (room > 0.0).all()
    return middle, corners[ConvexHull(corners).vertices]


def largest_circle(sets: list[HalfPlanes]) -> tuple[np.ndarray, float]:
    """Centre and radius of the largest circle in the intersection of sets, W, m; a negative radius if it is empty."""
    normals, offsets = (np.concatenate(parts) for parts in zip(*sets, strict=True))
    rows = np.column_stack((normals, np.ones(len(normals))))
    solved = linprog((0.0, 0.0, -1.0), rows, offsets, bounds=(None, None))
    assert solved.success  # it is bounded
    return solved.x[:2], float(solved.x[2])


def on_the_margin(rng: np.random.Generator) -> StarRegion:
    """A region whose centre lies on its boundary, as seen from within the margin of a wall."""
    bearing = 2.0 * np.pi / 720 * np.arange(720)
    wall = np.maximum(0.0, np.sin(bearing - 0.2))
    samples = np.where(wall > 0.0, np.minimum(3.0, 2.0 / np.maximum(wall, 0.1)), 0.0)
    return fit_region(
        FreeRange(samples, np.full(720, 3.0), 0.0, 0.25), rng.uniform(-2.0, 2.0, 2), rng.uniform(-3.0, 3.0)
    )


@given(seed=seeds)
def test_each_set_is_inside_and_overlaps_an_earlier_one(seed: int) -> None:
    region = region_of(seed)
    sets = half_plane_cover(region)
    assert held(sets[:1], region.center[None]).all()
    for k, half_planes in enumerate(sets):
        middle, corners = hull(half_planes)
        edges = np.linspace(corners, np.roll(corners, -1, axis=0), 60).reshape(-1, 2)
        assert region.contains(middle + (1.0 - 1e-7) * (edges - middle)).all()
        if k > 0:
            assert any(largest_circle([half_planes, other])[1] > 0.0 for other in sets[:k])


@pytest.mark.slow
def test_more_sets_cover_more_and_eight_at_least_95_percent() -> None:
    shares = []
    for seed in range(12):
        region = region_of(seed)
        points = grid(region)
        covered = [held(half_plane_cover(region, count), points).any(axis=0).mean() for count in (1, 4, 8)]
        assert covered == sorted(covered)
        shares.append(covered[-1])
    assert np.median(shares) > 0.95


def test_a_region_whose_centre_is_on_its_boundary_is_covered() -> None:
    for seed in range(4):
        region = on_the_margin(np.random.default_rng(seed))
        sets = half_plane_cover(region)
        points = grid(region)
        assert held(sets, points).any(axis=0).mean() > 0.95
        for half_planes in sets:
            assert region.contains(hull(half_planes)[0])


def test_a_region_without_area_has_no_sets() -> None:
    region = fit_region(FreeRange(np.zeros(720), np.full(720, 3.0), 0.0, 0.25), np.zeros(2), 0.0)
    assert half_plane_cover(region) == []


def test_a_count_below_one_is_refused() -> None:
    with pytest.raises(StarnavError, match="count is 0; allowed: a whole number 1 <= x"):
        half_plane_cover(region_of(1), 0)
