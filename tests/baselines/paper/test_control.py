"""The paper's own equations, each against an independent evaluation."""

import math

import numpy as np
import pytest
from hypothesis import example, given, settings

from drake_starnav.baselines.paper.control import RHO, control_step, modulated_direction, nearest_point_direction
from drake_starnav.control import ControllerParameters
from drake_starnav.control.law import ControlInput
from drake_starnav.control.modulation import SIGMA, boundary_at
from drake_starnav.planning.guidance import Guidance
from drake_starnav.regions.safe_region import SafetyStar
from drake_starnav.regions.star_region import RegionStack
from drake_starnav.robot import RobotParameters
from tests.helpers.scans import RADIUS, seeds, smooth_region


def unit(angle: float) -> np.ndarray:
    return np.array((math.cos(angle), math.sin(angle)))


def modulation_matrix(region, point: np.ndarray, sigma: float) -> tuple[np.ndarray, float]:
    """M = E D E^-1 and Gamma by the region's boundary, as it is sampled, and NumPy's inverse."""
    offset, stack = point - region.center, RegionStack.of([region])
    theta, distance = math.atan2(offset[1], offset[0]), np.hypot(*offset)
    phi, slope = boundary_at(stack.values[0], stack.slopes[0], stack.bearing_0[0], theta)
    gamma = (phi / distance) ** sigma
    tangent = slope * unit(theta) + phi * unit(theta + 0.5 * math.pi)
    basis = np.column_stack((offset / distance, tangent / np.hypot(*tangent)))
    return basis @ np.diag((1.0 - 1.0 / gamma, 1.0 + 1.0 / gamma)) @ np.linalg.inv(basis), gamma


@settings(max_examples=200)
@given(seeds)
@example(467)
def test_overlapping_regions_are_summed_with_the_papers_weights(seed):
    rng = np.random.default_rng(seed)
    regions = [smooth_region(rng, rng.uniform(-0.8, 0.8, 2)) for _ in range(3)]
    point, guide = rng.uniform(-0.5, 0.5, 2), unit(rng.uniform(-math.pi, math.pi))
    total, weights = np.zeros(2), 0.0
    for region in regions:
        matrix, gamma = modulation_matrix(region, point, SIGMA)
        if np.hypot(*(point - region.center)) < 0.05:
            return  # next to a reference point the paper's weight is without bound
        if abs(gamma - 1.0) < 0.01:
            return  # on a boundary the sum jumps
        if gamma > 1.0:
            total, weights = total + max(gamma, 1.0) * matrix @ guide, weights + max(gamma, 1.0)
    expected = total / np.hypot(*total) if weights else guide
    found = modulated_direction(*point, *guide, RegionStack.of(regions).with_slopes)
    np.testing.assert_allclose(found, expected, atol=1e-6)


@pytest.mark.parametrize("clearance", [0.02, 0.1, 0.15, 0.4, 2.0])
def test_the_nearest_point_term_blends_by_rho_over_clearance(clearance):
    outward, direction = unit(0.4), unit(0.9)
    hits = np.array([(RADIUS + clearance) * outward, 5.0 * unit(2.0)])
    share = min(RHO / clearance, 1.0)
    blend = (1.0 - share) * direction - share * outward
    found = nearest_point_direction(np.zeros(2), direction, hits, RADIUS)
    np.testing.assert_allclose(found, blend / np.hypot(*blend), atol=1e-12)


def test_inside_the_robots_radius_the_nearest_point_counts_alone():
    hits = np.array([(0.5 * RADIUS, 0.0)])
    found = nearest_point_direction(np.zeros(2), unit(0.1), hits, RADIUS)
    np.testing.assert_allclose(found, (-1.0, 0.0))


@pytest.mark.parametrize("heading", [-2.0, -0.3, 0.0, 0.4, 3.0])
def test_the_pid_follows_its_formula(heading):
    parameters = ControllerParameters(kind="star_paper", rate=40.0)
    robot = RobotParameters(
        max_speed=10.0, max_yaw_rate=20.0, max_acceleration=50.0, max_yaw_acceleration=200.0
    )  # so that the limits do not show
    twist, errors = np.array((0.2, 0.0)), np.array((0.7, heading))
    guidance = Guidance(3.0 * unit(heading)[None, :], False, RegionStack.of(()))
    now = ControlInput(np.zeros(3), twist, errors, guidance, SafetyStar.none())
    command = control_step(now, parameters, robot)
    error = np.array((min(1.0, 0.5 / max(abs(heading), 1e-6)) - 0.2, heading))
    rate = 40.0 * (error - errors)
    wanted = np.array((0.5 * error[0] + 0.05 * rate[0], 2.0 * error[1] + 0.05 * rate[1]))
    limit = np.array((50.0, 200.0)) / 40.0
    np.testing.assert_allclose(command.twist, twist + np.clip(wanted - twist, -limit, limit), atol=1e-9)
    np.testing.assert_allclose(command.errors, error)


def test_an_empty_path_and_the_goal_stop_the_robot():
    for path in (np.zeros((0, 2)), np.array([(0.01, 0.0)])):
        now = ControlInput(np.zeros(3), np.zeros(2), np.zeros(2), Guidance.along(path), SafetyStar.none())
        command = control_step(now, ControllerParameters(kind="star_paper"), RobotParameters())
        assert not command.twist.any() and not command.guiding_vector.any() and not command.certified
