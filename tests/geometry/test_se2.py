"""Poses and points transformed between frames."""

import math

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from drake_starnav.geometry.se2 import compose_poses, find_pose_in_frame, invert_pose, transform_points

poses = st.tuples(st.floats(-9.0, 9.0), st.floats(-9.0, 9.0), st.floats(-3.1, 3.1)).map(np.array)


@given(poses, poses)
def test_a_pose_seen_from_another_is_that_pose(frame, pose):
    found = compose_poses(frame, find_pose_in_frame(frame, pose))
    np.testing.assert_allclose(found[:2], pose[:2], atol=1e-9)
    assert math.remainder(found[2] - pose[2], 2.0 * math.pi) == pytest.approx(0.0, abs=1e-9)


@given(poses, poses)
def test_points_are_placed_as_poses_are(frame, pose):
    assert np.array_equal(transform_points(frame, pose[None, :2])[0], compose_poses(frame, pose)[:2])


@given(poses, poses)
def test_the_inverse_leads_back(frame, pose):
    np.testing.assert_allclose(compose_poses(invert_pose(frame), compose_poses(frame, pose))[:2], pose[:2], atol=1e-9)
