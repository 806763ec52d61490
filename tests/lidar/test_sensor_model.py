import math
from concurrent.futures import ThreadPoolExecutor

import numpy as np
import pytest

from drake_starnav.errors import StarnavError
from drake_starnav.lidar.sensor_model import LidarParameters, arrives, find_scan_index, measure

EXACT = LidarParameters(noise=0.0)


@pytest.mark.parametrize(("first", "last"), [(-math.pi, math.pi), (0.0, 6.28319), (-3.14159, 3.14159), (2.0, -4.2832)])
def test_a_full_circle_excludes_its_end_point(first, last):
    view = LidarParameters(angle_min=first, angle_max=last).field_of_view
    assert view.full_circle and view.angle_increment == 2.0 * math.pi / 360 == view.widest_gap


def test_a_part_of_a_turn_includes_both_ends():
    for first, last in ((-1.0, 2.0), (2.0, -1.0), (0.0, 6.28)):
        lidar = LidarParameters(beams=181, angle_min=first, angle_max=last)
        view = lidar.field_of_view
        assert view.angle_min == pytest.approx(min(first, last)) and view.angle_max == pytest.approx(max(first, last))
        assert view.angle_increment == lidar.angle_increment == pytest.approx(abs(last - first) / 180)
        assert view.full_circle == (last == 6.28) and lidar.clockwise == (last < first)


@pytest.mark.parametrize("last", [math.pi, -math.pi])
def test_masked_beams_are_lost_and_their_sectors_are_gaps(last):
    lidar = LidarParameters(noise=0.0, angle_min=-last, angle_max=last, mask=[[3.0, -3.0]])
    bearing = lidar.field_of_view.angle_min + math.radians(1.0) * np.arange(360)
    lost = np.isnan(measure(np.full(360, 2.0), lidar, 0, 0))
    assert np.array_equal(lost, np.cos(bearing) < math.cos(3.0)) and lost.sum() > 10
    assert lidar.widest_gap == pytest.approx(math.tau - 6.0 + math.radians(1.0))


@pytest.mark.parametrize("mask", [[3], [[1.0]], [[0.0, math.inf]], [["a", "b"]]])
def test_a_mask_is_pairs_of_bearings(mask):
    with pytest.raises(StarnavError, match=r"lidar\.mask has the sector .*; allowed: \[first, last\], finite bearings"):
        LidarParameters(mask=mask)


def test_ranges_follow_rep_117():
    distances = np.array([0.0, 0.0199, 0.02, 1.0, 4.999, 5.0, np.inf])
    assert measure(distances, EXACT, 0, 0).tolist() == [-np.inf, -np.inf, 0.02, 1.0, 4.999, np.inf, np.inf]


def test_noise_keeps_hits_within_the_limits():
    distances = np.tile([0.021, 4.9999, 2.0, 0.01, 6.0], 1000)
    ranges = measure(distances, LidarParameters(noise=0.1), 1, 2).reshape(-1, 5)
    assert (ranges[:, :3] >= 0.02).all() and (ranges[:, :3] < 5.0).all()
    assert (ranges[:, 3] == -np.inf).all() and (ranges[:, 4] == np.inf).all()
    assert np.mean(ranges[:, 2]) == pytest.approx(2.0, abs=0.015)
    assert np.std(ranges[:, 2]) == pytest.approx(0.1, rel=0.1)


def test_noise_is_that_of_a_fresh_generator_in_any_thread():
    noisy, distances = LidarParameters(noise=0.1), np.full(360, 2.0)

    def fresh(seed, index):
        generator = np.random.Generator(np.random.Philox(key=seed, counter=np.array([0, 0, 0, index], dtype=np.uint64)))
        return 2.0 + 0.1 * generator.standard_normal(360)

    scans = [(seed, index) for seed in (0, 3, 2**64 - 1) for index in (0, 1, 10**6)]
    with ThreadPoolExecutor(4) as threads:
        ranges = list(threads.map(lambda scan: measure(distances, noisy, *scan), scans * 20))
    for scan, found in zip(scans * 20, ranges, strict=True):
        assert np.array_equal(found, fresh(*scan))
    fewer = np.where(np.arange(360) < 100, np.inf, 2.0)  # a beam's noise does not depend on what the others hit
    assert np.array_equal(measure(fewer, noisy, 3, 1)[100:], fresh(3, 1)[100:])


def test_dropout_loses_beams_at_the_given_rate():
    lidar = LidarParameters(beams=10000, noise=0.0, dropout=0.2)
    ranges = measure(np.full(10000, 2.0), lidar, 0, 7)
    assert set(ranges[~np.isnan(ranges)]) == {2.0}
    assert np.isnan(ranges).mean() == pytest.approx(0.2, abs=0.02)
    assert np.isnan(measure(np.full(10, 2.0), LidarParameters(beams=10, dropout=1.0), 0, 0)).all()


def test_outliers_fall_short_of_the_truth_at_the_given_rate():
    exact = LidarParameters(beams=10000, noise=0.0, outliers=0.1)
    for truth in (2.0, np.inf):
        ranges = measure(np.full(10000, truth), exact, 0, 7)
        stray = ranges != truth
        assert stray.mean() == pytest.approx(0.1, abs=0.01)
        assert (ranges[stray] >= exact.range_min).all() and (ranges[stray] < min(truth, exact.range_max)).all()
        assert np.ptp(ranges[stray]) > 0.95 * (min(truth, exact.range_max) - exact.range_min)


def test_whole_scans_are_lost_by_chance_and_while_the_sensor_is_silent():
    lossy = LidarParameters(scan_loss=0.3)
    lost = [not arrives(lossy, 5, k) for k in range(3000)]
    assert np.mean(lost) == pytest.approx(0.3, abs=0.03)
    assert lost[:50] == [not arrives(lossy, 5, k) for k in range(50)]
    assert all(arrives(LidarParameters(), 5, k) for k in range(100))
    silent = LidarParameters(silence_start=1.0, silence_duration=0.5)
    assert [k for k in range(100) if not arrives(silent, 5, k)] == list(range(20, 30))


def test_scans_are_numbered_by_time():
    rate = 30.0
    period = 1.0 / rate
    assert [find_scan_index(k * period, rate) for k in range(1000)] == list(range(1000))
    assert find_scan_index(0.9 * period, rate) == 0


@pytest.mark.parametrize(
    ("values", "message"),
    [
        ({"beams": 0}, r"lidar\.beams is 0; allowed: 3 <= x"),
        ({"range_min": 6.0}, r"lidar\.range_min is 6 with lidar\.range_max 5; allowed: range_min < range_max"),
        ({"angle_min": 1.0, "angle_max": 1.0}, r"span of 0 rad; allowed: not 0, at most one turn"),
        ({"angle_min": -4.0, "angle_max": 4.0}, r"span of 8 rad"),
        ({"dropout": 1.5}, r"lidar\.dropout is 1\.5; allowed: 0 <= x <= 1"),
        ({"noise": float("nan")}, r"lidar\.noise is nan"),
        ({"rate": 0.0}, r"lidar\.rate is 0\.0; allowed: 0\.1 <= x"),
    ],
)
def test_bad_parameters_are_named(values, message):
    with pytest.raises(StarnavError, match=message):
        LidarParameters(**values)
