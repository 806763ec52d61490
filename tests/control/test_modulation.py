import math

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from drake_starnav.control.modulation import CENTER, FARTHEST, SIGMA, evaluate_boundary, modulate_direction
from drake_starnav.surroundings.star_region import StarRegion, unite_regions
from tests.helpers.scans import RADIUS, seeds, smooth_region, unit


def frame(region: StarRegion, point: np.ndarray) -> tuple[np.ndarray, float]:
    """E = [r_hat t] at a point and Gamma there, by plain NumPy from the region's samples."""
    offset = point - region.center
    away, theta = np.hypot(*offset), math.atan2(offset[1], offset[0])
    phi, slope = evaluate_boundary(region.boundary.values, region.boundary.slopes, region.bearing_0, theta)
    tangent = slope * unit(theta) + phi * np.array((-math.sin(theta), math.cos(theta)))
    return np.column_stack((offset / away, tangent / np.hypot(*tangent))), (phi / away) ** SIGMA


def expected(point: np.ndarray, direction: np.ndarray, regions: list[StarRegion]) -> np.ndarray:
    """The weighted mean of M u = E D E^-1 u, normalised each, over the regions that contain the point."""
    total = np.zeros(2)
    for region in regions:
        basis, gamma = frame(region, point)
        if gamma > 1.0:
            parts = np.linalg.solve(basis, direction)
            damping = 1.0 - 1.0 / gamma if parts[0] > 0.0 else 1.0
            modulated = basis @ np.diag((damping, 1.0 + 1.0 / gamma)) @ parts
            total += (gamma - 1.0) * modulated / np.hypot(*modulated)
    return total / np.hypot(*total) if np.hypot(*total) else direction


def modulated(point: np.ndarray, direction: np.ndarray, regions: list[StarRegion]) -> np.ndarray:
    return np.array(modulate_direction(*point, *direction, unite_regions(regions), RADIUS))


def inside(rng: np.random.Generator, region: StarRegion) -> np.ndarray:
    angle = rng.uniform(-math.pi, math.pi)
    return region.center + rng.uniform(0.05, 0.98) * float(region.phi(angle)) * unit(angle)


@given(seeds)
def test_regions_seen_from_far_away_and_those_without_the_position_have_no_effect(seed):
    rng = np.random.default_rng(seed)
    near = smooth_region(rng, np.zeros(2))
    point, direction = inside(rng, near), unit(rng.uniform(-math.pi, math.pi))
    wide = smooth_region(rng, point + (FARTHEST * RADIUS + 0.01) * unit(rng.uniform(-math.pi, math.pi)), mean=10.0)
    elsewhere = smooth_region(rng, point + 2.9 * unit(rng.uniform(-math.pi, math.pi)), mean=1.5)
    assert wide.contains(point) and not elsewhere.contains(point)
    alone = modulated(point, direction, [near])
    np.testing.assert_array_equal(modulated(point, direction, [wide, near, elsewhere]), alone)


@settings(max_examples=60)
@given(seeds, st.integers(1, 4))
def test_it_equals_an_independent_evaluation(seed, count):
    rng = np.random.default_rng(seed)
    regions = [smooth_region(rng, rng.uniform(-1.0, 1.0, 2)) for _ in range(count)]
    for _ in range(20):
        point, direction = inside(rng, regions[0]), unit(rng.uniform(-math.pi, math.pi))
        out = modulated(point, direction, regions)
        np.testing.assert_allclose(out, expected(point, direction, regions), atol=1e-9)
        assert np.hypot(*out) == pytest.approx(1.0)


@settings(max_examples=60)
@given(seeds)
def test_nothing_flows_out_through_the_boundary(seed):
    rng = np.random.default_rng(seed)
    region = smooth_region(rng, rng.uniform(-3.0, 3.0, 2))
    for _ in range(20):
        theta = rng.uniform(-math.pi, math.pi)
        phi, _ = evaluate_boundary(region.boundary.values, region.boundary.slopes, region.bearing_0, theta)
        point = region.center + (1.0 - 2e-14) * phi * unit(theta)
        basis, _ = frame(region, point)
        normal = np.array((basis[1, 1], -basis[0, 1]))
        direction = unit(rng.uniform(-math.pi, math.pi))
        flux = float(normal @ modulated(point, direction, [region]))
        radial, tangential = np.linalg.solve(basis, direction)
        if radial > 0.0:
            assert abs(flux) * abs(2.0 * tangential) <= 1e-12  # of M u, before it is normalised
        else:
            assert flux < 0.0


@settings(max_examples=20)
@given(seeds)
def test_at_the_reference_point_and_outside_of_all_regions_nothing_changes(seed):
    rng = np.random.default_rng(seed)
    region, direction = smooth_region(rng, rng.uniform(-3.0, 3.0, 2)), unit(rng.uniform(-math.pi, math.pi))
    np.testing.assert_allclose(modulated(region.center, direction, [region]), direction)
    near = region.center + 1.01 * CENTER * RADIUS * unit(rng.uniform(-math.pi, math.pi))
    np.testing.assert_allclose(modulated(near, direction, [region]), direction, atol=0.01)
    np.testing.assert_array_equal(modulated(region.center + (20.0, 0.0), direction, [region]), direction)
    np.testing.assert_array_equal(modulated(region.center, direction, []), direction)


@settings(max_examples=20)
@given(seeds)
def test_towards_a_reference_point_its_own_region_outweighs_the_others(seed):
    rng = np.random.default_rng(seed)
    region, direction = smooth_region(rng, np.zeros(2)), unit(rng.uniform(-math.pi, math.pi))
    other = smooth_region(rng, 0.5 * unit(rng.uniform(-math.pi, math.pi)))
    side = unit(rng.uniform(-math.pi, math.pi))
    for distance in (0.99, 1.01):
        near = modulated(distance * CENTER * RADIUS * side, direction, [region, other])
        np.testing.assert_allclose(near, direction, atol=0.01)


@given(seeds, st.floats(-20.0, 20.0))
def test_the_boundary_is_linear_between_samples_all_around(seed, theta):
    """So that the field is continuous, which follows from the evaluation above."""
    values, slopes = np.random.default_rng(seed).uniform(0.1, 2.0, (2, 9))
    at = 0.7 + 2.0 * math.pi / 9 * np.arange(9)
    expected = [np.interp(theta, at, row, period=2.0 * math.pi) for row in (values, slopes)]
    np.testing.assert_allclose(evaluate_boundary(values, slopes, 0.7, theta), expected, atol=1e-9)
