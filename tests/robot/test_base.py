"""What holds for every base."""

import math

import numpy as np
import pytest

from drake_starnav.geometry.footprint import disc
from drake_starnav.robot import BASES, RobotParameters
from drake_starnav.robot.base import convert_to_twist
from drake_starnav.robot.limits import find_velocity_towards
from drake_starnav.robot.motion import Actuation, roll_out

ROBOTS = {name: RobotParameters(base=name) for name in BASES}


@pytest.mark.parametrize("name", BASES)
def test_twists_are_cut_off_at_the_limits_and_nan_stays(name):
    robot, rng = ROBOTS[name], np.random.default_rng(1)
    for _ in range(50):
        twist = rng.uniform(-9.0, 9.0, len(robot.drive.components))
        cut = robot.drive.saturate(twist, robot.limits)
        assert math.hypot(*cut[:-1]) <= robot.limits.max_speed + 1e-12
        assert abs(cut[-1]) <= robot.limits.max_yaw_rate
        np.testing.assert_allclose(robot.drive.saturate(cut, robot.limits), cut)
    assert np.isnan(robot.drive.saturate(np.full(len(robot.drive.components), np.nan), robot.limits)).all()


@pytest.mark.parametrize("name", BASES)
def test_proposals_begin_with_what_is_desired_and_stay_within_the_limits(name):
    robot = ROBOTS[name]
    desired = convert_to_twist(find_velocity_towards(0.4, 0.6, robot.limits), robot.drive)
    proposals = list(robot.drive.proposals(desired, robot.limits))
    np.testing.assert_allclose(proposals[0], desired)
    for proposal in proposals:
        np.testing.assert_allclose(robot.drive.saturate(proposal, robot.limits), proposal, atol=1e-9)


@pytest.mark.parametrize("name", BASES)
def test_the_law_comes_nearer_to_what_lies_ahead(name):
    robot = ROBOTS[name]
    for error in (-1.0, -0.2, 0.0, 0.2, 1.0):
        twist = convert_to_twist(find_velocity_towards(error, robot.max_speed, robot.limits), robot.drive)
        actuation = Actuation(robot.limits, disc(0.2), 0.5, 0.0, robot.drive)
        motion = roll_out(np.zeros(3), np.zeros(len(twist)), twist, actuation)
        x, y = motion.position[-1]
        assert x * math.cos(error) + y * math.sin(error) > 0.02


@pytest.mark.parametrize("name", BASES)
def test_moves_are_those_of_the_base(name):
    moves = ROBOTS[name].motion_primitives
    turning, driving = moves[moves[:, 4] == 0.0], moves[moves[:, 4] != 0.0]
    assert (len(turning) > 0) == ROBOTS[name].drive.turns_on_the_spot
    assert (abs(driving[:, 1]) > 1e-9).any() == ROBOTS[name].drive.holonomic
    assert (moves[:, 3] > 0.0).all()
