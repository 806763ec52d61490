import math

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from drake_starnav.baselines import dsm_circles
from drake_starnav.baselines.dsm_circles import directional_mean
from tests.helpers.arrays import taking_lists
from tests.helpers.reference_vectors import COUNT, RESULTS, TOLERANCE, reference_case


def mean_angle(degrees, weights):
    angles = np.radians(degrees)
    x, y = directional_mean(np.array((1.0, 0.0)), np.column_stack((np.cos(angles), np.sin(angles))), np.array(weights))
    return math.degrees(math.atan2(y, x))


@pytest.mark.parametrize(
    ("degrees", "weights", "mean"),
    [
        ([30.0, 60.0], [0.5, 0.5], 45.0),
        ([-170.0, 170.0], [0.5, 0.5], 0.0),  # angles about the reference, not the shorter way round
        ([120.0, -60.0], [0.75, 0.25], 75.0),  # opposed vectors still have a mean
        ([180.0, 0.0], [0.5, 0.5], 90.0),
        ([33.0, 99.0], [1.0, 0.0], 33.0),
    ],
)
def test_mean_of_angles(degrees, weights, mean):
    assert mean_angle(degrees, weights) == pytest.approx(mean)


def test_a_vanished_vector_leaves_its_weight_to_the_reference():
    vectors = np.array([(0.0, 0.0), (0.0, 1.0)])
    x, y = directional_mean(np.array((1.0, 0.0)), vectors, np.array([0.5, 0.5]))
    assert math.atan2(y, x) == pytest.approx(math.pi / 4.0)


dsm_velocity = taking_lists(dsm_circles.dsm_velocity)
ANGLE = st.floats(-math.pi, math.pi)
SEED = st.integers(0, 2**32 - 1)


def scene(seed):
    rng = np.random.default_rng(seed)
    circles = np.column_stack((rng.uniform(-3.0, 3.0, (6, 2)), rng.uniform(0.1, 0.5, 6)))
    return rng.uniform(-3.0, 3.0, 2), rng.normal(size=2), circles


@given(ANGLE, ANGLE, st.floats(0.0, 0.1))
def test_no_motion_into_a_circle_at_its_surface(where, heading, depth):
    # Just inside the inflated circle too: there the part into it vanishes as well.
    circles = np.array([(0.4, -0.2, 0.3), (3.0, 3.0, 0.5)])
    outward = np.array((math.cos(where), math.sin(where)))
    position = circles[0, :2] + (0.5 - 1e-12 - depth) * outward
    velocity = np.array((math.cos(heading), math.sin(heading)))
    found = dsm_velocity(position, velocity, circles, robot_radius=0.2)
    assert found @ outward >= -1e-9


@pytest.mark.parametrize("position", [(0.0, 0.0), (0.1, 0.0), (0.5, 0.0)])
@pytest.mark.parametrize("velocity", [(0.0, 0.0), (-1.0, 0.0), (1.0, 0.0)])
def test_finite_in_the_singular_places(position, velocity):
    circles = np.array([(0.0, 0.0, 0.3), (0.0, 0.0, 0.3), (1.0, 0.0, 0.3)])
    assert np.isfinite(dsm_velocity(position, velocity, circles, robot_radius=0.2)).all()


@given(SEED, ANGLE, st.floats(0.0, 0.9))
def test_no_motion_into_a_circle_with_another_reference_point(seed, where, share):
    rng = np.random.default_rng(seed)
    circle = np.array([(*rng.uniform(-1.0, 1.0, 2), 0.3)])
    reference = circle[:, :2] + share * 0.5 * np.array([(math.cos(where), math.sin(where))])
    outward = np.array((math.cos(0.7), math.sin(0.7)))
    found = dsm_velocity(
        circle[0, :2] + (0.5 + 1e-12) * outward,
        rng.normal(size=2),
        circle,
        robot_radius=0.2,
        reference_points=reference,
    )
    assert found @ outward >= -1e-9


@given(SEED)
def test_the_centre_is_the_reference_point_by_default(seed):
    position, velocity, circles = scene(seed)
    found = dsm_velocity(position, velocity, circles, robot_radius=0.2, reference_points=circles[:, :2])
    np.testing.assert_array_equal(found, dsm_velocity(position, velocity, circles, robot_radius=0.2))


@pytest.mark.parametrize("k", range(COUNT))
def test_it_returns_what_the_authors_implementation_returns(k):
    c = reference_case(k)
    found = dsm_velocity(*c["start"], c["circles"], robot_radius=c["radius"])
    np.testing.assert_allclose(found, RESULTS["dsm_tail_off"][k], rtol=0.0, atol=TOLERANCE)
