import math
import warnings

import numpy as np
import pytest
from hypothesis import given, settings

from drake_starnav.geometry.se2 import placed
from drake_starnav.regions.bearing_hits import half_gaps
from drake_starnav.regions.erosion import FreeRange, free_range
from drake_starnav.regions.star_region import (
    StarRegion,
    fit_region,
    scan_region,
    united,
)
from tests.helpers.scans import MARGINS, RADIUS, cast, scattered, seeds, smooth_region

STEP = 2.0 * math.pi / 720


def unit(theta: np.ndarray | float) -> np.ndarray:
    return np.stack((np.cos(theta), np.sin(theta)), axis=-1)


def seen_from(seed: int) -> tuple[StarRegion, np.ndarray, np.ndarray]:
    """A region in a random world, the hits it was made from, in W, and their half gaps."""
    rng = np.random.default_rng(seed)
    pose = np.array((*rng.uniform(-0.2, 0.2, 2), rng.uniform(-4.0, 4.0)))
    scan = cast(scattered(rng), pose)
    profile = free_range(scan, scan.distances, RADIUS, MARGINS)
    region = fit_region(profile, pose[:2], pose[2] + scan.angle_min)
    return region, scan.points(pose), half_gaps(scan, scan.distances)[scan.hits]


@settings(max_examples=20)
@given(seeds)
def test_gamma_is_one_on_the_boundary_above_inside_below_outside(seed):
    region, _, _ = seen_from(seed)
    theta = np.random.default_rng(seed).uniform(-math.pi, math.pi, 200)
    phi = region.phi(theta)
    theta, phi = theta[phi > 0.01], phi[phi > 0.01]
    ray = unit(theta)
    np.testing.assert_allclose(region.gamma(region.center + phi[:, None] * ray), 1.0, atol=1e-6)
    np.testing.assert_allclose(region.gamma(region.center + 0.5 * phi[:, None] * ray), 4.0, rtol=1e-6)
    np.testing.assert_allclose(region.gamma(region.center + 2.0 * phi[:, None] * ray, 3.0), 0.125, rtol=1e-6)
    assert region.gamma(region.center) == np.inf
    assert region.gamma(np.zeros((2, 3, 2))).shape == (2, 3)


@settings(max_examples=20)
@given(seeds)
def test_phi_at_the_samples_is_the_fitted_value(seed):
    region, _, _ = seen_from(seed)
    inside = np.arange(1, 720)  # sample 0: see the seam's own test
    theta = region.bearing_0 + STEP * inside
    jumps = np.abs(region.phi(theta + 1e-9) - region.phi(theta - 1e-9)) > 1e-6
    np.testing.assert_allclose(region.phi(theta)[~jumps], region.boundary.values[inside][~jumps], atol=1e-9)


def test_phi_just_before_the_first_sample_is_continuous():
    samples = 2.0 + 0.1 * np.cos(STEP * np.arange(720))
    region = fit_region(FreeRange(samples, np.full(720, 5.0), 0.0), np.zeros(2), 0.3)
    assert region.phi(np.nextafter(0.3, 0.0)) == pytest.approx(region.phi(0.3), abs=0.05)


@settings(max_examples=20)
@given(seeds)
def test_phi_prime_is_the_derivative_of_phi(seed):
    region, _, _ = seen_from(seed)
    ends = np.append(region.boundary.starts[1:], 720) - 1
    left = np.setdiff1d(np.arange(719), ends)  # between the last sample of a segment and the next there is no cubic
    theta = region.bearing_0 + STEP * (left + 0.5)
    h = 1e-6
    difference = (region.phi(theta + h) - region.phi(theta - h)) / (2.0 * h)
    positive = region.phi(theta) > 1e-3
    np.testing.assert_allclose(region.phi_prime(theta)[positive], difference[positive], atol=1e-5, rtol=1e-5)


@settings(max_examples=20)
@given(seeds)
def test_bearings_are_periodic(seed):
    region, _, _ = seen_from(seed)
    theta = region.bearing_0 + STEP * (np.arange(720) + 0.37)
    for turns in (-3, -1, 2):
        np.testing.assert_allclose(region.phi(theta + turns * 2.0 * math.pi), region.phi(theta), atol=1e-6)


@settings(max_examples=30)
@given(seeds)
def test_contained_points_have_the_clearance_that_the_region_states(seed):
    region, hits, gap = seen_from(seed)
    points = region.center + np.random.default_rng(seed).uniform(-3.0, 3.0, (2000, 2))
    inside = region.contains(points)
    assert inside.any() and not inside.all()
    away = np.hypot(*np.moveaxis(points[inside][:, None] - hits, -1, 0))
    assert (away - np.hypot(RADIUS + region.margin, gap)).min() > -1e-9
    assert region.gamma(points[inside]).min() > 1.0 - 1e-2  # a cubic may sag between its samples
    assert np.mean(region.gamma(points[inside]) >= 1.0) > 0.99
    assert (np.hypot(*(points[inside] - region.center).T) <= region.reach).all()


@settings(max_examples=20)
@given(seeds)
def test_a_region_moves_with_the_pose_of_its_scan(seed):
    rng = np.random.default_rng(seed)
    scan = cast(scattered(rng))
    pose = rng.uniform(-3.0, 3.0, 3)
    at_origin, moved = (scan_region(scan, p, RADIUS, MARGINS) for p in (np.zeros(3), pose))
    points = rng.uniform(-3.0, 3.0, (300, 2))
    c, s = math.cos(pose[2]), math.sin(pose[2])
    there = points @ np.array(((c, s), (-s, c))) + pose[:2]
    np.testing.assert_allclose(moved.gamma(there), at_origin.gamma(points), rtol=1e-6)
    assert (moved.contains(there) == at_origin.contains(points)).all()


def test_the_outline_consists_of_the_samples():
    region = smooth_region(np.random.default_rng(3), np.array((1.0, -2.0)))
    offset = region.outline() - region.center
    np.testing.assert_allclose(np.hypot(*offset.T), region.boundary.values)
    np.testing.assert_allclose(region.outline(36), region.outline()[::20])
    assert region.contains(region.outline() - 1e-2 * offset).all()


def test_where_nothing_was_seen_there_is_no_room():
    region = fit_region(FreeRange(np.zeros(720), np.zeros(720), 0.0), np.ones(2), 0.0)
    assert region.contains(np.ones(2)) and not region.contains(np.array((1.001, 1.0)))
    assert region.gamma(np.array((1.5, 1.2))) == 0.0


def test_gamma_at_a_center_without_room_warns_of_nothing():
    region = fit_region(FreeRange(np.zeros(720), np.zeros(720), 0.0), np.ones(2), 0.0)
    with warnings.catch_warnings():
        warnings.simplefilter("error")
        assert region.gamma(np.ones(2)) == np.inf


@settings(max_examples=10)
@given(seeds)
def test_a_region_in_another_frame_contains_the_same_points(seed):
    region, _, _ = seen_from(seed)
    rng = np.random.default_rng(seed)
    frame = rng.uniform(-3.0, 3.0, 3)
    points = region.center + rng.uniform(-3.0, 3.0, (500, 2))
    there = placed(frame, points)
    gamma = region.gamma(points)
    np.testing.assert_allclose(region.moved(frame).gamma(there), gamma, rtol=1e-6)
    union = united((region,)).moved(frame)
    away = np.abs(gamma - 1.0) > 1e-2  # not where rounding decides
    found = union.contains(there[away])
    assert np.mean(found == region.contains(points[away])) > 0.99
