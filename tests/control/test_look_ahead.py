"""The look-ahead point, against the clearance of its line by plain NumPy."""

import numpy as np
import pytest
from hypothesis import given, settings

from drake_starnav.control.look_ahead import CLEAR, CORNER_CUT, SPACING, look_ahead
from tests.helpers.scans import seeds, segment_distance

LEAST, DISTANCE = 0.009, 1.5
NO_HITS, NEEDED = np.zeros((0, 2)), np.zeros(0)


def needed(hits: np.ndarray) -> np.ndarray:
    return np.full(len(hits), 0.25)


def test_nothing_near_lets_it_see_as_far_as_asked():
    path = np.array(((1.0, 0.0), (4.0, 0.0)))
    point, clearance, last = look_ahead(np.zeros(2), path, NO_HITS, NEEDED, DISTANCE, LEAST)
    np.testing.assert_allclose(point, (DISTANCE, 0.0), atol=SPACING)
    assert clearance == np.inf and not last


def test_the_end_of_the_path_is_reported():
    point, _, last = look_ahead(np.zeros(2), np.array(((0.5, 0.2),)), NO_HITS, NEEDED, DISTANCE, LEAST)
    np.testing.assert_allclose(point, (0.5, 0.2))
    assert last


def test_a_corner_is_not_cut_closer_than_the_path_passes_it():
    path = np.array(((0.6, 0.0), (0.6, 0.8)))
    corner = np.array(((0.22, 0.45),))  # 0.38 m from the second leg
    point, clearance, _ = look_ahead(np.zeros(2), path, corner, needed(corner), DISTANCE, LEAST)
    assert CLEAR <= clearance <= 0.13
    assert 0.0 < point[1] < 0.8, "past the corner, but not to the end"


@settings(max_examples=60)
@given(seeds)
def test_the_point_is_on_the_path_and_its_line_keeps_what_it_must(seed):
    rng = np.random.default_rng(seed)
    path = np.cumsum(rng.uniform(-0.3, 0.5, (8, 2)), axis=0)
    hits = rng.uniform(-1.0, 2.0, (12, 2))
    hits = np.vstack((hits[np.hypot(*hits.T) > 0.3], (2.0, 2.0)))
    point, clearance, _ = look_ahead(np.zeros(2), path, hits, needed(hits), DISTANCE, LEAST)
    samples = sampled(path)
    number = int(np.argmin(np.hypot(*(samples - point).T)))
    np.testing.assert_allclose(samples[number], point, atol=1e-9)
    if number > 2:  # nearer points are the last resort where no line is clear
        on_path = np.hypot(*np.moveaxis(samples[: number + 1, None] - hits, -1, 0)).min() - 0.25
        line = segment_distance(hits, np.zeros(2), point).min() - 0.25
        assert min(line, CLEAR) == pytest.approx(min(clearance, CLEAR), abs=1e-9)
        assert line >= min(CLEAR, max(on_path - CORNER_CUT, LEAST)) - 1e-9
        assert np.hypot(*point) <= DISTANCE + 1e-9


def sampled(path: np.ndarray) -> np.ndarray:
    """Points of a path from the origin at most SPACING apart."""
    legs = zip(np.vstack((np.zeros(2), path)), path, strict=False)
    counts = [(a, b, max(int(np.ceil(np.hypot(*(b - a)) / SPACING)), 1)) for a, b in legs]
    return np.vstack([a + (b - a) * (np.arange(1, n + 1) / n)[:, None] for a, b, n in counts])
