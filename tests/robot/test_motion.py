"""A rolled-out motion: its phases, its times, and that it follows the ramps."""

import itertools
import math

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from drake_starnav.geometry.footprint import disc, footprint
from drake_starnav.robot import BASES, Limits, RobotParameters
from drake_starnav.robot.motion import (
    AT_REST,
    GRIP,
    GRIP_WHILE_BRAKING,
    LARGEST_TURN,
    LONGEST_STEP,
    SAMPLES,
    Actuation,
    BrakingMotion,
    Pose,
    Velocity,
    advance_pose,
    body_rates,
    is_sliding,
    limit_to_grip,
    predict_pose,
    ramp_velocity,
    roll_out,
)
from tests.helpers.motions import FINE, actuation, exact_poses, exact_rates, turned
from tests.helpers.scans import seeds

ROBOT = RobotParameters()
LONG = footprint(((0.3, 0.0), (0.0, 0.1), (-0.3, 0.0), (0.0, -0.1)))


@settings(max_examples=60)
@given(seeds, st.sampled_from(list(BASES)), st.sampled_from([0.02, 0.3]), st.sampled_from([0.0, 0.05, 0.4]))
def test_the_samples_lie_on_the_motion_of_a_robot_that_ramps_continuously(seed, base, hold, delay) -> None:
    """It keeps its twist for the delay, holds the target, and brakes until it stands; whether it drives along its x
    axis, sideways or on a circle, and however fast it turns meanwhile. Margins count on it."""
    rng, robot = np.random.default_rng(seed), RobotParameters(base=base)
    most = (robot.max_speed,) * (len(robot.drive.components) - 1) + (robot.limits.max_yaw_rate,)
    shares = np.where(rng.random((2, len(most))) < 0.7, rng.uniform(-1.0, 1.0, (2, len(most))), 0.0)
    twist, target = (robot.drive.saturate(row * most, robot.limits) for row in shares)
    command, start = actuation(robot, hold, delay), rng.uniform(-3.0, 3.0, 3)
    motion = roll_out(start, twist, target, command)
    assert motion.time[[motion.commanded, motion.braking]] == pytest.approx((delay, delay + hold))
    assert (motion.commanded == 0) == (delay == 0.0)
    velocity, turning, _ = exact_rates(motion.time, twist, target, command)
    np.testing.assert_allclose(np.abs(motion.twist[:, 0]), np.hypot(*velocity.T), atol=1e-9)
    assert (motion.twist[:, 0] * velocity[:, 0] >= -1e-12).all()  # backwards is negative
    np.testing.assert_allclose(motion.twist[:, 1], turning, atol=1e-9)
    np.testing.assert_allclose(motion.twist[-1], 0.0, atol=AT_REST)
    exact = exact_poses(twist, target, command)
    times = FINE * np.arange(len(exact))
    exact = np.column_stack([np.interp(motion.time, times, column) for column in exact.T])
    assert np.abs(motion.pose[:, 2] - start[2] - exact[:, 2]).max() < 1e-3
    assert np.hypot(*(motion.position - start[:2] - turned(exact[:, :2], start[2])).T).max() < 1e-4
    assert np.hypot(*np.diff(motion.position, axis=0).T).max() <= motion.footprint.sampling + 1e-9
    assert np.diff(motion.time).min() >= 0.0 and np.diff(motion.time).max() <= LONGEST_STEP + 1e-9


@settings(max_examples=100)
@given(seeds, st.sampled_from([0.02, 0.3]), st.sampled_from([0.0, 0.05]))
def test_it_brakes_as_hard_as_it_can_and_the_drive_and_the_motion_end_at_samples(seed, hold, delay) -> None:
    """However fast it drives and turns, and whichever ends first; its samples are never far apart."""
    rng = np.random.default_rng(seed)
    robot = RobotParameters(max_speed=2.0, max_yaw_rate=15.0, max_acceleration=3.0, max_yaw_acceleration=9.0)
    twist, target = rng.uniform(-1.0, 1.0, (2, 2)) * robot.limits[:2]
    motion = roll_out(np.zeros(3), twist, target, actuation(robot, hold, delay))
    times, speeds, rates = motion.samples[motion.braking :, (5, 3, 4)].T
    stops = abs(speeds[0]) / robot.max_acceleration, abs(rates[0]) / robot.max_yaw_acceleration
    assert times[np.abs(speeds) < AT_REST][0] - times[0] == pytest.approx(stops[0], abs=1e-6)
    assert times[-1] - times[0] == pytest.approx(max(stops), abs=1e-6)
    assert np.hypot(*np.diff(motion.position, axis=0).T).max() <= motion.footprint.sampling + 1e-9
    assert np.abs(np.diff(motion.pose[:, 2])).max() <= LARGEST_TURN + 1e-9
    assert np.diff(motion.time).max() <= LONGEST_STEP + 1e-9


@pytest.mark.parametrize("sign", [1.0, -1.0])
@pytest.mark.parametrize(("twist", "steps"), [((0.8, 0.0), 100), ((0.1, 0.0), 25), ((0.0, 10.0), 40), ((0.0, 0.0), 25)])
def test_there_are_no_more_samples_than_needed(twist, steps, sign) -> None:
    """Of a second: 8 mm apart, or 0.04 s where it is slow, or a quarter of a radian where it turns fast."""
    steady = sign * np.array(twist)
    with np.errstate(divide="raise"):
        motion = roll_out(np.zeros(3), steady, steady, actuation(RobotParameters(max_yaw_rate=10.0), 1.0))
    assert abs(motion.braking - motion.commanded - steps) <= 1  # rounding may add one


@pytest.mark.parametrize(
    ("curvature", "shape", "steps"),
    [(2.0, LONG, 0.8 / LONG.sampling), (-2.0, LONG, 0.8 / LONG.sampling), (60.0, disc(0.3), 120)],
)
def test_of_a_car_there_are_no_more_samples_than_needed(curvature, shape, steps) -> None:
    """Of a second at 0.5 m/s: a corner 0.3 m off the axis moves by the sampling, or the car turns by 0.25 rad."""
    steady, limits = np.array((0.5, curvature)), Limits(0.5, 60.0, 1.0, 1.0, 1.0, 1.0)
    motion = roll_out(np.zeros(3), steady, steady, Actuation(limits, shape, 1.0, 0.0, BASES["car"]))
    assert abs(motion.braking - steps) <= 1


@settings(max_examples=60)
@given(seeds, st.sampled_from(list(BASES)))
def test_no_point_of_the_footprint_goes_farther_than_the_spacing_between_samples(seed, base) -> None:
    rng, robot = np.random.default_rng(seed), RobotParameters(base=base, max_yaw_rate=5.0)
    limits = robot.limits._replace(max_yaw_acceleration=40.0)
    shares = rng.choice([-5.0, -0.5, 0.0, 0.5, 5.0], (2, len(robot.drive.components)))
    twist, target = (robot.drive.saturate(row, limits) for row in shares)
    motion = roll_out(np.zeros(3), twist, target, Actuation(limits, LONG, 0.1, 0.0, robot.drive))
    for corner in LONG.parts[0]:
        places = motion.position + turned(np.broadcast_to(corner, motion.position.shape), motion.pose[:, 2])
        assert np.hypot(*np.diff(places, axis=0).T).max() <= LONG.sampling + 1e-9


def test_a_step_keeps_the_accelerations_and_drives_at_the_mean_speed() -> None:
    now = Velocity(0.4, 0.0, 0.0)
    pose, after = advance_pose(Pose(1.0, 2.0, 0.0), now, Velocity(9.0, 0.0, 0.0), 0.1, ROBOT.limits)
    assert after == pytest.approx((0.5, 0.0, 0.0))
    assert (*pose, pose.x - 1.0) == pytest.approx((1.045, 2.0, 0.0, 0.045))
    # the speed is reached in the middle of the step
    pose, after = advance_pose(Pose(0.0, 0.0, 0.0), now, Velocity(0.45, 0.0, 0.0), 0.1, ROBOT.limits)
    assert (after.v_x, pose.x) == pytest.approx((0.45, 0.05 * 0.425 + 0.05 * 0.45))


def test_the_speed_of_a_velocity_is_its_size_with_the_sign_of_that_ahead() -> None:
    for ahead, aside in itertools.product((-2.0, -1.0, 1.0), (-2.0, -1.0, 0.0, 1.0, 2.0)):
        speed, rate = body_rates(Velocity(ahead, aside, 0.5), ROBOT.limits)
        assert (speed, rate) == pytest.approx((math.copysign(math.hypot(ahead, aside), ahead), 0.5))
        speed, rate = body_rates(Velocity(ahead, 0.0, 0.5), ROBOT.limits._replace(steers=1.0))
        assert (speed, rate) == pytest.approx((ahead, 0.5 * ahead))  # of a base that steers it is a curvature


def test_a_long_motion_has_room() -> None:
    motion = roll_out(np.zeros(3), np.zeros(2), np.array((0.8, 0.0)), actuation(ROBOT, hold=4.0))
    assert len(motion.samples) > 2 * SAMPLES
    assert motion.position[-1, 0] == pytest.approx(0.8 * 4.0, abs=0.02)


def test_what_was_commanded_before_may_slide_until_the_command_takes_effect() -> None:
    robot = RobotParameters(max_speed=2.0, max_yaw_rate=5.0)
    sliding, still = np.array((2.0, 4.005)), np.zeros(2)
    assert roll_out(np.zeros(3), sliding, still, actuation(robot, delay=0.1)).grips
    assert not roll_out(np.zeros(3), sliding, sliding, actuation(robot, delay=0.1)).grips


def test_nothing_is_guaranteed_before_the_first_command() -> None:
    none = BrakingMotion.none()
    assert not none.certified
    np.testing.assert_array_equal(none.path, np.zeros((1, 3)))
    with pytest.raises(AttributeError):
        none.certified = True


@given(st.integers(0, 10**6))
def test_a_velocity_falls_as_fast_as_the_robot_brakes_and_grows_as_fast_as_it_speeds_up(seed) -> None:
    """Also where it changes its sign within a step, or its direction; the mean of a step leads as far as small ones."""
    rng = np.random.default_rng(seed)
    limits = ROBOT.limits._replace(max_acceleration=rng.uniform(0.2, 4.0), max_deceleration=rng.uniform(0.2, 4.0))
    aside = rng.uniform(-1.0, 1.0, 2) * (rng.random() < 0.5)
    now, target = (Velocity(ahead, side, 0.0) for ahead, side in zip(rng.uniform(-1.0, 1.0, 2), aside, strict=True))
    after, mean = ramp_velocity(now, target, 0.4, limits)
    small, way = now, np.zeros(2)
    for _ in range(400):
        before, (small, _) = small, ramp_velocity(small, target, 0.001, limits)
        way += 0.0005 * np.add(before, small)[:2]
        gap, speed = np.subtract(target, before)[:2], np.array(before[:2])
        most = limits.max_deceleration if speed @ gap < -1e-2 * math.hypot(*gap) else limits.max_acceleration
        if abs(speed @ gap) > 1e-2 * math.hypot(*gap):
            assert math.dist(before, small) == pytest.approx(min(0.001 * most, math.hypot(*gap)), abs=1e-12)
    np.testing.assert_allclose(small, after, atol=5e-3)
    np.testing.assert_allclose(way, 0.4 * np.array(mean)[:2], atol=2e-3)


def test_the_grip_falls_where_the_robot_may_brake_hard() -> None:
    assert limit_to_grip(GRIP_WHILE_BRAKING) == GRIP
    assert limit_to_grip(2.0 * GRIP_WHILE_BRAKING) == pytest.approx(GRIP / 8.0)
    limits = Limits(2.0, 4.0, GRIP_WHILE_BRAKING, GRIP_WHILE_BRAKING, 10.0)
    assert not is_sliding(2.0, 0.5 * GRIP, limits)
    assert is_sliding(2.0, -0.51 * GRIP, limits)


@settings(max_examples=60)
@given(seeds, st.sampled_from(list(BASES)), st.sampled_from([0.02, 0.1]), st.integers(1, 6), st.floats(0.01, 1.0))
def test_pending_commands_lead_any_base_to_where_they_were_sent(seed, base, period, count, rest) -> None:
    rng, robot = np.random.default_rng(seed), RobotParameters(base=base)
    start, step = rng.uniform(-3.0, 3.0, 3), 1e-4
    velocities = rng.uniform(-1.0, 1.0, (count, 3)) * (1.5, base == "omnidirectional", robot.limits.max_yaw_rate)
    x, y, yaw = start
    for k, (ahead, aside, turning) in enumerate(velocities):
        turning *= ahead if base == "car" else 1.0
        for _ in range(round((period if k else rest * period) / step)):
            middle = yaw + 0.5 * turning * step
            x += step * (ahead * math.cos(middle) - aside * math.sin(middle))
            y += step * (ahead * math.sin(middle) + aside * math.cos(middle))
            yaw += turning * step
    pending = np.column_stack((velocities, np.full(count, period)))
    found = predict_pose(start, pending, (count - 1 + rest) * period, robot.limits)
    assert found == pytest.approx((x, y, yaw), abs=3e-4)
