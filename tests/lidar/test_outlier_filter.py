"""Outliers are doubted, surfaces never, and thin obstacles for two scans only."""

import dataclasses
import math

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from drake_starnav import LaserScan, World
from drake_starnav.lidar.outlier_filter import (
    CONFIRMATIONS,
    CONFIRMING_SCANS,
    HitHistory,
    find_lone_close_hits,
    remove_lone_close_hits,
    remove_outliers,
)
from drake_starnav.lidar.sensor_model import LidarParameters, measure
from tests.helpers.scans import ORIGIN, cast, scattered, seeds

NOTHING = HitHistory()


def circle(ranges: np.ndarray) -> LaserScan:
    return LaserScan(0.0, -math.pi, 2.0 * math.pi / len(ranges), 0.0, 5.0, ranges, lost_beams=True)


def lonely(**hits: float) -> LaserScan:
    """A full circle with returns only in the named beams, e.g. b12=1.0."""
    ranges = np.full(360, np.inf)
    for name, distance in hits.items():
        ranges[int(name[1:])] = distance
    return circle(ranges)


def test_a_lonely_hit_is_lost_not_free():
    seen = remove_outliers(lonely(b90=1.0), ORIGIN, NOTHING)[0]
    assert seen.lost.tolist() == [k == 90 for k in range(360)] and not seen.hits.any()


def test_neighbours_confirm_each_other_also_across_the_seam_and_a_lost_beam():
    for a, b, away in ((10, 11, 1.02), (0, 359, 1.0), (359, 1, 1.0), (10, 12, 1.0)):
        assert remove_outliers(lonely(**{f"b{a}": 1.0, f"b{b}": away}), ORIGIN, NOTHING)[0].beams.complete
    assert remove_outliers(lonely(b10=1.0, b13=1.0), ORIGIN, NOTHING)[0].lost.sum() == 2
    assert remove_outliers(lonely(b10=1.0, b11=1.3), ORIGIN, NOTHING)[0].lost.sum() == 2


def test_a_third_scan_confirms_a_thin_obstacle_from_another_place():
    post, history = np.array((1.0, 0.3)), NOTHING
    for k, pose in enumerate(np.array([(0.0, 0.0, 0.0), (0.04, 0.0, 0.05), (0.08, 0.01, 0.1)])):
        offset = post - pose[:2]
        beam = round((math.atan2(offset[1], offset[0]) - pose[2] + math.pi) / (2.0 * math.pi / 360))
        scan = lonely(**{f"b{beam}": float(np.hypot(*offset))})
        assert remove_outliers(scan, pose, history)[0].hits.any() == (k >= CONFIRMATIONS == 2)
        history = history.add_scan(scan.points(pose))


def test_old_scans_confirm_nothing():
    scan, history = lonely(b10=1.0), NOTHING
    for _ in range(CONFIRMATIONS):
        history = history.add_scan(scan.points())
    for _ in range(CONFIRMING_SCANS - CONFIRMATIONS):
        history = history.add_scan(np.zeros((0, 2)))
        assert remove_outliers(scan, ORIGIN, history)[0].hits.any()
    assert not remove_outliers(scan, ORIGIN, history.add_scan(np.zeros((0, 2))))[0].hits.any()


def test_a_hit_inside_the_robot_is_an_outlier_even_with_a_neighbour():
    scan = lonely(b10=0.2, b11=0.2, b90=0.22, b91=0.25, b200=-np.inf, b201=-np.inf)
    kept, certain, _ = remove_outliers(scan, ORIGIN, NOTHING, 0.25, 0.01)
    assert np.flatnonzero(kept.lost).tolist() == np.flatnonzero(certain.lost).tolist() == [10, 11, 200, 201]
    assert remove_outliers(scan, ORIGIN, NOTHING, noise=0.01)[0].beams.complete
    outside = dataclasses.replace(lonely(b200=-np.inf, b201=-np.inf), range_min=0.3)  # it is too close, not inside
    assert remove_outliers(outside, ORIGIN, NOTHING, 0.25, 0.01)[0].beams.complete


@pytest.mark.parametrize("value", [-np.inf, 0.05, 0.2])
def test_a_beam_that_alone_sees_something_inside_the_robot_errs(value):
    view = {"time": 0.0, "angle_min": -2.0, "angle_increment": 0.02, "range_min": 0.02, "range_max": 5.0}
    for beam in (2, 90, 197):
        scan = LaserScan(**view, ranges=np.where(np.arange(200) == beam, value, 3.0))
        assert find_lone_close_hits(scan, 0.25).tolist() == [beam]
        assert np.flatnonzero(remove_lone_close_hits(scan, ORIGIN, NOTHING, 0.25).scan.lost).tolist() == [beam]


@pytest.mark.parametrize("bearing", np.linspace(-3.0, 3.0, 7))
@pytest.mark.parametrize("gap", [0.01, 0.1])
def test_what_is_two_beams_wide_where_it_is_too_close_counts(bearing, gap):
    """And beside a beam that measured nothing, or at the end of the view, one beam suffices."""
    range_min, beams = 0.3, 360
    radius = 1.1 * (range_min - gap) * 2.0 * np.pi / beams
    away = np.array((math.cos(bearing), math.sin(bearing)))
    pole = World("pole", (0.0, 0.0, 0.0), (9.0, 9.0), cylinders=np.array([(*((range_min - gap) * away), radius)]))
    seen = cast(pole, beams=beams)
    too_close = np.where(seen.ranges < range_min, -np.inf, seen.ranges)
    scan = dataclasses.replace(seen, range_min=range_min, ranges=too_close)
    assert np.isneginf(scan.ranges).any() and not len(find_lone_close_hits(scan, 0.25))
    for changes in ({7: -np.inf, 8: np.nan}, {0: -np.inf}, {7: -np.inf, 9: 0.31}, {7: 0.1, 9: 0.2}):
        ranges = np.full(90, 3.0)
        ranges[list(changes)] = list(changes.values())
        scan = LaserScan(0.0, -1.0, 0.02, 0.02, 5.0, ranges, lost_beams=True)
        assert not len(find_lone_close_hits(scan, 0.3))


@given(seeds)
def test_what_two_neighbouring_beams_hit_is_never_doubted(seed):
    scan = cast(scattered(np.random.default_rng(seed)))
    kept, certain, _ = remove_outliers(scan, ORIGIN, NOTHING)
    points = np.where(scan.hits[:, None], scan.points_at(scan.distances, np.ones(360, bool), ORIGIN), np.inf)
    with np.errstate(invalid="ignore"):
        chord = np.hypot(*(points - np.roll(points, 1, axis=0)).T)
    pair = chord <= 0.05
    assert not kept.lost[pair].any() and not kept.lost[np.roll(pair, -1)].any()
    np.testing.assert_array_equal(kept.lost, certain.lost)  # there are no earlier scans
    same = ~kept.lost
    np.testing.assert_array_equal(kept.ranges[same], scan.ranges[same])


@given(seeds, st.floats(0.0, 0.05))
def test_nearly_all_strays_and_hardly_any_surface_are_doubted(seed, share):
    lidar = LidarParameters(noise=0.0, outliers=share)
    world, history = scattered(np.random.default_rng(seed), discs=3, walls=1), NOTHING
    truth = cast(world)
    strays = survivors = entered = doubted = reported = 0
    for k in range(10):
        ranges = measure(truth.ranges, lidar, seed, k)
        scan = dataclasses.replace(truth, ranges=ranges)
        kept, certain, _ = remove_outliers(scan, ORIGIN, history)
        history = history.add_scan(scan.points())
        stray = (truth.distances - scan.distances) > 0.3
        strays, survivors = strays + stray.sum(), survivors + kept.hits[stray].sum()
        if k >= CONFIRMATIONS:
            assert (certain.hits <= kept.hits).all()
            entered += certain.hits[stray].sum()
            doubted, reported = doubted + kept.lost[~stray].sum(), reported + (~stray).sum()
    assert survivors <= 0.05 * strays + 6
    assert entered <= 2
    assert doubted <= 0.01 * reported + 3
