"""One period of each baseline: towards the goal within the limits, and around what stands in the way."""

import math

import numpy as np
import pytest

from drake_starnav.baselines.baseline_step import BaselineInput, step_baseline
from drake_starnav.baselines.dsm_circles import DsmBaseline
from drake_starnav.baselines.dwa import DwaBaseline
from drake_starnav.baselines.foa import FoaBaseline
from drake_starnav.baselines.known_obstacles import KnownObstacles, make_known_obstacles
from drake_starnav.robot import RobotParameters
from tests.helpers.motions import PERIOD, limited_twist
from tests.helpers.scenes import moved

ROBOT = RobotParameters()
SETTINGS = {"dsm": DsmBaseline(), "foa": FoaBaseline(), "foa_cluster": FoaBaseline(clusters=True), "dwa": DwaBaseline()}
POST = np.array([(2.0, 0.05, 0.3)])
EVERY = pytest.mark.parametrize("settings", SETTINGS.values(), ids=list(SETTINGS))


def hits(position: np.ndarray) -> np.ndarray:
    """The side of the post that can be seen, 40 points."""
    towards = math.atan2(*(position - POST[0, :2])[::-1])
    angle = towards + np.linspace(-1.3, 1.3, 40)
    return POST[0, :2] + POST[0, 2] * np.column_stack((np.cos(angle), np.sin(angle)))


def drive(settings, goal, *, target=None, post=False, seconds=12.0, pose=(0.0, 0.0, 0.0)):
    """Twists and poses of a robot that follows every twist."""
    pose, twist = np.array(pose, dtype=float), np.zeros(2)
    obstacles = make_known_obstacles(POST, None, ROBOT.radius) if post else KnownObstacles.none()
    twists, poses = [twist], [pose]
    for _ in range(round(seconds / PERIOD)):
        points = hits(pose[:2]) if post else np.zeros((0, 2))
        aim = np.array(goal if target is None else target)
        inputs = BaselineInput(pose, twist, aim, np.array(goal), points, obstacles, ROBOT)
        desired, direction = step_baseline(inputs, settings)
        twist = limited_twist(twist, desired, ROBOT, PERIOD)
        assert np.hypot(*direction) == pytest.approx(1.0) or not direction.any()
        pose = moved(pose, twist, PERIOD)
        twists.append(twist)
        poses.append(pose)
    return np.array(twists), np.array(poses)


@EVERY
@pytest.mark.parametrize("goal", [(3.0, 0.0), (-2.0, 1.0), (0.5, -2.0)])
def test_reaches_the_goal_in_the_open_within_the_limits(settings, goal) -> None:
    twists, poses = drive(settings, goal, seconds=15.0)
    assert np.hypot(*(poses[-1, :2] - goal)) < 0.3
    assert twists[:, 0].min() >= 0.0
    assert twists[:, 0].max() <= ROBOT.max_speed + 1e-12
    assert np.abs(twists[:, 1]).max() <= ROBOT.max_yaw_rate + 1e-12
    change = np.abs(np.diff(twists, axis=0)).max(axis=0)
    assert change[0] <= ROBOT.max_acceleration * PERIOD + 1e-9
    assert change[1] <= ROBOT.max_yaw_acceleration * PERIOD + 1e-9


@EVERY
def test_heads_for_the_target_where_it_is_another_than_the_goal(settings) -> None:
    _, poses = drive(settings, (4.0, 0.0), target=(0.0, 3.0), seconds=3.0, pose=(0.0, 0.0, 0.5 * math.pi))
    assert poses[-1, 1] > 0.5
    assert abs(poses[-1, 0]) < 0.01


@EVERY
def test_stands_at_its_target(settings) -> None:
    """The planner's short-term goal is the robot's own position until the first search."""
    twists, _ = drive(settings, (4.0, 0.0), target=(0.0, 0.0), seconds=0.5)
    assert not twists[:, 0].any()


@pytest.mark.parametrize("name", ["dsm", "foa", "foa_cluster"])
def test_is_no_faster_than_told(name) -> None:
    settings = type(SETTINGS[name])(max_speed=0.3)
    twists, _ = drive(settings, (6.0, 0.0), post=True, seconds=15.0)
    assert 0.29 < twists[:, 0].max() <= 0.3 + 1e-12
