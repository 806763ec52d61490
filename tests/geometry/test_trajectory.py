"""Poses between logged poses."""

import math

import numpy as np
import pytest

from drake_starnav.geometry.trajectory import Motion

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
