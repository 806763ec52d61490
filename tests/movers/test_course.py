"""Foreseen places of discs: straight, round a bend, and off a wall."""

import math

import numpy as np

from drake_starnav.movers.course import COURSE_STEP, courses

NOTHING = np.zeros((0, 2))
WALL = np.column_stack((np.full(200, 2.0), np.linspace(-5.0, 5.0, 200)))


def one(velocity: tuple[float, float], *, turn: float = 0.0, walls: np.ndarray = NOTHING) -> np.ndarray:
    return courses(np.zeros((1, 2)), np.array([velocity]), np.array([turn]), np.array([0.3]), walls, 3.0)[0]


def test_it_lasts_as_long_as_asked_and_begins_now() -> None:
    course = one((0.5, 0.0))
    assert (len(course) - 1) * COURSE_STEP >= 3.0
    np.testing.assert_array_equal(course[0], (0.0, 0.0))


def test_without_a_turn_it_is_straight() -> None:
    course = one((0.3, 0.4))
    times = COURSE_STEP * np.arange(len(course))
    np.testing.assert_allclose(course, times[:, None] * (0.3, 0.4))


def test_a_turn_goes_on_for_a_while_at_the_same_speed() -> None:
    course = one((0.5, 0.0), turn=0.8)
    steps = np.diff(course, axis=0)
    np.testing.assert_allclose(np.hypot(*steps.T), 0.5 * COURSE_STEP)
    headings = np.unwrap(np.arctan2(steps[:, 1], steps[:, 0]))
    assert (np.diff(headings) > 0.0).all()
    assert 0.6 < headings[-1] < 1.0  # of the turn that would have been 2.4 rad, what decays in a second
    assert math.isclose(headings[0], 0.8 * COURSE_STEP)


def test_it_comes_back_from_a_wall() -> None:
    course = one((0.8, 0.2), walls=WALL)
    assert course[:, 0].max() <= 2.0 - 0.3 + 0.8 * COURSE_STEP
    assert course[-1, 0] < course[:, 0].max() - 0.3
    np.testing.assert_allclose(np.diff(course[:, 1]), 0.2 * COURSE_STEP, atol=0.015)
