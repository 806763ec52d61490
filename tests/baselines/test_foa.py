import math

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from drake_starnav.baselines import foa
from tests.helpers.arrays import taking_lists
from tests.helpers.reference_vectors import COUNT, RESULTS, TOLERANCE, reference_case

foa_velocity = taking_lists(foa.foa_velocity)
foa_cluster_velocity = taking_lists(foa.foa_cluster_velocity)
BOTH = pytest.mark.parametrize("function", [foa_velocity, foa_cluster_velocity])
ANGLE = st.floats(-math.pi, math.pi)
SEED = st.integers(0, 2**32 - 1)
RADIUS = 0.2


def rotation(angle):
    return np.array([[math.cos(angle), -math.sin(angle)], [math.sin(angle), math.cos(angle)]])


def scan(seed, circles=4):
    """The near sides of a few circles, none of which covers the robot at the origin."""
    rng = np.random.default_rng(seed)
    bearing = rng.uniform(-math.pi, math.pi, circles)
    radius = rng.uniform(0.1, 0.5, circles)
    distance = rng.uniform(0.05, 3.0, circles) + radius + RADIUS
    angle = bearing[:, None] + math.pi + np.linspace(-1.2, 1.2, 20)
    x = distance[:, None] * np.cos(bearing)[:, None] + radius[:, None] * np.cos(angle)
    y = distance[:, None] * np.sin(bearing)[:, None] + radius[:, None] * np.sin(angle)
    return np.column_stack((x.ravel(), y.ravel()))


@BOTH
def test_far_from_hits_the_nominal_velocity_returns(function):
    points = np.array([1e5, 2e4]) + scan(0)
    np.testing.assert_allclose(function([0.0, 0.0], [0.6, 0.3], points, control_radius=RADIUS), [0.6, 0.3], atol=1e-3)
    np.testing.assert_array_equal(function([0.0, 0.0], [0.6, 0.3], np.zeros((0, 2)), control_radius=RADIUS), [0.6, 0.3])


@BOTH
@settings(max_examples=40, deadline=None)
@given(SEED, ANGLE, ANGLE)
def test_turns_with_the_scene(function, seed, heading, angle):
    points, turn = scan(seed), rotation(angle)
    velocity = np.array((math.cos(heading), math.sin(heading)))
    found = function([0.0, 0.0], velocity, points, control_radius=RADIUS)
    # The shift is a translation as well: only positions relative to the robot matter.
    shift = np.array((3.0, -2.0))
    turned = function(shift, turn @ velocity, shift + points @ turn.T, control_radius=RADIUS)
    np.testing.assert_allclose(turned, turn @ found, atol=1e-6)


@settings(max_examples=40, deadline=None)
@given(SEED, ANGLE)
def test_sampled_form_keeps_a_velocity_that_leads_away_and_the_speed_of_others(seed, heading):
    points = scan(seed, circles=1)
    velocity = np.array((math.cos(heading), math.sin(heading)))
    found = foa_velocity([0.0, 0.0], velocity, points, control_radius=RADIUS)
    assert math.hypot(*found) <= 1.0 + 1e-12
    if velocity @ points.mean(axis=0) < 0.0 and (points @ velocity).max() <= 0.0:
        np.testing.assert_array_equal(found, velocity)


def test_turns_aside_of_an_obstacle_ahead():
    points = np.column_stack((np.full(20, 0.5), np.linspace(-0.3, 0.2, 20)))
    for function in (foa_velocity, foa_cluster_velocity):
        found = function([0.0, 0.0], [1.0, 0.0], points, control_radius=RADIUS)
        assert found[1] > 0.5 * math.hypot(*found)  # the wall reaches farther to the right


def test_exactly_head_on_the_sampled_form_heads_on():
    found = foa_velocity([0.0, 0.0], [1.0, 0.0], [[0.6, 0.4], [0.6, -0.4]], control_radius=RADIUS)
    np.testing.assert_allclose(found, [1.0, 0.0], atol=1e-12)


@pytest.mark.parametrize("speed", [1.2, 1.3, 3.0])
def test_clustered_form_is_finite_at_any_speed(speed):
    points = np.column_stack((np.full(20, 0.5), np.linspace(-0.3, 0.2, 20)))
    found = foa_cluster_velocity([0.0, 0.0], [speed, 0.0], points, control_radius=RADIUS)
    assert np.isfinite(found).all()
    if speed > 1.3:  # approach speeds beyond 1.25 m/s stop the robot instead of returning NaN
        np.testing.assert_array_equal(found, [0.0, 0.0])


@BOTH
@pytest.mark.parametrize(
    "points",
    [
        [[0.0, 0.0]],
        [[0.0, 0.0], [0.0, 0.0], [0.0, 0.0], [0.5, 0.0]],
        [[0.05, 0.0], [0.0, 0.05], [-0.05, 0.0], [0.0, -0.05]],  # inside the robot, on all sides
        [[0.3, 0.0], [-0.3, 0.0]],  # directions cancel
        [[0.5, 0.0], [2.0, 2.0], [-3.0, 1.0]],  # no cluster at all
    ],
)
@pytest.mark.parametrize("velocity", [(0.0, 0.0), (1.0, 0.0), (-0.3, 0.2)])
def test_finite_in_the_singular_places(function, points, velocity):
    assert np.isfinite(function([0.0, 0.0], velocity, points, control_radius=RADIUS)).all()


def test_hits_in_no_cluster_are_avoided():
    found = foa_cluster_velocity([0.0, 0.0], [1.0, 0.0], [[0.4, -0.05]], control_radius=RADIUS)
    assert found[1] > 0.0


@pytest.mark.parametrize("k", range(COUNT))
def test_it_returns_what_the_authors_implementation_returns(k):
    c = reference_case(k)
    found = foa_velocity(*c["start"], c["points"], control_radius=c["radius"])
    np.testing.assert_allclose(found, RESULTS["foa_sampled"][k], rtol=0.0, atol=TOLERANCE)
    found = foa_cluster_velocity(*c["start"], c["points"], control_radius=c["radius"])
    np.testing.assert_allclose(found, RESULTS["foa_cluster"][k], rtol=0.0, atol=TOLERANCE)
