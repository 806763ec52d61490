"""Tight passages are found on the path, with their axis, and only where the robot must be aligned."""

import math

import numpy as np
import pytest

from drake_starnav.geometry.footprint import footprint
from drake_starnav.geometry.se2 import composed, placed
from drake_starnav.planning.passage import tight_passage

SHAPE = footprint(((0.254, -0.215), (0.254, 0.215), (-0.254, 0.215), (-0.254, -0.215)))
PATH = np.array(((2.0, 0.0),))


def door(gap: float) -> np.ndarray:
    """Hits on a wall at x = 0.8 with a gap."""
    side = np.arange(0.5 * gap, 1.5, 0.03)
    y = np.concatenate((side, -side))
    return np.column_stack((np.full(len(y), 0.8), y))


@pytest.mark.parametrize("frame", [np.zeros(3), np.array((3.0, -1.0, 2.2))])
def test_a_tight_door_is_found_with_its_axis(frame):
    pose, path, hits = composed(frame, (0.0, 0.1, 0.0)), placed(frame, PATH), placed(frame, door(0.52))
    passage = tight_passage(pose, path, hits, SHAPE, 0.0145)
    assert passage is not None
    assert passage.width == pytest.approx(0.52)
    np.testing.assert_allclose((passage.x, passage.y), composed(frame, (0.8, 0.0, 0.0))[:2], atol=1e-9)
    assert math.remainder(passage.yaw - frame[2], 2.0 * math.pi) == pytest.approx(0.0, abs=1e-9)
    assert passage.along(pose) == pytest.approx(-0.8)
    assert passage.aside(pose) == pytest.approx(0.1)
    np.testing.assert_allclose(passage.at(0.3), composed(frame, (1.1, 0.0, 0.0))[:2], atol=1e-9)


@pytest.mark.parametrize("gap", [0.44, 0.6, 1.2])
def test_doors_that_are_too_narrow_or_wide_are_not_tight(gap):
    assert tight_passage(np.zeros(3), PATH, door(gap), SHAPE, 0.0145) is None


def test_a_passage_is_left_once_the_robot_is_through():
    hits = door(0.52)
    assert tight_passage(np.array((1.0, 0.0, 0.0)), PATH, hits, SHAPE, 0.0145) is not None
    assert tight_passage(np.array((1.1, 0.0, 0.0)), PATH, hits, SHAPE, 0.0145) is None


def test_without_a_path_or_hits_there_is_none():
    assert tight_passage(np.zeros(3), np.zeros((0, 2)), door(0.5), SHAPE, 0.0145) is None
    assert tight_passage(np.zeros(3), PATH, np.zeros((0, 2)), SHAPE, 0.0145) is None
