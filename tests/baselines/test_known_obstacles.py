"""Circles that DSM is told of: walls among them, and reference points that overlapping ones share."""

import math

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from drake_starnav.baselines import dsm_circles
from drake_starnav.baselines.known_obstacles import make_known_obstacles
from tests.helpers.arrays import taking_lists

dsm_velocity = taking_lists(dsm_circles.compute_dsm_velocity)
RADIUS = 0.25


def test_circles_apart_keep_their_centres() -> None:
    discs = np.array([(0.0, 0.0, 0.5), (1.6, 0.0, 0.5), (0.0, 2.0, 0.3)])
    known = make_known_obstacles(discs, None, RADIUS)
    np.testing.assert_array_equal(known.circles, discs)
    np.testing.assert_array_equal(known.reference_points, discs[:, :2])


def test_two_that_overlap_share_the_middle_of_the_overlap() -> None:
    known = make_known_obstacles(np.array([(0.0, 0.0, 0.5), (1.2, 0.0, 0.3)]), None, RADIUS)
    middle = 0.5 * (1.2 - 0.55 + 0.75)  # between the left rim of the right one and the right rim of the left one
    np.testing.assert_allclose(known.reference_points, [(middle, 0.0), (middle, 0.0)])


@given(st.integers(0, 2**32 - 1))
def test_every_reference_point_lies_in_its_circle(seed) -> None:
    rng = np.random.default_rng(seed)
    discs = np.column_stack((rng.uniform(-2.0, 2.0, (12, 2)), rng.uniform(0.1, 0.6, 12)))
    known = make_known_obstacles(discs, (-2.5, -2.5, 2.5, 2.5), RADIUS)
    distance = np.hypot(*(known.reference_points - known.circles[:, :2]).T)
    assert (distance < known.circles[:, 2] + RADIUS).all()


def test_walls_are_straight_and_the_free_side_is_inside() -> None:
    known = make_known_obstacles(np.zeros((0, 3)), (-4.0, -3.0, 5.0, 3.0), RADIUS)
    for x, y in ((-4.0, -2.9), (-4.0, 2.9), (5.0, 2.9), (0.0, -3.0), (-3.9, 3.0)):
        depths = known.circles[:, 2] - np.hypot(x - known.circles[:, 0], y - known.circles[:, 1])
        assert depths.max() == pytest.approx(0.0, abs=1e-3)
    inside = np.hypot(*known.circles[:, :2].T) - known.circles[:, 2]
    assert (inside > 2.0).all()


def test_a_circle_at_a_wall_parts_the_flow_in_the_wall() -> None:
    """The robot cannot pass between them: every flow goes round the free side."""
    known = make_known_obstacles(np.array([(0.0, 2.4, 0.5)]), (-4.0, -3.0, 4.0, 3.0), RADIUS)
    assert known.reference_points[0] == pytest.approx([0.0, 0.5 * (2.4 + 0.75 + 2.75)], abs=1e-3)
    np.testing.assert_array_equal(known.reference_points[1:], known.circles[1:, :2])


def end_and_clearance(y: float) -> tuple[np.ndarray, float]:
    """Where a point that follows DSM along x ends that meets two overlapping circles, and its least clearance."""
    discs = np.array([(0.0, 0.5, 0.3), (0.0, -0.5, 0.3)])
    references = make_known_obstacles(discs, None, RADIUS).reference_points
    position, nearest = np.array([-2.0, y]), math.inf
    for _ in range(2400):
        velocity = dsm_velocity(position, [0.5, 0.0], discs, robot_radius=RADIUS, reference_points=references)
        position = position + 0.005 * velocity
        nearest = min(nearest, (np.hypot(*(position - discs[:, :2]).T) - discs[:, 2]).min() - RADIUS)
    return position, nearest


@pytest.mark.parametrize("y", [-0.5, -0.1, 0.1, 0.5])
def test_a_shared_reference_point_leads_around_both(y) -> None:
    position, nearest = end_and_clearance(y)
    assert position[0] > 1.0
    assert nearest > 0.0
