"""Twists that follow the poses of a manoeuvre."""

import math

import numpy as np
import pytest

from drake_starnav.geometry.footprint import disc
from drake_starnav.manoeuvres.following import follow_manoeuvre
from drake_starnav.manoeuvres.manoeuvre import count_reached
from drake_starnav.robot import BASES, RobotParameters
from drake_starnav.robot.motion import Actuation, Pose, Velocity, advance_pose
from drake_starnav.safety.shield import ramp_twist

BASE = BASES["differential"]
ROBOT = RobotParameters()
LIMITS = ROBOT.limits
PERIOD = 0.02
LEGS = tuple((x, -0.2, 0.0, 1.0) for x in (-0.1, 0.1, 0.3, 0.38, 0.4))
THREE_POINT = np.array(((0.0, 0.0, 0.6, 0.0), (-0.3, -0.2, 0.6, -1.0), (-0.3, -0.2, 0.0, 0.0), *LEGS))


def advanced(pose: Pose, twist: np.ndarray, poses: np.ndarray) -> tuple[Pose, np.ndarray]:
    """Pose and twist after a period of following poses."""
    target = follow_manoeuvre(np.array(pose), poses, ROBOT)[0]
    twist = ramp_twist(twist, target, Actuation(LIMITS, disc(0.2), PERIOD, 0.0))
    steady = Velocity(twist[0], 0.0, twist[1])
    return advance_pose(pose, steady, steady, PERIOD, LIMITS)[0], twist


@pytest.mark.parametrize("start", [(0.0, 0.0, 0.0), (0.01, -0.01, 0.05)])
def test_a_robot_reaches_all_poses_of_a_manoeuvre(start):
    """And is slow enough at the last one to stop there, however short the last legs are."""
    pose, twist, poses = Pose(*start), np.zeros(2), THREE_POINT
    for _ in range(1500):
        poses = poses[count_reached(np.array(pose), poses, BASE, ROBOT.radius) :]
        if not len(poses):
            break
        pose, twist = advanced(pose, twist, poses)
    assert not len(poses)
    assert math.hypot(pose.x - 0.4, pose.y + 0.2) < 0.04 and abs(twist[0]) < 0.2
    assert abs(pose.yaw) < 0.1


@pytest.mark.parametrize("gear", [1.0, -1.0])
@pytest.mark.parametrize(("length", "turn"), [(0.03, 0.06), (0.06, -0.2), (0.12, 0.26)])
def test_a_robot_follows_the_arcs_of_a_manoeuvre(length: float, turn: float, gear: float) -> None:
    """Its heading has turned as far as it has come, from rest on."""
    pose, twist = Pose(0.0, 0.0, 0.0), np.zeros(2)
    x, y = gear * length * math.cos(0.5 * turn), gear * length * math.sin(0.5 * turn)
    poses = np.array(((x, y, turn, gear),))
    while not count_reached(np.array(pose), poses, BASE, 0.4):
        pose, twist = advanced(pose, twist, poses)
    assert abs(pose.yaw - turn) < 0.5 * abs(turn) and math.dist(pose[:2], (x, y)) < 0.02
