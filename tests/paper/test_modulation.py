"""The paper's equations of control, each against an independent evaluation."""

import math

import numpy as np
import pytest
from hypothesis import given, settings

from drake_starnav.control import ControllerInputs
from drake_starnav.control.modulation import evaluate_boundary
from drake_starnav.lidar.laser_scan import LaserScan
from drake_starnav.paper import choices, control
from drake_starnav.paper.blend import (
    Nearest,
    combine_vectors,
    compute_blend_share,
    compute_vector_along,
    compute_vector_along_and_away,
    find_nearest_hit,
    smooth_distances,
)
from drake_starnav.paper.modulation import compute_boundary_tangent, compute_weights, modulate_vector
from drake_starnav.paper.pid import turn_towards
from drake_starnav.planning.guidance import Guidance
from drake_starnav.robot import RobotParameters
from drake_starnav.robot.limits import HEADING_GAIN
from drake_starnav.surroundings.star_region import unite_regions
from drake_starnav.surroundings.surroundings import Surroundings
from tests.helpers.scans import RADIUS, seeds, smooth_region, unit


def modulation_matrix(region, point: np.ndarray, sigma: float) -> tuple[np.ndarray, float]:
    """M = E D E^-1 and Gamma by the region's boundary, as it is sampled, and NumPy's inverse."""
    offset, stack = point - region.center, unite_regions([region])
    theta, distance = math.atan2(offset[1], offset[0]), np.hypot(*offset)
    phi, slope = evaluate_boundary(stack.values[0], stack.slopes[0], stack.bearing_0[0], theta)
    gamma = (phi / distance) ** sigma
    tangent = slope * unit(theta) + phi * unit(theta + 0.5 * math.pi)
    basis = np.column_stack((offset / distance, tangent / np.hypot(*tangent)))
    return basis @ np.diag((1.0 - 1.0 / gamma, 1.0 + 1.0 / gamma)) @ np.linalg.inv(basis), gamma


@settings(max_examples=200)
@given(seeds)
def test_overlapping_regions_are_summed_with_the_weights_of_the_paper(seed):
    rng = np.random.default_rng(seed)
    regions = [smooth_region(rng, rng.uniform(-0.8, 0.8, 2)) for _ in range(3)]
    point, guide = rng.uniform(-0.5, 0.5, 2), rng.uniform(-3.0, 3.0, 2)
    matrices = [modulation_matrix(region, point, choices.SIGMA) for region in regions]
    if any(gamma > 1e4 or abs(gamma - 1.0) < 1e-6 for _, gamma in matrices):
        return  # next to a reference point the weight is without bound, and on a boundary the sum jumps
    inside = [(matrix, max(gamma, 1.0)) for matrix, gamma in matrices if gamma > 1.0]
    weights = sum(weight for _, weight in inside)
    expected = sum(weight / weights * matrix @ guide for matrix, weight in inside) if inside else guide
    found = modulate_vector(point, guide, unite_regions(regions))
    np.testing.assert_allclose(found, expected, rtol=1e-6, atol=1e-6)


def test_at_its_reference_point_a_region_does_not_modulate():
    region = smooth_region(np.random.default_rng(3), np.array((0.4, -0.2)))
    found = modulate_vector(region.center, np.array((1.5, 0.5)), unite_regions([region]))
    np.testing.assert_allclose(found, (1.5, 0.5), rtol=1e-9)


@pytest.mark.parametrize("clearance", [-0.1, 0.01, 0.02, 0.05, 0.15, 0.4, 2.0])
def test_the_nearest_point_term_blends_by_rho_over_clearance(clearance):
    outward, guide, vector = unit(0.4), unit(0.7), 1.7 * unit(0.9)
    nearest = find_nearest_hit(np.zeros(2), np.array([5.0 * unit(2.0), (RADIUS + clearance) * outward]), RADIUS)
    np.testing.assert_allclose(nearest.away, -outward)
    share, fade = min(choices.RHO / max(clearance, choices.RHO), 1.0), min(max(clearance, 0.0) / choices.RHO, 1.0)
    along_and_away = 1.7 * (fade * unit(0.4 + 0.5 * math.pi) - choices.PUSH * outward)
    found = combine_vectors(vector, guide, nearest)
    np.testing.assert_allclose(found, (1.0 - share) * vector + share * along_and_away, atol=1e-12)


def test_noise_does_not_draw_the_nearest_hit_nearer_than_it_is():
    """The nearest of raw ranges is the one with the largest error of all that face the robot."""
    raw = 0.23 + 0.01 * np.random.default_rng(0).standard_normal((20, 360))
    scans = [LaserScan(0.0, -math.pi, math.radians(1.0), 0.12, 3.5, ranges) for ranges in raw]
    error = 0.23 - np.mean([smooth_distances(scan).min() for scan in scans])
    assert error < 0.6 * (0.23 - raw.min(axis=1).mean())


@pytest.mark.parametrize("clearance", [-0.05, 0.002, 0.05, 1.0])
def test_the_robot_can_stop_within_its_clearance_and_creeps_without_one(clearance):
    limits = RobotParameters().limits
    v = turn_towards(unit(0.0), 0.0, clearance, limits).v_x
    assert choices.CREEP <= v <= choices.SPEED
    assert v == choices.CREEP or v**2 <= 2.0 * limits.max_acceleration * clearance
    assert v > 0.8 * min(choices.SPEED, math.sqrt(2.0 * limits.max_acceleration * max(clearance - 0.01, 0.0)))


@pytest.mark.parametrize("heading", [-2.0, -0.3, 0.0, 0.4])
@pytest.mark.parametrize("length", [0.3, 3.0])
def test_the_robot_turns_towards_the_vector_at_a_constant_speed_in_the_open(heading, length):
    robot = RobotParameters(max_yaw_rate=20.0, max_yaw_acceleration=200.0)
    guidance = Guidance.along(length * unit(heading)[None, :])
    v, omega = control(ControllerInputs(np.zeros(3), np.zeros(2), guidance, Surroundings.unknown()), robot).twist
    assert v == pytest.approx(choices.SPEED * max(math.cos(heading), 0.0) ** 3)
    assert omega == pytest.approx(HEADING_GAIN * heading)


def test_the_readings_of_the_nearest_vector_lead_along_it_and_away():
    nearest, guide = Nearest(np.array((-1.0, 0.0)), 1.0), np.array((2.0, 1.0))
    np.testing.assert_allclose(compute_vector_along(nearest, 0.5 * guide, guide), (0.0, math.hypot(1.0, 0.5)))
    both = compute_vector_along_and_away(nearest, 0.5 * guide, guide)
    np.testing.assert_allclose(both, (-choices.PUSH * math.hypot(1.0, 0.5), math.hypot(1.0, 0.5)))


def test_weights_add_up_and_none_is_less_than_that_of_a_boundary():
    np.testing.assert_allclose(compute_weights(np.array((0.5, 1.0, 2.0))), (0.25, 0.25, 0.5))
    assert compute_blend_share(-0.1) == compute_blend_share(choices.RHO) == 1.0


def test_the_tangent_is_that_of_the_boundary():
    phi = lambda theta: 2.0 + 0.3 * np.sin(3.0 * theta)  # noqa: E731
    for theta in (-2.5, -0.4, 0.9, 2.2):
        step = phi(theta + 1e-6) * unit(theta + 1e-6) - phi(theta - 1e-6) * unit(theta - 1e-6)
        expected = step / np.hypot(*step)
        found = compute_boundary_tangent(theta, phi(theta), 0.9 * math.cos(3.0 * theta))
        np.testing.assert_allclose(found, expected, atol=1e-6)


def test_an_empty_path_stops_the_robot():
    inputs = ControllerInputs(np.zeros(3), np.zeros(2), Guidance.none(), Surroundings.unknown())
    found = control(inputs, RobotParameters())
    assert not found.twist.any() and not found.guiding_vector.any()
