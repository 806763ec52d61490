"""Poses between logged poses."""

import math

import numpy as np
import pytest

from drake_starnav.geometry.footprint import disc
from drake_starnav.geometry.trajectory import Motion, least_gaps

MOTION = Motion(np.array([1.0, 2.0, 4.0]), np.array([(0.0, 0.0, 3.0), (1.0, -1.0, -3.0), (1.0, 3.0, -3.0)]))


def test_logged_poses_are_met_and_others_lie_between() -> None:
    assert MOTION.at(2.0)[:2] == pytest.approx([1.0, -1.0])
    assert MOTION.at(1.5)[:2] == pytest.approx([0.5, -0.5])
    assert MOTION.at(3.0)[:2] == pytest.approx([1.0, 1.0])
    assert MOTION.duration == 4.0


def test_the_robot_turns_the_short_way_across_pi() -> None:
    assert math.cos(MOTION.at(1.5)[2]) == pytest.approx(-1.0)


def test_before_and_after_it_stands() -> None:
    assert np.array_equal(MOTION.at(0.0), MOTION.poses[0])
    assert MOTION.at(9.0)[:2] == pytest.approx(MOTION.poses[-1, :2])


def test_gaps_are_between_footprints() -> None:
    still, times = np.zeros((2, 3)), np.array([0.0, 1.0])
    passing = np.array([(2.0, 1.0, 0.0), (-2.0, 1.0, 0.0)])
    far = np.full((2, 3), (0.0, -5.0, 0.0))
    footprints = [disc(0.25), disc(0.25), disc(0.5)]
    gaps = least_gaps(footprints, [Motion(times, poses) for poses in (still, passing, far)])
    assert gaps == pytest.approx([0.5, 0.5, 4.25], abs=0.02)
