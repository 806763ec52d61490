"""Of a union: which places and lines it contains."""

import math

import numpy as np
from hypothesis import given, settings

from drake_starnav.surroundings.erosion import FreeRange
from drake_starnav.surroundings.region_union import (
    LINE_STEP,
    RegionUnion,
    find_covering_region,
    find_first_departure,
    measure_excess,
)
from drake_starnav.surroundings.star_region import StarRegion, fit_region, unite_regions
from tests.helpers.scans import seeds, smooth_region

STEP = 2.0 * math.pi / 720


def regions(count: int, seed: int = 0) -> list[StarRegion]:
    rng = np.random.default_rng(seed)
    return [smooth_region(rng, rng.uniform(-4.0, 4.0, 2)) for _ in range(count)]


@settings(max_examples=25)
@given(seeds)
def test_a_place_is_covered_by_the_newest_region_that_contains_it(seed):
    many, points = regions(5, seed), np.random.default_rng(seed).uniform(-5.0, 5.0, (300, 2))
    inside = np.array([region.contains(points) for region in many])
    newest = np.where(inside.any(axis=0), 4 - np.argmax(inside[::-1], axis=0), -1)
    union = unite_regions(many)
    assert [find_covering_region(union, x, y, 0.0) for x, y in points] == newest.tolist()
    assert (union.contains(points) == inside.any(axis=0)).all()
    assert not RegionUnion.none().contains(points).any()


def test_a_region_reaches_points_a_slack_beyond_its_boundary():
    region = fit_region(FreeRange(np.full(720, 2.0), np.full(720, 5.0), 0.0, 0.25), np.zeros(2), 0.0)
    points = np.array([(1.99, 0.0), (2.05, 0.0), (0.0, -2.05), (2.11, 0.0)])
    assert region.as_union.contains(points).tolist() == [True, False, False, False]
    assert region.as_union.contains(points, 0.1).tolist() == [True, True, True, False]


@settings(max_examples=30)
@given(seeds)
def test_a_line_has_a_gap_where_some_of_its_samples_is_in_no_region(seed):
    many, rng = regions(6, seed), np.random.default_rng(seed)
    union = unite_regions(many)
    for a, b in rng.uniform(-4.0, 4.0, (20, 2, 2)):
        length = np.hypot(*(b - a))
        count = int(length / (LINE_STEP * 0.25)) + 1
        line = a + (b - a) * np.linspace(0.0, 1.0, count + 1)[:, None]
        inside = np.any([r.contains(line) for r in many], axis=0)
        gap = find_first_departure(union, tuple(a), tuple(b), rng.uniform(-1.0, 4.0), 0.25)
        assert (gap < 0.0) == inside.all()
        assert gap < 0.0 or not inside[round(gap / length * count)]


@settings(max_examples=30)
@given(seeds)
def test_the_excess_over_regions_is_that_along_the_ray_from_each_centre(seed):
    many = regions(6, seed)
    union = unite_regions(many)
    for place in np.random.default_rng(seed).uniform(-6.0, 6.0, (20, 2)):
        offset = place - union.center
        bearing, away = np.arctan2(offset[:, 1], offset[:, 0]), np.hypot(*offset.T)
        samples = bearing[:, None] + STEP * np.linspace(-1.0, 1.0, 41)  # phi may fall steeply between two samples
        low, high = zip(*((phi.min(), phi.max()) for phi in map(StarRegion.phi, many, samples)), strict=True)
        beyond = measure_excess(union, *place)
        assert (away - high - 1e-9 <= beyond).all() and (beyond <= away - low + 1e-9).all()
        assert ((beyond <= 0.0) == [region.contains(place) for region in many]).all()
