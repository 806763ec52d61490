"""Commands on their way move the robot as they were sent."""

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from drake_starnav.control.delay_compensation import commands_in_delay, predicted_pose

PERIOD = 0.02
ORIGIN = np.zeros(3)


@pytest.mark.parametrize("delay, count", [(0.0, 0), (0.001, 1), (0.02, 1), (0.021, 2), (0.05, 3), (0.06, 3)])
def test_how_many_commands_are_on_their_way(delay, count):
    assert commands_in_delay(delay, PERIOD) == count


def test_without_delay_the_robot_is_where_it_is():
    pose = np.array((1.0, 2.0, 3.0))
    assert np.array_equal(predicted_pose(pose, np.zeros((0, 2)), 0.0, PERIOD), pose)


def test_of_the_oldest_command_only_the_rest_counts():
    twists = np.array([(1.0, 0.0), (0.5, 0.0), (0.25, 0.0)])
    assert predicted_pose(ORIGIN, twists, 0.05, PERIOD) == pytest.approx([0.01 * 1.0 + 0.02 * 0.75, 0.0, 0.0])


@given(st.lists(st.tuples(st.floats(-1.0, 1.0), st.floats(-3.0, 3.0)), min_size=1, max_size=6), st.floats(-3.0, 3.0))
def test_prediction_integrates_the_twists(twists, yaw):
    delay = PERIOD * len(twists)
    pose, step = np.array((0.3, -0.2, yaw)), PERIOD / 200
    for v, omega in twists:
        for _ in range(200):
            middle = pose[2] + 0.5 * omega * step
            pose = pose + step * np.array((v * np.cos(middle), v * np.sin(middle), omega))
    found = predicted_pose(np.array((0.3, -0.2, yaw)), np.array(twists), delay, PERIOD)
    np.testing.assert_allclose(found, pose, atol=1e-7)
