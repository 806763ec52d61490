"""The index rules out no region that a query would find, however it came about."""

import numpy as np
import pytest

from drake_starnav.planning.region_index import SLACK, RegionIndex, newest_cover, newest_near, selection
from drake_starnav.regions.piecewise_cubic import fit_piecewise_cubic
from drake_starnav.regions.star_region import RegionStack, StarRegion, first_cover
from tests.helpers.scans import unindexed


def spiky_region(rng: np.random.Generator) -> StarRegion:
    """A region with jumps at many bearings."""
    free = np.repeat(rng.choice((0.1, 0.7, 3.0, 20.0), 90, p=(0.2, 0.4, 0.3, 0.1)), 8)
    center = rng.uniform(-8.0, 8.0, 2)
    return StarRegion(center, rng.uniform(-7.0, 7.0), fit_piecewise_cubic(free), free, free, 0.03)


def assert_answers_of_a_loop_over_all(index: RegionIndex, stack: RegionStack, rng: np.random.Generator) -> None:
    indexed, alone = index.of(stack), unindexed(stack)
    edge = rng.integers(0, stack.values.shape[1], (200, len(stack)))
    for x, y in rng.uniform(-30.0, 30.0, (500, 2)):
        assert newest_cover(indexed, x, y) == first_cover(*stack.arrays, x, y)
    for k in range(len(stack)):  # most places are near an edge of a region
        bearing = stack.bearing_0[k] + 2.0 * np.pi / stack.values.shape[1] * (edge[:, k] + rng.random(200))
        r = stack.values[k, edge[:, k]] + rng.uniform(-0.1, 0.1, 200)
        for x, y in stack.center[k] + r[:, None] * np.column_stack((np.cos(bearing), np.sin(bearing))):
            assert newest_cover(indexed, x, y) == first_cover(*stack.arrays, x, y)
            slack, among = rng.uniform(0.0, 0.99 * SLACK), selection(rng.random(len(stack)) < 0.5)
            assert newest_near(indexed, x, y, slack, k, among) == newest_near(alone, x, y, slack, k, among)


@pytest.mark.parametrize("seed", range(3))
def test_an_index_answers_as_a_loop_over_all_regions(seed: int) -> None:
    rng = np.random.default_rng(seed)
    stack, index = RegionStack.of(()), RegionIndex.empty()
    for _ in range(70):
        region = spiky_region(rng)
        stack = stack.appended(region) if len(stack) else RegionStack.of((region,))
        index = index.appended(stack)
    assert_answers_of_a_loop_over_all(index, stack, rng)
    older = RegionStack(
        *(array[:60] for array in (stack.center, stack.bearing_0, stack.values, stack.slopes, stack.reach))
    )
    assert index.of(older).reach.shape == (60,)
    assert_answers_of_a_loop_over_all(index, older, rng)


@pytest.mark.parametrize("dropped", [0, 7])
def test_a_revised_index_answers_as_a_loop_over_all_regions(dropped: int) -> None:
    rng = np.random.default_rng(dropped)
    regions = [spiky_region(rng) for _ in range(70)]
    stack, index = RegionStack.of(()), RegionIndex.empty()
    for k in range(1, len(regions) + 1):
        stack = RegionStack.of(tuple(regions[:k]))
        index = index.appended(stack)
    kept = np.sort(rng.permutation(70)[dropped:])
    changed = rng.random(len(kept)) < 0.2
    revised = [spiky_region(rng) if new else regions[k] for k, new in zip(kept, changed, strict=True)]
    after = RegionStack.of(tuple(revised))
    again = index.revised(kept, changed, after)
    assert_answers_of_a_loop_over_all(again, after, rng)
    assert_answers_of_a_loop_over_all(index, stack, rng)  # the old one has not changed
    more = RegionStack.of((*revised, spiky_region(rng)))
    forked = RegionStack.of((*revised, spiky_region(rng)))
    for longer in (more, forked):
        assert_answers_of_a_loop_over_all(again.appended(longer), longer, rng)
