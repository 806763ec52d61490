"""Erosion against the geometry it stands for: how far a disc can move before it touches a hit."""

import dataclasses
import math

import numpy as np
from hypothesis import given, settings
from hypothesis import strategies as st

from drake_starnav.lidar.laser_scan import DYNAMIC, STATIC, LaserScan
from drake_starnav.surroundings.bearing_hits import convert_points_to_bearings, measure_half_chords
from drake_starnav.surroundings.erosion import (
    FreeRange,
    compute_free_range,
    erode,
    make_bearing_tables,
    smooth_distances,
)
from drake_starnav.surroundings.margins import Margins
from tests.helpers.scans import MARGINS, RADIUS, cast, scattered, seeds, segment_distance

RAW = dataclasses.replace(MARGINS, least=MARGINS.preferred)
"""One margin everywhere; for passages see test_passages.py."""
INFLATED = RADIUS + RAW.preferred


def full_scan(ranges: np.ndarray, range_max: float = 5.0) -> LaserScan:
    return LaserScan(0.0, -math.pi, 2.0 * math.pi / len(ranges), 0.0, range_max, ranges)


def profile(scan: LaserScan, margins: Margins = RAW) -> FreeRange:
    return compute_free_range(scan, scan.distances, RADIUS, margins)


def rays(scan: LaserScan, samples: int) -> np.ndarray:
    angle = scan.angle_min + 2.0 * math.pi / samples * np.arange(samples)
    return np.column_stack((np.cos(angle), np.sin(angle)))


def clearances(ends: np.ndarray, points: np.ndarray) -> np.ndarray:
    """Distance of each point to each straight segment from the origin; shape (ends, points)."""
    return segment_distance(points[None, :, :], np.zeros(2), ends[:, None, :])


@settings(max_examples=20)
@given(seeds, st.sampled_from([180, 360, 720]))
def test_the_disc_moves_freely_as_far_as_stated_and_no_farther(seed, beams):
    scan = cast(scattered(np.random.default_rng(seed)), beams=beams)
    samples, limit, *_ = profile(scan)
    radius = np.hypot(INFLATED, measure_half_chords(scan.distances, scan.beams)[scan.hits])
    points = scan.points()
    spare = clearances(samples[:, None] * rays(scan, len(samples)), points) - radius
    assert spare.min() > -1e-9
    beyond = clearances((samples + 1e-6)[:, None] * rays(scan, len(samples)), points) - radius
    stopped = samples < limit
    assert stopped.any() and (beyond.min(axis=1) < 1e-12)[stopped].all()


@settings(max_examples=20)
@given(seeds)
def test_no_slit_is_left_between_hits_of_one_surface(seed):
    scan = cast(scattered(np.random.default_rng(seed)), beams=120)
    samples = profile(scan).values
    ends = samples[:, None] * rays(scan, len(samples))
    points = scan.points()
    neighbours = scan.hits & np.roll(scan.hits, -1)
    index = np.cumsum(scan.hits) - 1
    a, b = points[index[neighbours]], points[(index[neighbours] + 1) % len(points)]
    connected = np.hypot(*(a - b).T) < 0.15
    assert connected.any()
    along = np.linspace(0.0, 1.0, 9)[:, None, None]
    chords = (a[connected] + along * (b - a)[connected]).reshape(-1, 2)
    moving = samples > 0.0
    assert clearances(ends[moving], chords).min() > INFLATED - 1e-9


@settings(max_examples=20)
@given(seeds, st.integers(20, 400), st.floats(0.5, 6.2))
def test_partial_field_of_view_is_bounded_inside_and_zero_outside(seed, beams, field):
    rng = np.random.default_rng(seed)
    first, increment = rng.uniform(-4.0, 4.0), field / (beams - 1)
    scan = cast(scattered(rng), beams=beams, angle_min=first, angle_increment=increment)
    samples, limit, *_ = profile(scan)
    bearing = 2.0 * math.pi / len(samples) * np.arange(len(samples))
    find_view_range = bearing <= field + 1e-9
    assert len(samples) == 720
    assert (samples[~find_view_range] == 0.0).all() and (limit[~find_view_range] == 0.0).all()
    np.testing.assert_allclose(limit[find_view_range], scan.range_max - INFLATED)
    ends = samples[:, None] * rays(scan, len(samples))
    assert (clearances(ends, scan.points()) - INFLATED).min() > -1e-9


@settings(max_examples=20)
@given(seeds)
def test_points_off_the_sampled_bearings_bound_from_inside(seed):
    rng = np.random.default_rng(seed)
    angle, length = rng.uniform(-math.pi, math.pi, 200), rng.uniform(INFLATED + 0.02, 2.0, 200)
    points = length[:, None] * np.column_stack((np.cos(angle), np.sin(angle)))
    center, bearing_0 = rng.uniform(-5.0, 5.0, 2), rng.uniform(-4.0, 4.0)
    hits = convert_points_to_bearings(points + center, np.zeros(200), *center, bearing_0, 3.0, 720)
    samples = erode(*hits, INFLATED, np.full(720, 2.0 - INFLATED), *make_bearing_tables(720))
    left = rng.integers(0, 720, 500)
    bearing = bearing_0 + 2.0 * math.pi / 720 * (left + rng.random(500))
    smaller = np.minimum(samples[left], samples[(left + 1) % 720])
    ends = smaller[:, None] * np.column_stack((np.cos(bearing), np.sin(bearing)))
    assert (clearances(ends, points) - INFLATED)[smaller > 0.0].min() > -1e-9
    assert samples.max() <= 2.0 - INFLATED


def test_beams_without_return_reach_to_the_rim_and_too_close_ones_allow_only_retreat():
    open_space = profile(full_scan(np.full(360, np.inf))).values
    np.testing.assert_allclose(open_space, 5.0 - INFLATED)
    ranges = np.full(360, np.inf)
    ranges[180] = -np.inf  # straight ahead
    samples = profile(full_scan(ranges)).values
    angle = 2.0 * math.pi / 720 * (np.arange(720) - 360)
    assert (samples[np.abs(angle) <= math.pi / 2 + 1e-9] == 0.0).all()
    np.testing.assert_allclose(samples[np.abs(angle) > math.pi / 2 + 1e-9], 5.0 - INFLATED)
    assert (profile(full_scan(np.full(360, -np.inf))).values == 0.0).all()


@settings(max_examples=30)
@given(seeds)
def test_smoothing_takes_noise_but_leaves_jumps_and_missing_returns_alone(seed):
    rng = np.random.default_rng(seed)
    steps = np.repeat(rng.permutation(12) * 0.3 + 1.0, 30)  # flat surfaces, at least 0.3 m from one to the next
    steps[rng.integers(0, 360, 5)] = np.inf
    exact = full_scan(steps)
    np.testing.assert_allclose(smooth_distances(exact), exact.distances, atol=1e-12)
    noisy = full_scan(steps + rng.normal(0.0, 0.01, 360))
    smooth = smooth_distances(noisy)
    assert (smooth == 5.0).tolist() == (~noisy.hits).tolist()
    assert np.abs(smooth - noisy.distances).max() < 0.04
    error = np.abs(np.array((smooth, noisy.distances)) - exact.distances)[:, exact.hits].mean(axis=1)
    assert error[0] < 0.7 * error[1]


@settings(max_examples=30)
@given(seeds)
def test_with_slack_much_noise_is_smoothed_too(seed):
    rng = np.random.default_rng(seed)
    exact = np.repeat(rng.permutation(8) * 0.5 + 1.0, 45)
    noisy = full_scan(exact + rng.normal(0.0, 0.05, 360))
    error = [smooth_distances(noisy, slack) - exact for slack in (0.0, 0.12)]
    assert np.std(error[1]) < 0.75 * np.std(error[0]) and np.std(error[1]) < 0.035


def test_moving_obstacles_occlude_the_space_behind_them_but_are_not_eroded() -> None:
    n = 360
    bearing = -math.pi + 2.0 * math.pi / n * np.arange(n)
    shown = np.abs(bearing) < 0.1
    scan = dataclasses.replace(full_scan(np.where(shown, 1.5, 4.0)), motion=np.where(shown, DYNAMIC, STATIC))
    free, limit, *_ = profile(scan)
    nothing = profile(full_scan(np.full(n, 4.0))).values
    samples = len(free)
    theta = -math.pi + 2.0 * math.pi / samples * np.arange(samples)
    np.testing.assert_allclose(free[np.abs(theta) < 0.1], 1.5 - INFLATED)
    beside = np.abs(theta) > 0.1 + 2.5 * scan.angle_increment
    np.testing.assert_array_equal(free[beside], nothing[beside])
    assert (limit > 4.0).all()
