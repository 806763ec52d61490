"""The index rules out no region that a query would find, however it came about."""

import dataclasses

import numpy as np

from drake_starnav.surroundings.piecewise_cubic import fit_piecewise_cubic
from drake_starnav.surroundings.region_index import index_regions, select_regions
from drake_starnav.surroundings.region_union import RegionUnion, find_covering_region
from drake_starnav.surroundings.star_region import StarRegion, unite_regions


def spiky_region(rng: np.random.Generator) -> StarRegion:
    """A region with jumps at many bearings."""
    free = np.repeat(rng.choice((0.1, 0.7, 3.0, 20.0), 90, p=(0.2, 0.4, 0.3, 0.1)), 8)
    center = rng.uniform(-8.0, 8.0, 2)
    return StarRegion(center, rng.uniform(-7.0, 7.0), fit_piecewise_cubic(free, 0.25), free, free, 0.03, 0.25)


def assert_answers_of_a_loop_over_all(union: RegionUnion, rng: np.random.Generator) -> None:
    alone = RegionUnion(*union.rows)
    edge = rng.integers(0, union.values.shape[1], (200, union.size))
    for x, y in rng.uniform(-30.0, 30.0, (500, 2)):
        assert find_covering_region(union, x, y, 0.0) == find_covering_region(alone, x, y, 0.0)
    for k in range(union.size):  # most places are near an edge of a region
        bearing = union.bearing_0[k] + 2.0 * np.pi / union.values.shape[1] * (edge[:, k] + rng.random(200))
        r = union.values[k, edge[:, k]] + rng.uniform(-0.1, 0.1, 200)
        for x, y in union.center[k] + r[:, None] * np.column_stack((np.cos(bearing), np.sin(bearing))):
            slack = rng.choice((0.0, rng.uniform(0.0, 1.0)))
            assert find_covering_region(union, x, y, slack) == find_covering_region(alone, x, y, slack)


def test_a_union_in_which_regions_were_replaced_answers_as_a_loop_over_all_regions() -> None:
    rng = np.random.default_rng(0)
    regions = [spiky_region(rng) for _ in range(70)]
    before = index_regions(unite_regions(regions), RegionUnion.none(), np.arange(70))
    changed = rng.random(70) < 0.2
    revised = [
        dataclasses.replace(spiky_region(rng), center=region.center, bearing_0=region.bearing_0) if new else region
        for region, new in zip(regions, changed, strict=True)
    ]
    after = index_regions(unite_regions(revised), before, np.flatnonzero(changed))
    assert_answers_of_a_loop_over_all(after, rng)
    assert_answers_of_a_loop_over_all(before, rng)  # it has not changed
    for _ in range(2):
        longer = [*revised, spiky_region(rng)]
        assert_answers_of_a_loop_over_all(index_regions(unite_regions(longer), after, np.array([70])), rng)


def test_a_union_without_some_regions_answers_as_a_loop_over_the_others() -> None:
    rng = np.random.default_rng(1)
    regions = [spiky_region(rng) for _ in range(70)]
    kept = rng.random(70) < 0.6
    fewer = select_regions(index_regions(unite_regions(regions), RegionUnion.none(), np.arange(70)), kept)
    np.testing.assert_array_equal(
        fewer.center, [region.center for region, stays in zip(regions, kept, strict=True) if stays]
    )
    assert_answers_of_a_loop_over_all(fewer, rng)
