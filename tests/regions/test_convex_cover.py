"""Convex sets lie inside their region, contain its centre, and cover most of it."""

import numpy as np
import pytest
from hypothesis import given

from drake_starnav.errors import StarnavError
from drake_starnav.planning.parameters import PlannerParameters
from drake_starnav.regions.convex_cover import HalfPlanes, half_plane_cover
from drake_starnav.regions.star_region import StarRegion, scan_region
from tests.helpers.scans import cast, free_point, scattered, seeds


def region_of(seed: int, clear: float = 0.45) -> StarRegion:
    rng = np.random.default_rng(seed)
    world = scattered(rng)
    pose = np.append(free_point(rng, world, clear), rng.uniform(-3.0, 3.0))
    return scan_region(cast(world, pose), pose, 0.25, PlannerParameters())


def extents(region: StarRegion, sets: list[HalfPlanes]) -> tuple[np.ndarray, np.ndarray]:
    """Along bearings all around: how far the sets reach, shape (sets, n), and the region by `contains`."""
    values = region.boundary.values
    bearings = np.linspace(0.0, 2.0 * np.pi, 3601)[:-1]
    left = np.floor(np.mod((bearings - region.bearing_0) * len(values) / (2.0 * np.pi), len(values))).astype(int)
    inside = np.minimum(values[left % len(values)], values[(left + 1) % len(values)])
    rays = np.column_stack((np.cos(bearings), np.sin(bearings)))
    reached = []
    for normals, offsets in sets:
        along = rays @ normals.T
        room = offsets - normals @ region.center
        assert (room > 0.0).all()
        reached.append(np.where(along > 1e-12, room / np.maximum(along, 1e-12), np.inf).min(axis=1))
    return np.array(reached), inside


@given(seed=seeds)
def test_each_set_is_inside_and_contains_the_centre(seed: int) -> None:
    region = region_of(seed)
    reached, inside = extents(region, half_plane_cover(region))
    assert (reached <= inside + 1e-9).all()


def test_more_sets_cover_more_and_eight_most_of_it() -> None:
    shares = []
    for seed in range(12):
        region = region_of(seed)
        covered = []
        for count in (1, 4, 8):
            reached, inside = extents(region, half_plane_cover(region, count))
            covered.append(np.sum(reached.max(axis=0) ** 2) / np.sum(inside**2))
        assert covered == sorted(covered)
        shares.append(covered[-1])
    assert np.median(shares) > 0.85


def test_a_count_below_one_is_refused() -> None:
    with pytest.raises(StarnavError, match="count is 0; allowed: a whole number 1 <= x"):
        half_plane_cover(region_of(1), 0)
