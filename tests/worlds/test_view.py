"""Scans without a simulator, against an independent ray caster; and the tightest gap of worlds with known gaps."""

import math

import numpy as np
import pytest

from drake_starnav.lidar.sensor_model import LidarParameters
from drake_starnav.worlds import Forest, Maze, Room, World, find_shortest_path, make_world
from drake_starnav.worlds.view import FARTHEST, find_tightest_gap, scan_from, visible_shapes
from tests.helpers.scans import cast

EXACT = LidarParameters(noise=0.0, range_min=0.0)
KINDS = (Forest(), Maze(), Room())
STRAIGHT = np.array([(0.0, 0.0), (6.0, 0.0)])


@pytest.mark.parametrize("kind", KINDS, ids=lambda kind: type(kind).__name__)
def test_a_scan_measures_what_an_independent_ray_caster_does(kind) -> None:
    for seed in range(3):
        world = make_world(kind, seed, 0.25)
        pose = np.array(world.start)
        scan, expected = scan_from(visible_shapes(world), pose, EXACT), cast(world, pose)
        same = np.isclose(scan.ranges, expected.ranges, atol=1e-9)
        # a beam that grazes an edge may pass on either side of it
        assert (~same).sum() <= 1
        assert scan.angle_min == expected.angle_min
        assert scan.full_circle


def test_the_noise_belongs_to_seed_and_index() -> None:
    shapes = visible_shapes(make_world(Room(), 0, 0.25))
    pose = np.array(make_world(Room(), 0, 0.25).start)
    first, again, later = (scan_from(shapes, pose, LidarParameters(), seed=3, index=k) for k in (4, 4, 5))
    np.testing.assert_array_equal(first.ranges, again.ranges)
    assert (first.ranges != later.ranges).any()
    assert first.time == pytest.approx(4 / LidarParameters().rate)


OBLIQUE = [(1.5, 2.3, 0.3), (1.5, -2.3, 0.3), (4.0, 1.0, 0.3), (5.0, -1.0, 0.3)]
"""A wide gap, and a narrower one that is oblique."""


@pytest.mark.parametrize(
    ("posts", "gap", "share"),
    [
        *(([(3.0, half + 0.3, 0.3), (3.0, -half - 0.3, 0.3)], 2.0 * half, 2e-3) for half in (0.3, 0.8, 2.0)),
        (OBLIQUE, math.sqrt(5.0) - 0.6, 1e-2),
        ([(3.25, 0.5, 0.06), (3.25, -0.5, 0.06)], 0.88, 0.1),  # thin, between two places of a coarser look
    ],
)
def test_the_narrowest_gap_between_posts_counts(posts, gap: float, share: float) -> None:
    world = World("posts", (0.0, 0.0, 0.0), (6.0, 0.0), cylinders=posts)
    assert find_tightest_gap(world, STRAIGHT) == pytest.approx(gap, rel=share)


@pytest.mark.parametrize("seed", range(4))
def test_a_shortest_path_leads_through_gaps_that_its_disc_fits_in(seed: int) -> None:
    forest = make_world(Forest(), seed, 0.25)
    _, path = find_shortest_path(forest, 0.255)
    assert 0.51 - 1e-3 <= find_tightest_gap(forest, path) < 2.0 * FARTHEST
