"""Lidars that are turned or upside down: their scans in a frame parallel to the robot's."""

import dataclasses
import math

import numpy as np
import pytest
from hypothesis import given

from drake_starnav.lidar.laser_scan import DYNAMIC, STATIC, LaserScan
from drake_starnav.lidar.mounts import ON_AXIS, Mount, align_with_robot
from tests.helpers.mounts import Lidar, looks
from tests.helpers.scans import cast, scattered, seeds

POSE = np.array((0.2, -0.1, 2.0))


def test_a_scan_of_an_unturned_lidar_is_the_same_object() -> None:
    scan = cast(scattered(np.random.default_rng(1)))
    assert align_with_robot(scan, ON_AXIS) is scan
    assert align_with_robot(scan, Mount(0.2, 0.1, 0.0, False)) is scan
    assert ON_AXIS.find_lidar_pose(POSE) is POSE


@given(seed=seeds)
def test_hits_stay_where_they_are(seed: int) -> None:
    rng = np.random.default_rng(seed)
    world = scattered(rng)
    for upside_down in (False, True):
        mount = Mount(*rng.uniform(-0.2, 0.2, 2), rng.uniform(-4.0, 4.0), upside_down)
        (scan,) = looks(world, (Lidar(mount, 4.0, 200),), POSE)
        turned = align_with_robot(scan, mount)
        view = {"angle_min": turned.angle_min, "angle_increment": turned.angle_increment}
        straight = cast(world, mount.find_lidar_pose(POSE), beams=200, **view)
        assert turned.ranges == pytest.approx(straight.ranges, abs=1e-9)
        assert abs(turned.angle_min) <= math.pi


def test_upside_down_is_mirrored() -> None:
    ranges, motion = np.array((1.0, 2.0, 3.0)), np.array((STATIC, STATIC, DYNAMIC), np.int8)
    scan = LaserScan(0.0, 0.0, 0.5, 0.0, 5.0, ranges, time_increment=0.01, motion=motion)
    turned = align_with_robot(scan, Mount(0.0, 0.0, 0.25, True))
    assert turned.ranges.tolist() == [3.0, 2.0, 1.0] and turned.moving.tolist() == [True, False, False]
    assert (turned.angle_min, turned.angle_max) == pytest.approx((-0.75, 0.25))
    assert turned.time_increment == -0.01
    again = align_with_robot(dataclasses.replace(turned), Mount(0.0, 0.0, 0.25, True))
    assert again.ranges.tolist() == scan.ranges.tolist() and again.angle_min == pytest.approx(scan.angle_min)


def test_the_place_of_a_lidar_turns_with_the_robot() -> None:
    mount = Mount(0.2, 0.1, 1.0, True)
    assert mount.offset == pytest.approx(math.hypot(0.2, 0.1))
    assert mount.find_lidar_pose(np.array((1.0, 2.0, 0.5 * math.pi))) == pytest.approx((0.9, 2.2, 0.5 * math.pi))
