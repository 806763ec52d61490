"""What is derived from a scan is derived once, and is all that compiled loops need of it."""

import dataclasses
import math

import numpy as np
from hypothesis import given

from drake_starnav.lidar.beams import DYNAMIC, STATIC, UNKNOWN, Beams
from drake_starnav.lidar.laser_scan import LaserScan
from tests.helpers.scans import cast, scattered, seeds


def test_beams_are_made_once_and_belong_to_one_scan() -> None:
    scan = cast(scattered(np.random.default_rng(1)))
    beams = scan.beams
    assert isinstance(beams, Beams) and scan.beams is beams
    for name in ("distances", "hits", "moving", "lost"):
        assert getattr(scan, name) is getattr(beams, name) and len(getattr(beams, name)) == len(scan.ranges)
    later = dataclasses.replace(scan, ranges=np.full(len(scan.ranges), np.inf))
    assert not later.beams.hits.any() and beams.hits.any()


def test_the_view_is_that_of_the_scan() -> None:
    scan = LaserScan(0.0, 0.0, 6.28 / 359, 0.1, 7.0, np.full(360, 2.0))
    assert (scan.beams.range_max, scan.beams.increment) == (7.0, 6.28 / 359)
    assert scan.beams.seam == scan.field_of_view.seam and scan.full_circle
    part = LaserScan(0.0, 0.0, 0.01, 0.1, 7.0, np.full(360, 2.0))
    assert part.beams.seam == math.inf and not part.full_circle


@given(seeds)
def test_kinds_of_beams_follow_from_range_and_motion(seed: int) -> None:
    rng = np.random.default_rng(seed)
    ranges = rng.choice([0.5, 2.0, 9.0, np.inf, -np.inf, np.nan], 60)
    motion = rng.choice([STATIC, UNKNOWN, DYNAMIC], 60)
    beams = LaserScan(0.0, -math.pi, math.pi / 30, 0.1, 7.0, ranges, lost_beams=True, motion=motion).beams
    lost, moving = np.isnan(ranges), motion == DYNAMIC
    np.testing.assert_array_equal(beams.lost, lost)
    np.testing.assert_array_equal(beams.moving, moving)
    np.testing.assert_array_equal(beams.hits, ~lost & ~moving & (ranges < 7.0))
    np.testing.assert_array_equal(beams.uninformative, lost | moving)
    np.testing.assert_array_equal(beams.mappable, ~lost & (motion == STATIC))
    assert beams.complete == (not lost.any())
    assert ((beams.distances >= 0.0) & (beams.distances <= 7.0)).all()


def test_a_lost_beam_may_have_a_bound_of_its_own() -> None:
    ranges, free = np.array((2.0, np.nan, np.nan, np.inf)), np.array((9.0, 1.5, 9.0, 9.0))
    scan = LaserScan(0.0, 0.0, 0.02, 0.0, 7.0, ranges, lost_beams=True)
    assert scan.distances.tolist() == [2.0, 2.0, 2.0, 7.0]
    bounded = dataclasses.replace(scan, free=free)
    assert bounded.distances.tolist() == [2.0, 1.5, 7.0, 7.0] and bounded.lost.tolist() == scan.lost.tolist()
    clockwise = LaserScan(0.0, 0.0, -0.02, 0.0, 7.0, ranges, lost_beams=True, free=free)
    assert clockwise.distances.tolist() == [7.0, 7.0, 1.5, 2.0]
