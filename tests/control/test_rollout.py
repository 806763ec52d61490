"""Steps of simulated motions, and their sample times, against plain computations."""

import math

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from drake_starnav.control.motion import Pose, Twist
from drake_starnav.control.rollout import (
    clearance_within,
    heading_loss,
    next_way_point,
    time_to_go,
    times_left,
    turning_time,
)
from drake_starnav.robot import Limits

LIMITS = Limits(0.8, 2.0, 1.0, 4.0)
LINE = np.array(((0.0, 0.0), (1.0, 0.0), (1.0, 1.0), (2.0, 1.0)))


def test_the_clearance_is_that_of_the_nearest_hit_up_to_the_zone() -> None:
    hits = np.array(((1.0, 0.0), (0.0, 0.4)))
    assert clearance_within(0.0, 0.0, hits, 0.25, 0.3) == pytest.approx(0.15)
    assert clearance_within(0.0, 0.0, hits, 0.25, 0.1) == pytest.approx(0.1)
    assert clearance_within(0.0, 0.0, hits, 0.5, 0.1) == 0.0


def test_the_next_way_point_is_in_sight_beyond_the_backward_extension_of_its_leg() -> None:
    assert next_way_point(LINE, 1, 0.5, 0.0) == 1
    assert next_way_point(LINE, 1, 1.0, 0.0) == 2
    assert next_way_point(LINE, 3, 2.0, 1.0) == 3  # the last one stays


def fastest_turn(angle: float, rate: float) -> float:
    """`turning_time` step by step: towards where it would stop too soon, or too late, then brake, s."""
    step, turned, omega, time = 1e-3, 0.0, rate, 0.0
    sign = 1.0 if rate * abs(rate) / (2.0 * LIMITS.max_yaw_acceleration) < angle else -1.0
    while sign * (turned + omega * abs(omega) / (2.0 * LIMITS.max_yaw_acceleration) - angle) < 0.0:
        omega = min(max(omega + sign * LIMITS.max_yaw_acceleration * step, -LIMITS.max_yaw_rate), LIMITS.max_yaw_rate)
        turned, time = turned + omega * step, time + step
    return time + abs(omega) / LIMITS.max_yaw_acceleration


@pytest.mark.parametrize("angle", [0.1, 0.7, 3.0])
@pytest.mark.parametrize("rate", [-1.0, 0.0, 0.6])
def test_the_turning_time_is_that_of_the_fastest_turn(angle: float, rate: float) -> None:
    assert turning_time(angle, rate, LIMITS) == pytest.approx(fastest_turn(angle, rate), abs=0.01)
    assert turning_time(-angle, -rate, LIMITS) == turning_time(angle, rate, LIMITS)


@given(st.floats(-math.pi, math.pi), st.floats(0.0, 0.8), st.floats(-2.0, 2.0))
def test_no_heading_gains_time(error: float, v: float, omega: float) -> None:
    assert heading_loss(error, v, omega, LIMITS) >= 0.0
    assert heading_loss(0.0, LIMITS.max_speed, 0.0, LIMITS) == 0.0


def test_the_time_to_go_is_the_legs_and_the_turns() -> None:
    left = times_left(LINE, LIMITS)
    corner = heading_loss(0.5 * math.pi, LIMITS.max_speed, 0.0, LIMITS)
    assert left[2] == pytest.approx(1.0 / 0.8)
    assert left[1] == pytest.approx(2.0 / 0.8 + corner)
    at_full_speed = time_to_go(LINE, left, 1, Pose(0.0, 0.0, 0.0), Twist(LIMITS.max_speed, 0.0), LIMITS)
    assert at_full_speed == pytest.approx(3.0 / 0.8 + 2.0 * corner)
    assert time_to_go(LINE, left, 1, Pose(0.0, 0.0, 1.0), Twist(LIMITS.max_speed, 0.0), LIMITS) > at_full_speed
