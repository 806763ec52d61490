"""The theorem of the certificate: an accepted command leads to no contact, and hardly anything safe is refused."""

import math

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from drake_starnav.geometry.footprint import footprint
from drake_starnav.robot import RobotParameters
from drake_starnav.robot.motion import Actuation, roll_out
from drake_starnav.safety.clear import ClearanceCertificate
from drake_starnav.surroundings.surroundings import Surroundings
from drake_starnav.worlds.world import World
from tests.helpers.motions import certified, limited_twist, only_star, starred_twist
from tests.helpers.scans import RADIUS, cast, distance, free_point, observe_scan, scattered, seeds

ROBOT = RobotParameters()
LIMITS = ROBOT.limits
SPEEDS = np.array((LIMITS.max_speed, LIMITS.max_yaw_rate))
ACCELERATIONS = np.array((LIMITS.max_acceleration, LIMITS.max_yaw_acceleration))
SAFE, REACH = RADIUS + 0.01, 1.2
PERIOD, MARGIN, NOISE = 0.02, 0.0145, 0.01
OPEN = only_star(np.full(720, 10.0))


def sensed(world: World, pose: np.ndarray, before: Surroundings) -> Surroundings:
    return observe_scan(cast(world, pose), pose, SAFE, REACH, before)


def moved(pose: np.ndarray, twist: np.ndarray, target: np.ndarray, time: float, step: float = 1e-3) -> tuple:
    """Poses every `step` (s) of a robot that ramps continuously to the target twist, and its last twist."""
    poses, ((x, y, yaw), (v, omega)) = [], (pose.tolist(), twist.tolist())
    change_v, change_omega = (step * ACCELERATIONS).tolist()
    for _ in range(round(time / step)):
        before = v, omega
        v += min(max(target[0] - v, -change_v), change_v)
        omega += min(max(target[1] - omega, -change_omega), change_omega)
        speed, turned = 0.5 * step * (before[0] + v), 0.5 * step * (before[1] + omega)
        x, y = x + speed * math.cos(yaw + 0.5 * turned), y + speed * math.sin(yaw + 0.5 * turned)
        yaw += turned
        poses.append((x, y, yaw))
    return np.array(poses), np.array((v, omega))


def random_situation(seed: int) -> tuple[World, Surroundings, np.ndarray, np.ndarray, np.ndarray]:
    """A random world, what is known of it, a pose near the scan's, a twist and a desired twist."""
    rng = np.random.default_rng(seed)
    world = scattered(rng, discs=14, walls=8)
    scan_pose = np.array((*free_point(rng, world, SAFE), rng.uniform(-4.0, 4.0)))
    star = sensed(world, scan_pose, Surroundings.unknown())
    pose = scan_pose + (*rng.uniform(-0.03, 0.03, 2), rng.uniform(-0.1, 0.1))
    limit = SPEEDS
    return world, star, pose, rng.uniform((0.0, -limit[1]), limit), rng.uniform((-0.2, -limit[1]), limit)


@settings(max_examples=150)
@given(seeds, st.sampled_from([PERIOD, 0.1, 0.3]))
def test_an_accepted_command_and_full_braking_touch_nothing(seed, hold):
    _, star, pose, twist, desired = random_situation(seed)
    hits = star.recent_hits.hits.points
    if not certified(pose, twist, desired, hold, LIMITS, star):
        *tried, accepted = starred_twist(pose, twist, desired, hold, LIMITS, star)
        if not accepted:
            return
        desired = np.array(tried)
    held, at_end = moved(pose, twist, desired, hold)
    braked, standing = moved(held[-1], at_end, np.zeros(2), 1.0)
    np.testing.assert_allclose(standing, 0.0, atol=1e-9)
    path = np.vstack((held, braked))
    away = np.hypot(*np.moveaxis(path[::3, None, :2] - hits, -1, 0))
    assert away.min() >= RADIUS


def test_most_random_commands_are_decided_both_ways():
    accepted = []
    for seed in range(100):
        _, star, pose, twist, desired = random_situation(seed)
        accepted.append(certified(pose, twist, desired, PERIOD, LIMITS, star))
    assert 20 < sum(accepted) < 95


def adversary(rng: np.random.Generator) -> np.ndarray:
    """A twist that likes full speed."""
    v, omega = rng.uniform(-0.2, 2.0), rng.uniform(-0.7, 0.7)
    return np.clip((v, omega), (-1.0, -1.0), (1.0, 1.0)) * SPEEDS


def recklessly_driven(
    seed: int, delay: float = 0.0, robot: RobotParameters = ROBOT, scans: float = 20.0
) -> tuple[float, float, int]:
    """10 s of random commands through the certificate: scans at that rate, Hz, commands at 50 Hz that take effect late.

    Returns the least distance to an obstacle, the way driven (both in m) and how often a command was held back.
    """
    limits = robot.limits
    rng = np.random.default_rng(seed)
    world = scattered(rng, discs=14, walls=8)
    pose, star = np.array((0.0, 0.0, rng.uniform(-4.0, 4.0))), Surroundings.unknown()
    commanded = actual = np.zeros(2)
    waiting = [commanded] * round(delay / PERIOD)
    least, driven, wanted, refused = np.inf, 0.0, adversary(rng), 0
    for k in range(500):
        if (k * PERIOD * scans) % 1.0 < PERIOD * scans - 1e-9:  # the first command after each scan
            star = sensed(world, pose, star)
        if rng.random() < 0.03:
            wanted = adversary(rng) * (robot.max_speed / ROBOT.max_speed, 1.0)
        v, omega, accepted = starred_twist(pose, commanded, wanted, PERIOD, limits, star, delay)
        refused += not (accepted and v == wanted[0])
        commanded = limited_twist(commanded, np.array((v, omega)), robot, PERIOD)
        waiting.append(commanded)
        poses, actual = moved(pose, actual, waiting.pop(0), PERIOD, step=2e-3)
        driven += float(np.hypot(*np.diff(poses[:, :2], axis=0).T).sum())
        pose = poses[-1]
        least = min(least, distance(world, poses[:, :2]).min())
    return least, driven, refused


@pytest.mark.parametrize("seed", range(12))
def test_a_reckless_driver_never_touches_anything(seed):
    least, driven, refused = recklessly_driven(seed)
    assert least >= RADIUS
    assert driven > 0.3 and refused > 0  # it did drive, and it was held back


def test_a_reckless_driver_touches_nothing_when_commands_take_effect_after_the_declared_delay():
    assert min(recklessly_driven(seed, delay=PERIOD)[0] for seed in range(8)) >= RADIUS


def test_a_fast_reckless_driver_with_rare_and_short_scans_never_touches_anything():
    fast = RobotParameters(max_speed=1.5)
    for seed in range(8):
        least, driven, _ = recklessly_driven(seed, robot=fast, scans=1.25)
        assert least >= RADIUS and driven > 0.3


def test_braking_is_all_that_is_left_when_nothing_can_be_certified():
    blind, pose = Surroundings.unknown(), np.array((1.0, 1.0, 0.0))
    assert starred_twist(pose, np.array((0.5, 0.3)), np.array((0.8, 1.0)), PERIOD, LIMITS, blind) == (0.0, 0.0, False)
    standing = starred_twist(pose, np.zeros(2), np.array((0.8, 1.0)), PERIOD, LIMITS, blind)
    assert standing == (0.0, 1.0, False)  # a disc that turns about its centre covers no new ground


def test_a_robot_at_the_edge_of_the_star_may_drive_into_it_but_not_along_its_edge():
    """Only where it goes counts, not where it is: an estimate may lie outside."""
    outside, inwards = np.array((-0.3005, 0.0, 0.0)), np.array((0.3, 0.0))
    assert certified(outside, inwards, inwards, PERIOD, LIMITS, ring(0.3))
    assert not certified(outside, -inwards, -inwards, PERIOD, LIMITS, ring(0.3))
    assert not certified(outside + (0.0, 0.0, 0.5 * math.pi), inwards, inwards, PERIOD, LIMITS, ring(0.3))


@settings(max_examples=60)
@given(seeds)
def test_of_polygons_all_discs_that_cover_them_stay_inside_however_the_robot_is_turned(seed):
    rng = np.random.default_rng(seed)
    shape = footprint(
        (((0.1, -0.1), (0.5, -0.1), (0.5, 0.1), (0.1, 0.1)), ((0.1, 0.1), (0.3, 0.1), (0.3, 0.6), (0.1, 0.6)))
    )
    star = only_star(rng.uniform(0.4, 1.0, 8).repeat(4))
    pose = np.array((*rng.uniform(-0.3, 0.3, 2), rng.uniform(-math.pi, math.pi)))
    driven = roll_out(pose, np.zeros(2), rng.uniform(-SPEEDS, SPEEDS), Actuation(LIMITS, shape, 0.2, 0.0))
    turns = np.array([((math.cos(a), -math.sin(a)), (math.sin(a), math.cos(a))) for a in driven.pose[1:, 2]])
    centers = driven.position[1:, None] + np.einsum("nij,mj->nmi", turns, shape.cover)
    assert (
        ClearanceCertificate(star, 0.01, shape).accepts(driven)
        == star.certified_star.union.contains(centers.reshape(-1, 2)).all()
    )


def ring(reach: float) -> Surroundings:
    return only_star(np.full(720, reach))


@pytest.mark.parametrize("speed", [0.05, 0.2, 0.5, 0.8])
def test_the_braking_distance_is_never_underestimated(speed):
    twist = np.array((speed, 0.0))
    needed = speed * PERIOD + speed**2 / (2.0 * ROBOT.max_acceleration)
    assert not certified(np.zeros(3), twist, twist, PERIOD, LIMITS, ring(needed - 1e-4))
    assert certified(np.zeros(3), twist, twist, PERIOD, LIMITS, ring(needed + 0.012))


def test_what_the_robot_drives_through_during_the_delay_is_checked_too():
    """A gap in the star that is behind the robot when its command takes effect."""
    bearing = 2.0 * math.pi / 720 * np.arange(720)
    cut = only_star(np.where(np.abs(bearing - 0.5 * math.pi) < 0.1, 0.2, 5.0))
    pose, ahead = np.array((-0.3, 0.3, 0.0)), np.array((0.8, 0.0))
    assert certified(pose, ahead, ahead, PERIOD, LIMITS, OPEN, delay=0.5)
    assert certified(pose + (0.4, 0.0, 0.0), ahead, ahead, PERIOD, LIMITS, cut)
    assert not certified(pose, ahead, ahead, PERIOD, LIMITS, cut, delay=0.5)
