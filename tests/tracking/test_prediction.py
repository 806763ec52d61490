"""Foreseen places of discs: straight, and off a wall."""

import numpy as np

from drake_starnav.tracking.prediction import COURSE_STEP, courses

NOTHING = np.zeros((0, 2))
WALL = np.column_stack((np.full(200, 2.0), np.linspace(-5.0, 5.0, 200)))


def one(velocity: tuple[float, float], *, walls: np.ndarray = NOTHING) -> np.ndarray:
    return courses(np.zeros((1, 2)), np.array([velocity]), np.array([0.3]), walls, 3.0)[0]


def test_it_lasts_as_long_as_asked_and_begins_now() -> None:
    course = one((0.5, 0.0))
    assert (len(course) - 1) * COURSE_STEP >= 3.0
    np.testing.assert_array_equal(course[0], (0.0, 0.0))


def test_it_is_straight() -> None:
    course = one((0.3, 0.4))
    times = COURSE_STEP * np.arange(len(course))
    np.testing.assert_allclose(course, times[:, None] * (0.3, 0.4))


def test_it_comes_back_from_a_wall() -> None:
    course = one((0.8, 0.2), walls=WALL)
    assert course[:, 0].max() <= 2.0 - 0.3 + 0.8 * COURSE_STEP
    assert course[-1, 0] < course[:, 0].max() - 0.3
    np.testing.assert_allclose(np.diff(course[:, 1]), 0.2 * COURSE_STEP, atol=0.015)
