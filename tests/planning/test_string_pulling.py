import numpy as np
from hypothesis import given, settings

from drake_starnav.planning.string_pulling import find_last_in_sight, pull_string
from tests.helpers.scans import RADIUS, distance, free_point, in_view, length, seeds, wandered


@settings(max_examples=15)
@given(seeds)
def test_pulled_paths_are_not_longer_and_stay_in_the_union(seed):
    world, roadmap = wandered(seed, nodes=6)
    path = roadmap.union.center[[1, 0, 2, 0, 3]]  # every centre is in sight of the origin, which is node 0
    position = roadmap.union.center[4]
    line = np.vstack((position, roadmap.union.center[0], path))
    pulled = pull_string(line[1:], position, roadmap.union, RADIUS)
    np.testing.assert_allclose(pulled[-1], path[-1], atol=1e-12)
    assert length(position, pulled) <= length(line) + 1e-9
    way = np.vstack((position, pulled))
    for a, b in zip(way[:-1], way[1:], strict=True):
        assert in_view(roadmap.union, a, b)
        fine = a + (b - a) * np.linspace(0.0, 1.0, 300)[:, None]
        assert distance(world, fine).min() > RADIUS  # the margin covers what lies between two samples of the line


@settings(max_examples=20)
@given(seeds)
def test_the_last_point_in_sight_is_the_last_that_a_line_reaches(seed):
    world, roadmap = wandered(seed, nodes=2)
    rng = np.random.default_rng(seed)
    position, points = free_point(rng, world, RADIUS), rng.uniform(-6.0, 6.0, (12, 2))
    seen = [in_view(roadmap.union, position, point) for point in points]
    expected = max((k for k in range(12) if seen[k]), default=-1)
    assert find_last_in_sight(points, *position, roadmap.union, 0.25) == expected
    assert find_last_in_sight(points[:0], *position, roadmap.union, 0.25) == -1
