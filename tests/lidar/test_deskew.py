"""De-skewed scans: hits lie on the obstacles, and none are invented."""

import dataclasses
import math

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from drake_starnav.geometry.se2 import compose_poses, find_pose_in_frame
from drake_starnav.lidar.deskew import deskew_scan
from drake_starnav.lidar.laser_scan import DYNAMIC, STATIC, UNKNOWN, LaserScan
from drake_starnav.worlds import World, compute_clearance
from tests.helpers.scans import cast_rolling

YARD = World(
    "yard", (0, 0, 0), (0, 0), cylinders=np.array([(1.5, 0.4, 0.3), (-0.8, 1.2, 0.4)]), bounds=(-3.0, -2.0, 4.0, 3.0)
)
PERIOD = 0.1
BEFORE = np.array((0.1, -0.2, 0.4))
steps = st.tuples(st.floats(-0.1, 0.1), st.floats(-0.02, 0.02), st.floats(-0.4, 0.4))


def rolling(step, beams: int = 180, **view) -> tuple[LaserScan, np.ndarray]:
    pose = compose_poses(BEFORE, step)
    return cast_rolling(YARD, BEFORE, pose, PERIOD, beams=beams, **view), pose


@settings(max_examples=15)
@given(steps)
def test_hits_lie_where_things_stand(step):
    scan, pose = rolling(step)
    seen = deskew_scan(scan, BEFORE, 0.0, pose)
    reach = seen.distances[seen.hits]
    off = np.abs(compute_clearance(YARD, seen.points(pose)))
    assert (off <= 0.51 * seen.angle_increment * reach + 1e-6).all()  # a beam's half width
    assert seen.time == scan.time and seen.time_increment == 0.0
    gap = abs(step[2]) / seen.angle_increment
    assert seen.lost.sum() <= 2.0 * gap + 3.0


def test_lost_beams_and_missing_returns_stay_so():
    step = (0.05, 0.0, 0.2)
    scan, pose = rolling(step)
    for value in (np.nan, np.inf, -np.inf):
        seen = deskew_scan(dataclasses.replace(scan, ranges=np.full(180, value)), BEFORE, 0.0, pose)
        known = seen.ranges[~np.isnan(seen.ranges)]
        assert (known == value).all() and (len(known) > 150 or math.isnan(value))


@pytest.mark.parametrize("nearest_first", [True, False])
def test_of_several_things_in_one_beam_the_nearest_counts(nearest_first):
    """The robot turns to the right by 0.35 of a beam while each is measured, so that beams lie closer together."""
    ranges = np.linspace(1.0, 4.5, 8)[:: 1 if nearest_first else -1]
    scan = LaserScan(PERIOD, -math.pi, 0.25 * math.pi, 0.0, 5.0, ranges, time_increment=PERIOD / 8)
    seen = deskew_scan(scan, np.array((0.0, 0.0, 8 * 0.35 * 0.25 * math.pi)), 0.0, np.zeros(3))
    groups = ((), (), (0,), (1,), (2, 3), (4,), (5, 6), (7,))
    expected = [min((ranges[i] for i in group), default=math.nan) for group in groups]
    assert seen.ranges == pytest.approx(expected, nan_ok=True)


@pytest.mark.parametrize(
    ("measured", "moved", "seen_as"), [(4.9, -0.4, math.inf), (0.3, 0.2, -math.inf), (4.9, 0.4, 4.5)]
)
def test_hits_outside_the_range_limits_at_the_end_of_the_sweep_are_reported_as_such(measured, moved, seen_as):
    ranges = np.full(8, math.nan)
    ranges[4] = measured  # straight ahead, at half the way
    scan = LaserScan(PERIOD, -math.pi, 0.25 * math.pi, 0.2, 5.0, ranges, time_increment=PERIOD / 8, lost_beams=True)
    seen = deskew_scan(scan, np.zeros(3), 0.0, np.array((moved * 8 / 3, 0.0, 0.0)))
    assert seen.ranges[4] == pytest.approx(seen_as)


def test_motion_follows_its_beam():
    scan, pose = rolling((0.0, 0.0, 0.2))
    motion = np.where(np.arange(180) < 90, DYNAMIC, STATIC)
    seen = deskew_scan(dataclasses.replace(scan, motion=motion), BEFORE, 0.0, pose)
    assert (seen.motion[seen.lost] == UNKNOWN).all()
    assert (seen.motion == motion)[~seen.lost].mean() > 0.9  # the robot turned by a few beams


def test_motion_since_an_older_scan_counts_by_its_share():
    scan, pose = rolling((0.04, 0.0, 0.1))
    older = compose_poses(pose, 3.0 * np.array(find_pose_in_frame(pose, BEFORE)))
    seen = deskew_scan(scan, older, PERIOD - 3.0 * PERIOD, pose)
    assert seen.ranges == pytest.approx(deskew_scan(scan, BEFORE, 0.0, pose).ranges, nan_ok=True)


@pytest.mark.parametrize("clockwise", [False, True])
def test_what_lay_beside_the_first_beam_of_a_sweep_is_unknown(clockwise):
    """The robot backs by 12 cm during a sweep of 220 degrees ahead, past which it now looks back."""
    half, count, moved = 1.92, 400, 0.12
    scan = LaserScan(
        PERIOD, -half, 2.0 * half / (count - 1), 0.0, 5.0, np.full(count, np.inf),
        time_increment=(-1.0 if clockwise else 1.0) * PERIOD / (count - 1), thinnest=0.01,
    )  # fmt: skip
    seen = deskew_scan(scan, np.array((moved, 0.0, 0.0)), 0.0, np.zeros(3), 0.25)
    side = -1.0 if clockwise else 1.0
    first = np.array((math.cos(half), -side * math.sin(half)))  # bearing of the first beam, which began ahead
    away = np.arange(0.26, 3.0, 0.02)
    for bearing, lost in zip(seen.bearings, seen.lost, strict=True):
        offset = away[:, None] * (math.cos(bearing), math.sin(bearing)) - (moved, 0.0)
        unswept = side * (first[0] * offset[:, 1] - first[1] * offset[:, 0]) < -1e-9
        assert lost or side * bearing > 0.0 or not unswept.any()  # the other half of the line leads through the view
    assert 0.8 * count < (~seen.lost).sum() < count
    ahead = deskew_scan(scan, np.array((-moved, 0.0, 0.0)), 0.0, np.zeros(3), 0.25)
    assert (~ahead.lost).sum() > 0.95 * count
