"""What holds for every base, and how each heads for a direction."""

import math

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from drake_starnav.robot import BASES, RobotParameters
from drake_starnav.robot.base import convert_to_twist
from drake_starnav.robot.limits import find_velocity_towards, wrap_angle

ROBOTS = {name: RobotParameters(base=name) for name in BASES}


def twist_towards(name: str, error: float, speed: float) -> np.ndarray:
    """The twist of a base that shall drive in a direction, rad off its heading, at a speed."""
    robot = ROBOTS[name]
    return convert_to_twist(find_velocity_towards(error, speed, robot.limits), robot.drive)


@given(st.floats(-50.0, 50.0))
def test_a_wrapped_angle_is_the_same_direction(angle: float) -> None:
    wrapped = wrap_angle(angle)
    assert -math.pi <= wrapped < math.pi + 1e-12
    assert math.cos(wrapped - angle) == pytest.approx(1.0)


@pytest.mark.parametrize("name", BASES)
def test_twists_are_cut_off_at_the_limits_in_their_direction_and_nan_stays(name):
    robot, rng = ROBOTS[name], np.random.default_rng(1)
    for _ in range(50):
        twist = rng.uniform(-9.0, 9.0, len(robot.drive.components))
        cut = robot.drive.saturate(twist, robot.limits)
        share = min(robot.limits.max_speed / math.hypot(*twist[:-1]), 1.0)
        np.testing.assert_allclose(cut[:-1], share * twist[:-1])
        assert cut[-1] == np.clip(twist[-1], -robot.limits.max_yaw_rate, robot.limits.max_yaw_rate)
    assert np.isnan(robot.drive.saturate(np.full(len(robot.drive.components), np.nan), robot.limits)).all()


@pytest.mark.parametrize("name", BASES)
def test_proposals_begin_with_what_is_desired_and_stay_within_the_limits(name):
    robot, desired = ROBOTS[name], twist_towards(name, 0.4, 0.6)
    proposals = list(robot.drive.proposals(desired, robot.limits))
    np.testing.assert_allclose(proposals[0], desired)
    for proposal in proposals:
        np.testing.assert_allclose(robot.drive.saturate(proposal, robot.limits), proposal, atol=1e-9)


@pytest.mark.parametrize("name", BASES)
def test_moves_are_those_of_the_base(name):
    moves = ROBOTS[name].motion_primitives
    turning, driving = moves[moves[:, 4] == 0.0], moves[moves[:, 4] != 0.0]
    assert (len(turning) > 0) == ROBOTS[name].drive.turns_on_the_spot
    assert (abs(driving[:, 1]) > 1e-9).any() == ROBOTS[name].drive.holonomic
    assert (moves[:, 3] > 0.0).all()


@given(st.floats(-math.pi, math.pi), st.floats(0.0, 0.8), st.floats(0.2, 8.0))
def test_a_differential_drive_turns_to_a_heading_before_it_drives_and_can_stop_turning_there(
    error, speed, most
) -> None:
    limits = ROBOTS["differential"].limits._replace(max_yaw_acceleration=most)
    v, aside, omega = find_velocity_towards(error, speed, limits)
    assert omega * error > 0.0 or abs(error) < 1e-9
    assert abs(omega) <= limits.max_yaw_rate
    assert omega**2 <= 2.0 * most * abs(error) * (1.0 + 1e-12)
    assert 0.0 <= v <= speed and aside == 0.0
    assert v < 1e-12 or abs(error) < 0.5 * math.pi


@given(st.floats(-math.pi, math.pi), st.floats(0.0, 0.8))
def test_an_omnidirectional_base_drives_at_once_in_any_direction(error: float, speed: float) -> None:
    x, y, omega = twist_towards("omnidirectional", error, speed)
    assert (x, y) == pytest.approx((speed * math.cos(error), speed * math.sin(error)))
    assert omega == pytest.approx(np.clip(2.0 * math.remainder(error, math.pi), -2.0, 2.0), abs=1e-9)


@given(st.floats(-math.pi, math.pi))
def test_a_car_steers_towards_a_direction(error: float) -> None:
    v, bend = twist_towards("car", error, 0.8)
    assert v > 0.0 and abs(bend) <= ROBOTS["car"].limits.max_yaw_rate
    assert bend * error > 0.0 or abs(error) < 1e-9


@pytest.mark.parametrize("least_radius", [0.02, 0.5, 3.0, 40.0])
@pytest.mark.parametrize("radius", [0.05, 0.5, 3.0])
def test_manoeuvres_of_a_car_are_circles_that_it_can_drive_and_almost_the_least_one(radius, least_radius):
    """With some curvature left to follow them, and no longer than the robot."""
    robot = RobotParameters(base="car", least_radius=least_radius, radius=radius, max_speed=0.05)
    length, turn = robot.motion_primitives[:, 0], abs(robot.motion_primitives[:, 2])
    circles = abs(length[turn > 0.0]) / turn[turn > 0.0]
    assert circles.min() == pytest.approx(1.0 / (0.6 * robot.limits.max_yaw_rate))
    assert abs(length).max() < 0.5 * radius and turn.max() < 0.5
