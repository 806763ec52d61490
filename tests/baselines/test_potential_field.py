import math

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from drake_starnav.baselines import potential_field
from drake_starnav.baselines.potential_field import INFLUENCE_DISTANCE, PotentialFieldParameters
from drake_starnav.errors import StarnavError
from tests.helpers.arrays import taking_lists

potential_field_velocity = taking_lists(potential_field.potential_field_velocity)
PARAMETERS = PotentialFieldParameters(repulsive_gain=0.01, max_speed=0.8)
RADIUS = 0.25


def velocity(goal, points, parameters=PARAMETERS, position=(0.0, 0.0)):
    return potential_field_velocity(position, goal, points, robot_radius=RADIUS, parameters=parameters)


def test_far_from_hits_it_heads_for_the_goal():
    np.testing.assert_allclose(velocity([3.0, 4.0], [[1.0, 1.5], [-2.0, 0.0]]), [0.48, 0.64])
    np.testing.assert_allclose(velocity([0.1, -0.2], np.zeros((0, 2))), [0.1, -0.2])


def test_repels_as_khatib_s_potential_does():
    free = PotentialFieldParameters(max_speed=10.0)
    rho, eta, influence = 0.4, free.repulsive_gain, INFLUENCE_DISTANCE

    def potential(x):
        return 0.5 * eta * (1.0 / (x - RADIUS) - 1.0 / influence) ** 2

    step = 1e-6
    slope = (potential(rho + RADIUS + step) - potential(rho + RADIUS - step)) / (2.0 * step)
    found = velocity([0.0, 0.0], [[-(rho + RADIUS), 0.0]], free)
    np.testing.assert_allclose(found, [-slope, 0.0], rtol=1e-6, atol=1e-12)


def test_does_not_depend_on_the_resolution_and_cancels_between_walls():
    y = np.linspace(-2.0, 2.0, 401)
    wall = np.column_stack((np.full(401, 0.6), y))
    np.testing.assert_allclose(velocity([0.0, 3.0], wall), velocity([0.0, 3.0], wall[::2]), atol=1e-3)
    corridor = np.vstack((wall, wall * (-1.0, 1.0)))
    np.testing.assert_allclose(velocity([0.0, 3.0], corridor), [0.0, 0.8], atol=1e-12)


@given(st.integers(0, 2**32 - 1), st.floats(-math.pi, math.pi))
def test_turns_with_the_scene_and_keeps_the_speed_limit(seed, angle):
    rng = np.random.default_rng(seed)
    points, goal = rng.uniform(-2.0, 2.0, (10, 2)), rng.uniform(-5.0, 5.0, 2)
    turn = np.array([[math.cos(angle), -math.sin(angle)], [math.sin(angle), math.cos(angle)]])
    found = velocity(goal, points)
    np.testing.assert_allclose(velocity(turn @ goal, points @ turn.T), turn @ found, atol=1e-6)
    assert math.hypot(*found) <= PARAMETERS.max_speed + 1e-12


@pytest.mark.parametrize("points", [[[0.0, 0.0]], [[RADIUS, 0.0]], [[0.1, 0.0], [-0.1, 0.0]]])
def test_finite_in_the_singular_places(points):
    found = velocity([1.0, 0.0], points)
    assert np.isfinite(found).all()


def test_moves_away_from_a_hit_under_the_hull():
    assert velocity([1.0, 0.0], [[0.2, 0.0]])[0] == pytest.approx(-PARAMETERS.max_speed)


def test_bad_parameters_are_refused_when_they_are_made():
    with pytest.raises(StarnavError, match=r"apf.max_speed is -1.0; allowed: 0 < x <= 10 m/s"):
        PotentialFieldParameters(max_speed=-1.0)
