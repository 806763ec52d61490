"""Predicted places of discs: straight, and off a wall."""

import numpy as np

from drake_starnav.tracking.prediction import PREDICTION_STEP, predicted_trajectories

NOTHING = np.zeros((0, 2))
WALL = np.column_stack((np.full(200, 2.0), np.linspace(-5.0, 5.0, 200)))


def one(velocity: tuple[float, float], *, walls: np.ndarray = NOTHING) -> np.ndarray:
    return predicted_trajectories(np.zeros((1, 2)), np.array([velocity]), np.array([0.3]), walls)[0]


def test_it_lasts_as_long_as_asked_and_begins_now() -> None:
    trajectory = one((0.5, 0.0))
    assert (len(trajectory) - 1) * PREDICTION_STEP >= 3.0
    np.testing.assert_array_equal(trajectory[0], (0.0, 0.0))


def test_it_is_straight() -> None:
    trajectory = one((0.3, 0.4))
    times = PREDICTION_STEP * np.arange(len(trajectory))
    np.testing.assert_allclose(trajectory, times[:, None] * (0.3, 0.4))


def test_it_comes_back_from_a_wall() -> None:
    trajectory = one((0.8, 0.2), walls=WALL)
    assert trajectory[:, 0].max() <= 2.0 - 0.3 + 0.8 * PREDICTION_STEP
    assert trajectory[-1, 0] < trajectory[:, 0].max() - 0.3
    np.testing.assert_allclose(np.diff(trajectory[:, 1]), 0.2 * PREDICTION_STEP, atol=0.015)
