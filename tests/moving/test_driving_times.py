"""Times of legs, turns and whole paths against plain computations."""

import math

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from drake_starnav.moving.driving_times import (
    compute_heading_loss,
    compute_time_to_go,
    compute_times_along,
    compute_turning_time,
    find_next_way_point,
    full_speed,
)
from drake_starnav.planning.guidance import PASSED_DISTANCE
from drake_starnav.robot import Limits
from drake_starnav.robot.motion import Pose, Velocity
from tests.helpers.scans import seeds

LIMITS = Limits(0.8, 2.0, 1.0, 1.0, 4.0)
SLOW = Limits(1.3, 1.1, 0.6, 0.6, 2.5)


def to_go(
    line: np.ndarray, way_point: int, pose: tuple[float, float, float], velocity: Velocity, limits: Limits
) -> float:
    """The time to go from a pose, at a velocity."""
    return compute_time_to_go(line, compute_times_along(line, limits), way_point, Pose(*pose), velocity, limits)


LINE = np.array(((0.0, 0.0), (1.0, 0.0), (1.0, 1.0), (2.0, 1.0)))


def test_the_next_way_point_is_in_sight_beyond_the_backward_extension_of_its_leg() -> None:
    assert find_next_way_point(LINE, 1, 0.5, 0.0, 0.25) == 1
    assert find_next_way_point(LINE, 1, 1.0, 0.0, 0.25) == 2
    assert find_next_way_point(LINE, 3, 2.0, 1.0, 0.25) == 3  # the last one stays


@given(seeds, st.floats(0.2, 2.5), st.sampled_from([-1.0, 1.0]))
def test_at_a_bend_the_next_leg_is_taken_where_its_line_is_crossed_or_the_bend_is_near(seed, turn, side) -> None:
    """The obstacle lies on the inner side of the bend: from beyond the next leg's line its end is in view."""
    rng = np.random.default_rng(seed)
    yaw, corner = rng.uniform(-math.pi, math.pi), rng.uniform(-3.0, 3.0, 2)
    before, leg = (np.array((math.cos(a), math.sin(a))) for a in (yaw, yaw + side * turn))
    line = np.array((corner - rng.uniform(1.0, 2.0) * before, corner, corner + rng.uniform(1.0, 2.0) * leg))
    outwards = side * np.array((leg[1], -leg[0]))
    place = corner + rng.uniform(0.01, 0.5) * rng.choice([-1.0, 1.0]) * outwards + rng.uniform(-0.5, 0.5) * leg
    passed = (place - corner) @ outwards > 0.0 or math.dist(place, corner) < PASSED_DISTANCE * 0.25
    assert find_next_way_point(line, 1, *place, 0.25) == (2 if passed else 1)


def test_all_way_points_that_are_near_are_passed_at_once() -> None:
    close = np.array(((0.0, 0.0), (1.0, 0.0), (1.0, 0.03), (0.96, 0.03), (0.0, 0.03)))
    assert find_next_way_point(close, 1, 0.99, 0.001, 0.25) == 4
    straight = np.array(((0.0, 0.0), (1.0, 0.0), (2.0, 0.0)))
    assert [find_next_way_point(straight, 1, 1.0 + away, 0.0, 0.25) for away in (-0.061, -0.059, 0.059, 0.061)] == [
        1,
        2,
        2,
        1,
    ]


def fastest_turn(angle: float, rate: float, limits: Limits) -> float:
    """`compute_turning_time` step by step: towards where it would stop too soon, or too late, then brake, s."""
    step, turned, omega, time = 2e-4, 0.0, rate, 0.0
    most, change = limits.max_yaw_rate, limits.max_yaw_acceleration * step
    sign = 1.0 if rate * abs(rate) / (2.0 * limits.max_yaw_acceleration) < angle else -1.0
    while sign * (turned + omega * abs(omega) / (2.0 * limits.max_yaw_acceleration) - angle) < 0.0:
        after = min(max(omega + sign * change, -most), most)
        turned, omega, time = turned + 0.5 * (omega + after) * step, after, time + step
    return time + abs(omega) / limits.max_yaw_acceleration


@pytest.mark.parametrize("limits", [LIMITS, SLOW])
@pytest.mark.parametrize("angle", [0.02, 0.1, 0.7, 3.0])
@pytest.mark.parametrize("rate", [-1.0, -0.2, 0.0, 0.6, 1.1])
def test_the_turning_time_is_that_of_the_fastest_turn(angle: float, rate: float, limits: Limits) -> None:
    most = limits.max_yaw_rate, limits.max_yaw_acceleration
    assert compute_turning_time(angle, rate, most) == pytest.approx(fastest_turn(angle, rate, limits), abs=2e-3)
    assert compute_turning_time(-angle, -rate, most) == compute_turning_time(angle, rate, most)


@given(st.floats(-math.pi, math.pi), st.floats(0.0, 0.8), st.floats(-2.0, 2.0))
def test_no_heading_gains_time(error: float, v: float, omega: float) -> None:
    assert compute_heading_loss(error, Velocity(v, 0.0, omega), LIMITS) >= 0.0
    assert compute_heading_loss(0.0, full_speed(LIMITS), LIMITS) == 0.0


@pytest.mark.parametrize("limits", [LIMITS, SLOW])
@pytest.mark.parametrize(("error", "v", "omega"), [(0.0, 0.0, 0.0), (0.0, 0.3, 0.5), (0.5, 0.6, -0.4), (2.5, 0.7, 0.1)])
def test_the_time_lost_is_that_of_the_turn_and_of_getting_up_to_speed(error, v, omega, limits: Limits) -> None:
    along, lost, step = v * math.cos(error), 0.0, 1e-4
    while along < limits.max_speed:
        lost += (1.0 - along / limits.max_speed) * step
        along += limits.max_acceleration * step
    assert compute_heading_loss(error, Velocity(v, 0.0, omega), limits) == pytest.approx(
        compute_turning_time(error, omega, (limits.max_yaw_rate, limits.max_yaw_acceleration)) + lost, abs=1e-3
    )


@given(seeds, st.integers(2, 6), st.sampled_from([LIMITS, SLOW]))
def test_the_time_left_is_that_of_the_legs_and_of_the_bends_between_them(seed, count, limits: Limits) -> None:
    rng = np.random.default_rng(seed)
    line = np.cumsum(rng.uniform(-1.5, 1.5, (count, 2)), axis=0)
    legs = np.diff(line, axis=0)
    headings, lengths = np.arctan2(legs[:, 1], legs[:, 0]), np.hypot(*legs.T)
    bends = [
        compute_heading_loss((b + math.pi) % (2.0 * math.pi) - math.pi, full_speed(limits), limits)
        for b in np.diff(headings)
    ]
    left = compute_times_along(line, limits)
    for k in range(1, count):
        assert left[k] == pytest.approx(lengths[k:].sum() / limits.max_speed + sum(bends[k:]))
    yaw, moves = rng.uniform(-9.0, 9.0), Velocity(rng.uniform(0.0, limits.max_speed), 0.0, rng.uniform(-1.0, 1.0))
    for k in range(1, count):
        place = line[k] - rng.uniform(-1.0, 1.0, 2)
        way = line[k] - place
        off = (math.atan2(way[1], way[0]) - yaw + math.pi) % (2.0 * math.pi) - math.pi
        expected = math.hypot(*way) / limits.max_speed + compute_heading_loss(off, moves, limits) + left[k]
        if k + 1 < count:
            bend = (headings[k] - math.atan2(way[1], way[0]) + math.pi) % (2.0 * math.pi) - math.pi
            expected += compute_heading_loss(bend, full_speed(limits), limits)
        assert to_go(line, k, (*place, yaw), moves, limits) == pytest.approx(expected)
