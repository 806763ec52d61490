import copy
import dataclasses
import math

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from drake_starnav.errors import StarnavError
from drake_starnav.lidar.laser_scan import DYNAMIC, LARGEST_UNSEEN, STATIC, UNKNOWN, LaserScan
from tests.helpers.scans import cast, distance, scattered, seeds

GOOD = {"time": 0.0, "angle_min": -math.pi, "angle_increment": 0.25 * math.pi, "range_min": 0.1, "range_max": 4.0}
GOOD |= {"ranges": np.full(8, 2.0)}


@given(seeds)
def test_kinds_of_beams_follow_from_range_and_motion(seed: int) -> None:
    rng = np.random.default_rng(seed)
    ranges = rng.choice([0.5, 2.0, 9.0, np.inf, -np.inf, np.nan], 60)
    motion = rng.choice([STATIC, UNKNOWN, DYNAMIC], 60)
    seen = LaserScan(0.0, -math.pi, math.pi / 30, 0.1, 7.0, ranges, lost_beams=True, motion=motion)
    lost, moving = np.isnan(ranges), motion == DYNAMIC
    np.testing.assert_array_equal(seen.lost, lost)
    np.testing.assert_array_equal(seen.moving, moving)
    np.testing.assert_array_equal(seen.hits, ~lost & ~moving & (ranges < 7.0))
    np.testing.assert_array_equal(seen.mappable, ~lost & (motion == STATIC))
    assert seen.beams.complete == (not lost.any())
    assert ((seen.distances >= 0.0) & (seen.distances <= 7.0)).all()


def test_a_lost_beam_may_have_a_bound_of_its_own() -> None:
    ranges, free = np.array((2.0, np.nan, np.nan, np.inf)), np.array((9.0, 1.5, 9.0, 9.0))
    scan = LaserScan(0.0, 0.0, 0.02, 0.0, 7.0, ranges, lost_beams=True)
    assert scan.distances.tolist() == [2.0, 2.0, 2.0, 7.0]
    bounded = dataclasses.replace(scan, free=free)
    assert bounded.distances.tolist() == [2.0, 1.5, 7.0, 7.0] and bounded.lost.tolist() == scan.lost.tolist()
    clockwise = LaserScan(0.0, 0.0, -0.02, 0.0, 7.0, ranges, lost_beams=True, free=free)
    assert clockwise.distances.tolist() == [7.0, 7.0, 1.5, 2.0]


def scan(**changes) -> LaserScan:
    return LaserScan(**{**GOOD, **changes})


@given(seeds)
def test_points_lie_on_the_surfaces_that_were_hit(seed):
    rng = np.random.default_rng(seed)
    world = scattered(rng)
    pose = np.array((*rng.uniform(-0.3, 0.3, 2), rng.uniform(-4.0, 4.0)))
    seen = cast(world, pose)
    assert seen.points(pose).shape == (seen.hits.sum(), 2)
    assert distance(world, seen.points(pose)).max() < 1e-9


def test_range_conventions_of_rep_117():
    seen = scan(ranges=[np.inf, -np.inf, 0.1, 4.0, 3.9, 5.0, 2.0, 1.0])
    assert seen.hits.tolist() == [False, True, True, False, True, False, True, True]
    assert seen.distances.tolist() == [4.0, 0.0, 0.1, 4.0, 3.9, 4.0, 2.0, 1.0]
    assert len(seen.points()) == 5


@given(seeds, st.integers(8, 500), st.floats(0.1, 6.28), st.booleans())
def test_beams_that_turn_clockwise_are_reversed(seed, beams, span, lost):
    rng = np.random.default_rng(seed)
    ranges, step = rng.uniform(0.2, 6.0, beams), span / (beams - 1)
    motion = rng.integers(0, 3, beams)
    if lost:
        ranges[rng.random(beams) < 0.2] = np.nan
    forwards = scan(ranges=ranges, angle_min=0.3, angle_increment=step, lost_beams=True, motion=motion)
    seen = scan(
        ranges=ranges[::-1], angle_min=forwards.angle_max, angle_increment=-step, time_increment=0.01,
        lost_beams=True, motion=motion[::-1],
    )  # fmt: skip
    assert seen.angle_increment == step and seen.time_increment == -0.01
    np.testing.assert_array_equal(seen.ranges, forwards.ranges)
    np.testing.assert_array_equal(seen.motion, motion)
    np.testing.assert_allclose(seen.points(), forwards.points(), atol=1e-9)
    np.testing.assert_allclose(seen.distances, forwards.distances)


def test_a_scan_is_immutable_and_owns_its_ranges():
    ranges = np.full(8, 2.0)
    seen = scan(ranges=ranges)
    ranges[0] = 1.0
    assert seen.ranges[0] == 2.0
    with pytest.raises(ValueError):
        seen.ranges[0] = 1.0
    assert copy.deepcopy(seen) is seen


def test_the_model_value_saw_nothing():
    nothing = LaserScan.nothing()
    assert not nothing.hits.any() and nothing.full_circle and nothing.points().shape == (0, 2)


@pytest.mark.parametrize(
    "changes, message",
    [
        ({"time": np.nan}, r"time is nan; allowed: a finite number"),
        ({"angle_min": np.inf}, r"angle_min is inf"),
        ({"range_max": np.inf}, r"range_max is inf"),
        ({"ranges": np.ones((2, 4))}, r"shape \(2, 4\); allowed: \(n,\) with n >= 3"),
        ({"ranges": np.ones(2)}, r"shape \(2,\)"),
        ({"range_min": 4.0}, r"range_min 4, range_max 4; allowed: 0 <= range_min < range_max"),
        ({"range_min": -0.1}, r"range_min -0.1"),
        ({"angle_increment": 0.0}, r"angle_increment 0 over 8 beams"),
        ({"angle_increment": 1.0}, r"spans 7 rad; allowed: not 0, at most one turn in either direction"),
        ({"angle_increment": -1.0}, r"spans -7 rad"),
    ],
)
def test_bad_scans_are_refused_with_place_value_and_what_is_allowed(changes, message):
    with pytest.raises(StarnavError, match=message):
        scan(**changes)


@pytest.mark.parametrize("value", [np.nan, 0.0, -0.0, -1.0, 0.11999])
def test_what_drivers_report_for_a_beam_without_a_measurement_is_lost(value):
    seen = LaserScan(0.0, 0.0, 0.1, 0.12, 5.0, np.array([1.0, value, 0.12, 2.0]), lost_beams=True)
    assert seen.lost.tolist() == [False, True, False, False]
    assert seen.hits.tolist() == [True, False, True, True]


@given(seeds, st.floats(0.0, 1.0))
def test_a_lost_beam_counts_as_free_no_farther_than_its_neighbours(seed, share):
    rng = np.random.default_rng(seed)
    whole = cast(scattered(rng), beams=180)
    lost = rng.random(180) < share
    seen = dataclasses.replace(whole, ranges=np.where(lost, np.nan, whole.ranges), lost_beams=True)
    np.testing.assert_array_equal(seen.distances[~lost], whole.distances[~lost])
    reported = np.flatnonzero(~lost)
    for i in np.flatnonzero(lost):
        if len(reported) == 0:
            assert seen.distances[i] == 0.0
            continue
        after, before = reported[np.argmin((reported - i) % 180)], reported[np.argmin((i - reported) % 180)]
        assert seen.distances[i] <= min(whole.distances[after], whole.distances[before])
        if len(reported) > 1:
            gap = ((after - before) % 180) * whole.angle_increment
            assert seen.distances[i] * gap <= LARGEST_UNSEEN + 1e-9


def test_at_the_edge_of_the_field_of_view_one_neighbour_bounds():
    seen = LaserScan(0.0, 0.0, 0.01, 0.0, 5.0, [np.nan, 2.0, 2.0, 1.0, np.nan, np.nan], lost_beams=True)
    assert seen.distances.tolist() == [2.0, 2.0, 2.0, 1.0, 1.0, 1.0]


def test_where_the_thinnest_obstacle_counts_none_fits_between_known_beams_and_the_end_of_a_view_is_unknown():
    seen = LaserScan(
        0.0, 0.0, 0.01, 0.0, 5.0, [np.nan, 2.0, np.nan, np.nan, 3.0, np.nan], lost_beams=True, thinnest=0.03
    )
    np.testing.assert_allclose(seen.distances, [0.0, 2.0, 1.0, 1.0, 3.0, 0.0])
    assert seen.beams.certain_range == pytest.approx(3.0)
    whole = dataclasses.replace(scan(), thinnest=0.03)
    np.testing.assert_array_equal(whole.distances, scan().distances)


@pytest.mark.parametrize("pose", [(0.0, 0.0, 0.0), (1.0, -2.0, 2.5)])
def test_a_hit_lies_on_its_beam_at_its_distance(pose):
    seen = scan()
    distance, beam = seen.polar(seen.points(pose), np.array(pose))
    assert distance == pytest.approx(seen.distances[seen.hits])
    off = np.mod(beam - np.flatnonzero(seen.hits) + 0.5, 2.0 * math.pi / seen.angle_increment) - 0.5
    assert np.abs(off).max() < 1e-6
