"""Whether a segment enters a capsule, against points sampled along it."""

import numpy as np
from hypothesis import given

from drake_starnav.worlds.capsules import blocker, blocks, capsules_around
from drake_starnav.worlds.outlines import rectangle
from drake_starnav.worlds.world import World
from tests.helpers.scans import seeds, segment_distance


def test_discs_and_sides_are_inflated() -> None:
    world = World(
        "both", (0.0, 0.0, 0.0), (9.0, 9.0), cylinders=[(1.0, 2.0, 0.3)], polygons=[rectangle(3.0, 3.0, 4.0, 5.0)]
    )  # fmt: skip
    capsules = capsules_around(world, 0.25)
    assert len(capsules) == 5
    np.testing.assert_allclose(capsules[0], (1.0, 2.0, 1.0, 2.0, 0.55))
    np.testing.assert_allclose(capsules[1:, 4], 0.25)


@given(seeds)
def test_a_segment_is_blocked_where_a_point_of_it_is_inside(seed: int) -> None:
    rng = np.random.default_rng(seed)
    a, b = rng.uniform(-2.0, 2.0, (2, 2))
    capsule = np.array((*rng.uniform(-2.0, 2.0, 4), rng.uniform(0.1, 1.0)))
    points = a + np.linspace(0.0, 1.0, 400)[:, None] * (b - a)
    nearest = min(segment_distance(point, capsule[:2], capsule[2:4]) for point in points)
    step = np.hypot(*(b - a)) / 399
    if nearest < capsule[4] - 1e-6:
        assert blocks(*a, *b, capsule)
    elif nearest > capsule[4] + step:
        assert not blocks(*a, *b, capsule)


def test_the_blocker_is_one_that_blocks_and_touching_is_free() -> None:
    capsules = np.array(((0.0, 1.0, 4.0, 1.0, 0.5), (2.0, 0.0, 2.0, 0.0, 0.4)))
    assert blocker(0.0, 0.0, 4.0, 0.0, capsules) == 1
    assert blocker(0.0, 0.5, 1.0, 0.5, capsules) == -1
    assert blocker(5.0, 5.0, 6.0, 6.0, capsules) == -1
