import numpy as np
from hypothesis import given, settings

from drake_starnav.planning.string_pulling import blocked_at, last_in_sight, string_pulled
from drake_starnav.regions.star_region import LINE_STEP, segment_covered
from tests.helpers.scans import RADIUS, distance, free_point, length, seeds, wandered


@settings(max_examples=15)
@given(seeds)
def test_pulled_paths_are_not_longer_and_stay_in_the_union(seed):
    world, roadmap = wandered(seed, nodes=6)
    path = roadmap.stack.center[[1, 0, 2, 0, 3]]  # every centre is in sight of the origin, which is node 0
    position = roadmap.stack.center[4]
    line = np.vstack((position, roadmap.stack.center[0], path))
    pulled = string_pulled(line[1:], position, roadmap.union)
    np.testing.assert_allclose(pulled[-1], path[-1], atol=1e-12)
    assert length(position, pulled) <= length(line) + 1e-9
    way = np.vstack((position, pulled))
    for a, b in zip(way[:-1], way[1:], strict=True):
        assert segment_covered(*roadmap.stack.arrays, *a, *b, LINE_STEP)
        fine = a + (b - a) * np.linspace(0.0, 1.0, 300)[:, None]
        assert distance(world, fine).min() > RADIUS  # the margin covers what lies between two samples of the line


@settings(max_examples=10)
@given(seeds)
def test_a_path_in_one_region_is_pulled_straight(seed):
    world, roadmap = wandered(seed, nodes=1)
    rng = np.random.default_rng(seed)
    end = roadmap.regions[0].center + 0.3 * rng.uniform(-1.0, 1.0, 2) / np.sqrt(2.0)
    assert roadmap.regions[0].contains(end)
    detour = rng.uniform(-0.1, 0.1, (3, 2))
    np.testing.assert_allclose(string_pulled(np.vstack((detour, end)), np.zeros(2), roadmap.union), end[None])


@settings(max_examples=20)
@given(seeds)
def test_the_last_point_in_sight_is_the_last_that_a_line_reaches(seed):
    world, roadmap = wandered(seed, nodes=2)
    rng = np.random.default_rng(seed)
    position, points = free_point(rng, world, RADIUS), rng.uniform(-6.0, 6.0, (12, 2))
    seen = [segment_covered(*roadmap.stack.arrays, *position, *point, LINE_STEP) for point in points]
    expected = max((k for k in range(12) if seen[k]), default=-1)
    assert last_in_sight(points, 0, *position, roadmap.union) == expected
    assert last_in_sight(points[:0], 0, *position, roadmap.union) == -1


@settings(max_examples=15)
@given(seeds)
def test_a_line_is_blocked_where_the_regions_do_not_cover_it(seed):
    rng = np.random.default_rng(seed)
    _, roadmap = wandered(seed)
    arrays = roadmap.stack.arrays
    for _ in range(40):
        start = roadmap.stack.center[rng.integers(len(roadmap))] + rng.uniform(-1.0, 1.0, 2) * rng.integers(0, 2)
        end, guess = start + rng.uniform(-4.0, 4.0, 2), rng.uniform(-1.0, 4.0)
        blocked = blocked_at(roadmap.union, *start, *end, guess)
        assert (blocked < 0.0) == segment_covered(*arrays, *start, *end, LINE_STEP)
