"""The modulation around discs that move has the properties that define it."""

import math

import numpy as np
from hypothesis import given
from hypothesis import strategies as st

from drake_starnav.moving.modulation import modulate_around_movers
from tests.helpers.scans import unit

numbers = st.floats(-2.0, 2.0)
vectors = st.tuples(numbers, numbers).map(np.array)
angles = st.floats(-math.pi, math.pi)
radii = st.floats(0.2, 1.0)


def around_one(position: np.ndarray, velocity: np.ndarray, moves: np.ndarray, radius: float) -> np.ndarray:
    return modulate_around_movers(position, velocity, np.zeros((1, 2)), moves[None], np.array([radius]))


@given(angle=angles, velocity=vectors, moves=vectors, radius=radii, beside=vectors)
def test_on_a_rim_nothing_leads_into_the_disc_whatever_is_beside_it(angle, velocity, moves, radius, beside) -> None:
    normal = unit(angle)
    centers = np.array(((0.0, 0.0), (2.0 * radius + 2.0) * normal))
    modulated = modulate_around_movers(
        radius * normal, velocity, centers, np.array((moves, beside)), np.array((radius, radius))
    )
    assert (modulated - moves) @ normal > -1e-6


@given(angle=angles, velocity=vectors, radius=radii, away=st.floats(1.05, 5.0))
def test_around_a_disc_that_stands_it_is_the_static_modulation(angle, velocity, radius, away) -> None:
    gamma = away**2
    basis = np.column_stack((unit(angle), unit(angle + 0.5 * math.pi)))
    inward = velocity @ basis[:, 0] < 0.0
    matrix = basis @ np.diag((1.0 - 1.0 / gamma if inward else 1.0, 1.0 + 1.0 / gamma)) @ np.linalg.inv(basis)
    found = around_one(away * radius * unit(angle), velocity, np.zeros(2), radius)
    np.testing.assert_allclose(found, matrix @ velocity, atol=1e-9)


@given(angle=angles, velocity=vectors, moves=vectors, radius=radii)
def test_far_away_and_without_discs_nothing_changes(angle, velocity, moves, radius) -> None:
    np.testing.assert_allclose(around_one(500.0 * unit(angle), velocity, moves, radius), velocity, atol=1e-4)
    nothing = np.zeros((0, 2))
    around = modulate_around_movers(np.zeros(2), velocity, nothing, nothing, np.zeros(0))
    np.testing.assert_array_equal(around, velocity)
