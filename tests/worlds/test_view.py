"""Scans without a simulator, against an independent ray caster."""

import math

import numpy as np
import pytest

from drake_starnav.errors import StarnavError
from drake_starnav.lidar.sensor_model import LidarParameters
from drake_starnav.worlds import Forest, Maze, Room, World, clearance, make_world
from drake_starnav.worlds.view import scan_from, visible_shapes
from scripts.experiments.scan_sample import random_free_pose, random_views
from tests.helpers.scans import cast

EXACT = LidarParameters(noise=0.0, range_min=0.0)
KINDS = (Forest(), Maze(), Room())


@pytest.mark.parametrize("kind", KINDS, ids=lambda kind: type(kind).__name__)
def test_a_scan_measures_what_an_independent_ray_caster_does(kind) -> None:
    for view in random_views([make_world(kind, seed, 0.25) for seed in range(3)], EXACT, 0.25, seed=1):
        expected = cast(view.world, view.pose)
        same = np.isclose(view.scan.ranges, expected.ranges, atol=1e-9)
        # a beam that grazes an edge may pass on either side of it
        assert (~same).sum() <= 1
        assert view.scan.angle_min == expected.angle_min
        assert view.scan.full_circle


def test_the_noise_belongs_to_seed_and_index() -> None:
    shapes = visible_shapes(make_world(Room(), 0, 0.25))
    pose = np.array(make_world(Room(), 0, 0.25).start)
    first, again, later = (scan_from(shapes, pose, LidarParameters(), seed=3, index=k) for k in (4, 4, 5))
    np.testing.assert_array_equal(first.ranges, again.ranges)
    assert (first.ranges != later.ranges).any()
    assert first.time == pytest.approx(4 / LidarParameters().rate)


def test_random_poses_are_free_and_repeatable() -> None:
    worlds = [make_world(kind, 2, 0.25) for kind in KINDS]
    views, again = (list(random_views(worlds, EXACT, 0.25, seed=5)) for _ in range(2))
    for view, same in zip(views, again, strict=True):
        assert clearance(view.world, view.pose[None, :2])[0] > 0.25
        np.testing.assert_array_equal(view.pose, same.pose)
    (alone,) = random_views(worlds[:1], EXACT, 0.25, seed=5)
    np.testing.assert_array_equal(alone.pose, views[0].pose)


def test_a_full_world_is_an_error() -> None:
    full = World("full", (0, 0, 0), (0, 0), cylinders=[(0.0, 0.0, 9.0)], bounds=(-1.0, -1.0, 1.0, 1.0))
    with pytest.raises(StarnavError, match="world full: no free place"):
        random_free_pose(full, np.random.default_rng(0), 0.25)


def test_an_open_plane_returns_nothing() -> None:
    empty = World("empty", (0, 0, 0), (1, 0))
    assert math.isinf(scan_from(visible_shapes(empty), np.zeros(3), LidarParameters()).ranges.min())
