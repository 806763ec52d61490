"""Polylines keep their shape with fewer or more points."""

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from hypothesis.extra.numpy import arrays

from drake_starnav.geometry.polyline import (
    compute_third_side,
    measure_arc_lengths,
    measure_segment_distance,
    resample_polyline,
    simplify_polyline,
    subdivide_polyline,
)

LINES = st.integers(1, 30).flatmap(lambda n: arrays(float, (n, 2), elements=st.floats(-10.0, 10.0, width=32)))


def distance_to_line(points: np.ndarray, line: np.ndarray) -> np.ndarray:
    return np.min([measure_segment_distance(points, a, b) for a, b in zip(line, line[1:], strict=False)], axis=0)


@given(LINES, st.floats(0.0, 3.0))
def test_omitted_points_lie_near_the_simplified_polyline(points: np.ndarray, tolerance: float) -> None:
    left = simplify_polyline(points, tolerance)
    assert (left[0] == points[0]).all() and (left[-1] == points[-1]).all()
    if len(points) > 1:
        assert distance_to_line(points, left).max() <= tolerance + 1e-9


def test_a_straight_line_keeps_its_ends_and_a_corner_its_point() -> None:
    x = np.linspace(0.0, 1.0, 50)
    assert simplify_polyline(np.column_stack((x, 2.0 * x)), 1e-9).tolist() == [[0.0, 0.0], [1.0, 2.0]]
    there_and_back = np.column_stack((np.concatenate((x, x[::-1])), np.zeros(100)))
    assert simplify_polyline(there_and_back, 0.01).tolist() == [[0.0, 0.0], [1.0, 0.0], [0.0, 0.0]]


def test_a_circle_needs_as_many_chords_as_its_sagitta_asks_for() -> None:
    angle = np.linspace(0.0, 2.0 * np.pi, 5000)
    chords = len(simplify_polyline(np.column_stack((np.cos(angle), np.sin(angle))), 0.02)) - 1
    fewest = np.pi / np.arccos(1.0 - 0.02)
    assert fewest <= chords <= 2.0 * fewest


@pytest.mark.parametrize(("step", "count"), [(0.5, 7), (3.0, 2), (0.4, 9), (10.0, 2)])
def test_resampled_points_are_even(step: float, count: int) -> None:
    points = resample_polyline(np.array([(0.0, 0.0), (1.0, 0.0), (1.0, 2.0)]), step)
    assert len(points) == count
    along = np.linspace(0.0, 3.0, count)
    np.testing.assert_allclose(points, np.column_stack((np.minimum(along, 1.0), np.maximum(along - 1.0, 0.0))))


@pytest.mark.parametrize(("step", "count"), [(0.5, 9), (0.3, 12), (3.0, 3)])
def test_subdivided_polylines_keep_their_corners(step: float, count: int) -> None:
    corners = np.array([(0.0, 0.0), (1.0, 0.0), (1.0, 2.0)])
    points = subdivide_polyline(corners, step)
    assert len(points) == count and np.hypot(*np.diff(points, axis=0).T).max() <= step
    assert all((points == corner).all(axis=1).any() for corner in corners)
    assert measure_arc_lengths(points)[-1] == pytest.approx(3.0)


def test_arc_lengths_are_those_up_to_each_point() -> None:
    assert measure_arc_lengths(np.array([(0.0, 0.0), (3.0, 4.0), (3.0, 5.0)])).tolist() == [0.0, 5.0, 6.0]
    assert measure_arc_lengths(np.ones((1, 2))).tolist() == [0.0]


def test_a_chord_is_the_distance_between_the_ends_of_two_beams():
    assert compute_third_side(3.0, 4.0, 0.0) == pytest.approx(5.0)
    assert compute_third_side(2.0, 2.0, 1.0) == 0.0
    assert compute_third_side(1.0, 2.0, -1.0) == pytest.approx(3.0)
