import dataclasses
import math

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from drake_starnav.lidar.laser_scan import USUAL_COVER_RADIUS, LaserScan
from drake_starnav.surroundings.erosion import SAME_SURFACE
from drake_starnav.surroundings.recent_hits import RecentHits
from drake_starnav.surroundings.scan_averaging import average_scan
from drake_starnav.surroundings.surroundings import Surroundings
from drake_starnav.worlds.world import World
from tests.helpers.scans import RADIUS, cast, noisy, observe_scan, seeds

COUNT, REACH = 5, 1.8
WALLS = (-1.5, -1.2, 1.5, 1.2)
ROOM = World("room", (0, 0, 0), (0, 0), cylinders=[(0.8, 0.1, 0.2), (-0.7, -0.4, 0.1)], bounds=WALLS)


def drive(start: np.ndarray, heading: float, step: float, count: int) -> np.ndarray:
    """Poses along a line while the robot turns, shape (count, 3)."""
    along = step * np.arange(count)
    return start + np.column_stack((along * math.cos(heading), along * math.sin(heading), 0.02 * np.arange(count)))


def remembered(scans: list[LaserScan], poses: np.ndarray) -> RecentHits:
    seen = Surroundings.unknown()
    for scan, pose in zip(scans, poses, strict=True):
        seen = observe_scan(scan, pose, RADIUS, REACH, seen)
    return seen.recent_hits


@settings(max_examples=30)
@given(seeds, st.floats(-math.pi, math.pi), st.floats(0.0, 0.04))
def test_noise_of_a_centimetre_is_about_halved_and_to_no_side(seed, heading, step):
    rng = np.random.default_rng(seed)
    poses = drive(np.array((*rng.uniform(-0.1, 0.1, 2), rng.uniform(-3.0, 3.0))), heading, step, COUNT)
    exact = cast(ROOM, poses[-1])
    scans = [noisy(cast(ROOM, pose), 0.01, rng) for pose in poses]
    _, out = average_scan(remembered(scans[:-1], poses[:-1]), scans[-1], poses[-1], REACH)
    error = out.ranges - exact.ranges
    assert error.std() < 0.006
    assert abs(error.mean()) < 0.001


@settings(max_examples=50)
@given(seeds, st.floats(-math.pi, math.pi), st.floats(0.0, 0.04))
def test_exact_ranges_change_by_no_more_than_neighbouring_hits_leave_open(seed, heading, step):
    rng = np.random.default_rng(seed)
    poses = drive(np.array((*rng.uniform(-0.4, 0.4, 2), rng.uniform(-3.0, 3.0))), heading, step, COUNT)
    scans = [cast(ROOM, pose) for pose in poses]
    _, out = average_scan(remembered(scans[:-1], poses[:-1]), scans[-1], poses[-1], REACH)
    change = np.abs(out.ranges - scans[-1].ranges)
    spacing = scans[-1].ranges * scans[-1].angle_increment
    assert (change < SAME_SURFACE * USUAL_COVER_RADIUS).all()
    assert np.quantile(change / spacing, 0.95) < 0.05, "off edges and corners the chords lie on the surfaces"


def test_hits_on_surfaces_seen_by_the_latest_scan_leave_the_memory_and_others_stay():
    poses = np.array(((0.0, -0.7, 0.0), (0.0, 0.3, 0.0)))  # the post at (0.8, 0.1) hides part of the wall behind it
    earlier = cast(ROOM, poses[0])
    memory = remembered([earlier], poses[:1])
    kept, _ = average_scan(memory, cast(ROOM, poses[1]), poses[1], 4.0)
    left = {tuple(point) for point in kept.hits.points}
    center = np.array((0.8, 0.1))
    for point in memory.hits.points:
        offset, way = point - poses[1, :2], center - poses[1, :2]
        along = np.clip(way @ offset / (offset @ offset), 0.0, 1.0)
        clearance = np.hypot(*(way - along * offset)) - 0.2
        on_far_wall = abs(point[0] - WALLS[2]) < 1e-6
        if on_far_wall and clearance > 0.08:
            assert tuple(point) not in left, "in sight"
        elif on_far_wall and clearance < -0.08:
            assert tuple(point) in left, "hidden by the post"
    assert 0 < len(left) < len(memory.hits.points)
    assert len(kept.hits.half_chords) == len(kept.hits.points)


def by_scan(memory: RecentHits) -> list[np.ndarray]:
    """The points of each scan."""
    return np.split(memory.hits.points, np.cumsum(memory.counts)[:-1])


def test_ranges_beyond_reach_are_unchanged():
    rng, reach = np.random.default_rng(3), 0.9
    poses = np.zeros((COUNT, 3))
    scans = [noisy(cast(ROOM, pose), 0.01, rng) for pose in poses]
    memory = remembered(scans[:-1], poses[:-1])
    kept, out = average_scan(memory, scans[-1], poses[-1], reach)
    changed = out.ranges != scans[-1].ranges
    assert changed[scans[-1].ranges < reach].all() and not changed[scans[-1].ranges >= reach].any()
    for before, after in zip(by_scan(memory), by_scan(kept), strict=True):
        far = np.hypot(*before.T) > reach + SAME_SURFACE * USUAL_COVER_RADIUS
        left = {tuple(point) for point in after}
        assert all(tuple(point) in left for point in before[far])
        assert len(left) < 1.1 * np.count_nonzero(np.hypot(*before.T) > reach - SAME_SURFACE * USUAL_COVER_RADIUS)


def test_a_surface_that_is_elsewhere_now_is_not_averaged():
    pose = np.zeros((1, 3))
    before = World("before", (0, 0, 0), (0, 0), bounds=WALLS)
    now = World("now", (0, 0, 0), (0, 0), bounds=(-1.5, -1.2, 1.5 - SAME_SURFACE * USUAL_COVER_RADIUS - 0.001, 1.2))
    memory = remembered([cast(before, pose[0])] * 4, pose.repeat(4, axis=0))
    scan = cast(now, pose[0])
    _, out = average_scan(memory, scan, pose[0], REACH)
    ahead = np.abs(scan.bearings) < 0.5
    np.testing.assert_array_equal(out.ranges[ahead], scan.ranges[ahead])


@pytest.mark.parametrize("angle_min", [-math.pi, -2.0])
def test_lost_beams_and_misses_stay_as_they_are(angle_min):
    increment = 2.0 * math.pi / 360
    beams = 360 if angle_min == -math.pi else int(4.0 / increment)
    scan = cast(ROOM, beams=beams, angle_min=angle_min, angle_increment=increment)
    ranges = scan.ranges.copy()
    ranges[10:14], ranges[30:34] = np.nan, np.inf
    broken = dataclasses.replace(scan, ranges=ranges, lost_beams=True)
    _, out = average_scan(remembered([scan] * 2, np.zeros((2, 3))), broken, np.zeros(3), REACH)
    assert np.isnan(out.ranges[10:14]).all() and np.isinf(out.ranges[30:34]).all()
    good = np.isfinite(ranges)
    np.testing.assert_allclose(out.ranges[good], ranges[good], atol=2e-3)
