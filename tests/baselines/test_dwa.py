import math

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from drake_starnav.baselines import dwa
from drake_starnav.baselines.dwa import PERIOD, DwaBaseline
from drake_starnav.robot import RobotParameters
from tests.helpers.arrays import taking_lists
from tests.helpers.scenes import moved

dwa_twist = taking_lists(dwa.choose_dwa_twist)
ROBOT = RobotParameters()
MARGIN = DwaBaseline.margin
NOTHING = np.zeros((0, 2))


def stopping_path(pose, v, omega):
    """Positions on the arc of (v, omega), held for a period and then braked to a stop, shape (k, 2)."""
    stop_time = max(v / ROBOT.max_acceleration, abs(omega) / ROBOT.max_yaw_acceleration)
    times = np.linspace(0.0, PERIOD + 0.5 * stop_time, 400)  # as if at full speed: the same way
    headings = pose[2] + omega * times
    steps = np.diff(times)[:, None] * v
    middle = 0.5 * (headings[1:] + headings[:-1])
    way = np.cumsum(steps * np.column_stack((np.cos(middle), np.sin(middle))), axis=0)
    return np.vstack((pose[:2], pose[:2] + way))


@settings(max_examples=150, deadline=None)
@given(st.integers(0, 2**32 - 1))
def test_the_chosen_arc_is_admissible_and_in_the_window(seed):
    rng = np.random.default_rng(seed)
    pose = rng.uniform((-1.0, -1.0, -math.pi), (1.0, 1.0, math.pi))
    twist = np.array((rng.uniform(0.0, ROBOT.max_speed), rng.uniform(-ROBOT.max_yaw_rate, ROBOT.max_yaw_rate)))
    radius = ROBOT.radius + MARGIN
    points = rng.uniform(-2.5, 2.5, (rng.integers(1, 40), 2))
    points = points[np.hypot(*(points - pose[:2]).T) > radius]
    v, omega = dwa_twist(pose, twist, rng.uniform(-5.0, 5.0, 2), points, ROBOT, MARGIN)

    assert 0.0 <= v <= ROBOT.max_speed and abs(omega) <= ROBOT.max_yaw_rate
    assert abs(v - twist[0]) <= ROBOT.max_acceleration * PERIOD + 1e-9
    assert abs(omega - twist[1]) <= ROBOT.max_yaw_acceleration * PERIOD + 1e-9
    path = stopping_path(pose, v, omega)
    clearance = np.hypot(*(path[:, None] - points).transpose(2, 0, 1)).min(initial=math.inf)
    braking = max(twist[0] / ROBOT.max_acceleration, abs(twist[1]) / ROBOT.max_yaw_acceleration)
    kept = max(0.0, 1.0 - PERIOD / braking)
    assert clearance >= radius - 1e-4 or (v, omega) == pytest.approx(tuple(kept * twist), abs=1e-12)


def test_brakes_in_front_of_a_wall_and_then_only_turns():
    wall = np.column_stack((np.full(101, 0.5), np.linspace(-1.0, 1.0, 101)))
    v, _ = dwa_twist([0.0, 0.0, 0.0], [0.8, 0.0], [5.0, 0.0], wall, ROBOT, MARGIN)
    assert v == pytest.approx(0.8 - ROBOT.max_acceleration * PERIOD)  # nothing is admissible: full braking
    wall[:, 0] = ROBOT.radius + MARGIN + 1e-3
    v, _ = dwa_twist([0.0, 0.0, 0.0], [0.0, 0.0], [5.0, 0.0], wall, ROBOT, MARGIN)
    assert v == pytest.approx(0.0)


def test_a_point_under_the_hull_can_be_left_but_not_approached():
    twist, ahead = [0.0, 0.0], [5.0, 0.0]
    assert dwa_twist([0.0, 0.0, 0.0], twist, ahead, [[-0.2, 0.0]], ROBOT, MARGIN)[0] > 0.0
    assert dwa_twist([0.0, 0.0, 0.0], twist, ahead, [[0.2, 0.0]], ROBOT, MARGIN)[0] == 0.0


def test_can_stop_at_the_goal():
    pose, twist = np.zeros(3), np.zeros(2)
    for _ in range(200):
        twist = np.array(dwa_twist(pose, twist, [2.0, 1.0], NOTHING, ROBOT, MARGIN))
        pose = moved(pose, twist, PERIOD)
        if math.hypot(pose[0] - 2.0, pose[1] - 1.0) < 0.1:
            break
    assert math.hypot(pose[0] - 2.0, pose[1] - 1.0) < 0.1
    assert twist[0] <= 0.6
