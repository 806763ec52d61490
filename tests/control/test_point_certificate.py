"""The theorem of the certificate against points, and what it lets through that the certified region does not."""

import math

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from drake_starnav.control.certificates import accepted
from drake_starnav.control.motion import Actuation, Motion, roll_out
from drake_starnav.control.point_certificate import PointCertificate, needed_distances
from drake_starnav.geometry.footprint import disc
from drake_starnav.regions.erosion import smoothed_distances
from drake_starnav.regions.perception import Perceived, PerceptionSettings, perceive
from drake_starnav.regions.safe_region import CertifiedRegion, ScanMemory, certified_region
from drake_starnav.regions.separation import ESCAPE_CLEARANCE
from drake_starnav.robot import Limits, RobotParameters
from drake_starnav.robot.base import SHARES
from drake_starnav.worlds.world import World
from tests.helpers.motions import certified, least_clearance, limited_twist, motion
from tests.helpers.scans import MARGINS, RADIUS, cast, distance, free_point, scattered, seeds

ROBOT = RobotParameters()
LIMITS = ROBOT.limits
SPEEDS, ACCELERATIONS = np.array(LIMITS[:2]), np.array(LIMITS[2:4])
MARGIN, PERIOD = 0.005, 0.02
REACH = 2.0


def sensed(
    world: World, pose: np.ndarray, memory: ScanMemory, reach: float = REACH
) -> tuple[CertifiedRegion, ScanMemory]:
    scan = cast(world, pose, beams=720)
    return certified_region(memory, scan, smoothed_distances(scan), pose, RADIUS, reach, (reach, 5))


def clear_twist(
    pose: np.ndarray, twist: np.ndarray, desired: np.ndarray, star: CertifiedRegion, limits: Limits = LIMITS
) -> np.ndarray | None:
    """The desired twist at the largest share of its speed that the certificate accepts; None if it accepts none."""
    for share in SHARES[:7, 0]:
        tried = desired * (share, 1.0)
        motion = roll_out(pose, twist, tried, Actuation(limits, disc(RADIUS), PERIOD, 0.0))
        if accepted(motion, (PointCertificate(star, MARGIN, RADIUS),)):
            return tried
    return None


def simulated(pose: np.ndarray, twist: np.ndarray, target: np.ndarray, time: float) -> tuple[np.ndarray, np.ndarray]:
    """Poses every millisecond of a robot that ramps continuously to the target twist, and its last twist."""
    poses, step = [], 1e-3
    for _ in range(round(time / step)):
        after = twist + np.clip(target - twist, -step * ACCELERATIONS, step * ACCELERATIONS)
        v, omega = 0.5 * (twist + after)
        middle = pose[2] + 0.5 * omega * step
        pose = pose + step * np.array((v * math.cos(middle), v * math.sin(middle), omega))
        twist = after
        poses.append(pose)
    return np.array(poses), twist


@settings(max_examples=60)
@given(seeds)
def test_an_accepted_command_and_full_braking_keep_their_distance(seed):
    rng = np.random.default_rng(seed)
    world = scattered(rng, discs=14, walls=8)
    pose = np.array((*free_point(rng, world, RADIUS + 0.005), rng.uniform(-4.0, 4.0)))
    star, _ = sensed(world, pose, ScanMemory())
    twist, wanted = (rng.uniform((0.0, -LIMITS.max_yaw_rate), SPEEDS) for _ in range(2))
    tried = clear_twist(pose, twist, wanted, star)
    if tried is None:
        return
    held, at_end = simulated(pose, twist, tried, PERIOD)
    braked, standing = simulated(held[-1], at_end, np.zeros(2), 1.0)
    np.testing.assert_allclose(standing, 0.0, atol=1e-9)
    path = np.vstack((pose, held, braked))[:, :2]
    assert np.hypot(*np.moveaxis(path[::3, None] - star.hits, -1, 0)).min() >= RADIUS


@settings(max_examples=60)
@given(seeds, st.sampled_from([PERIOD, 0.1, 0.3]), st.sampled_from([0.0, 0.02]))
def test_the_least_clearance_is_that_of_the_braking_path(seed, hold, delay):
    rng = np.random.default_rng(seed)
    hits, gaps = rng.uniform(-1.5, 1.5, (60, 2)), rng.uniform(0.0, 0.07, 60)
    needed = needed_distances(gaps, RADIUS)
    pose, twist = np.array((0.0, 0.0, rng.uniform(-4.0, 4.0))), rng.uniform(-SPEEDS, SPEEDS)
    desired = rng.uniform(-SPEEDS, SPEEDS)
    away = least_clearance(motion(pose, twist, desired, hold, LIMITS, delay), hits, needed)
    star = CertifiedRegion(np.zeros(2), 0.0, np.zeros(4), hits, hits, gaps, seen=True)
    driven = roll_out(pose, twist, desired, Actuation(LIMITS, disc(RADIUS), hold, delay))
    kept, missed = ESCAPE_CLEARANCE, 3.0
    if not PointCertificate(star, kept, RADIUS).accepts(driven):
        assert away < kept + 1e-12
        return
    while missed - kept > 1e-13:
        middle = 0.5 * (kept + missed)
        if PointCertificate(star, middle, RADIUS).accepts(driven):
            kept = middle
        else:
            missed = middle
    now = float((np.hypot(*hits.T) - needed).min())
    assert kept == pytest.approx(away, abs=1e-12) or away == pytest.approx(now, abs=1e-12)  # it need not gain any


def visiting(places: np.ndarray) -> Motion:
    """A motion from place to place, shape (n, 2), W, m; whatever robot can do so."""
    samples = np.zeros((len(places), 6))
    samples[:, :2] = places
    return Motion(samples, 0, 0, True, disc(RADIUS))


@settings(max_examples=500)
@given(seeds)
def test_each_place_of_a_motion_keeps_the_margin_or_the_clearance_that_the_robot_has(seed):
    """Whatever way leads there, from hits as well as from what lies beyond the reach of the last scan."""
    rng = np.random.default_rng(seed)
    steps = rng.choice([0.01, 0.1, 0.4]) * rng.standard_normal((rng.integers(2, 9), 2))
    places = rng.choice([0.3, 3.0]) * rng.uniform(-1.0, 1.0, 2) + np.cumsum(steps, axis=0)
    hits, gaps = places[0] + rng.uniform(-1.5, 1.5, (4, 2)), rng.uniform(0.0, 0.1, 4)
    center, margin = places[0] + rng.uniform(-0.3, 0.3, 2), rng.uniform(0.0, 0.3)
    star = CertifiedRegion(center, 0.0, np.zeros(4), hits, hits, gaps, seen=True, reach=rng.uniform(0.5, 3.0))
    away = np.hypot(*np.moveaxis(places[:, None] - hits, -1, 0)) - np.hypot(RADIUS, gaps)
    known = star.reach - RADIUS - np.hypot(*(places - center).T)
    kept = max(min(margin, away[0].min()), ESCAPE_CLEARANCE)
    keeps = min(away.min(), known.min()) >= kept
    assert PointCertificate(star, margin, RADIUS).accepts(visiting(places)) == keeps


@pytest.mark.parametrize("way", [(1.0, 0.0), (-1.0, 0.0), (0.0, 1.0), (0.6, -0.8)])
def test_a_long_step_to_a_hit_is_no_less_noticed_than_many_short_ones(way: tuple[float, float]):
    """Also from one side of the origin to the other."""
    hit = (0.5 + 0.9 * RADIUS) * np.array(way)
    star = CertifiedRegion(np.zeros(2), 0.0, np.zeros(4), hit[None], hit[None], np.zeros(1), seen=True)
    for count in (2, 3, 100):
        across = np.linspace(-0.5, 0.5, count)[:, None] * way
        back = np.vstack((across, across[:1]))
        assert not PointCertificate(star, MARGIN, RADIUS).accepts(visiting(back))
        assert PointCertificate(star, MARGIN, RADIUS).accepts(visiting(-0.9 * back[:1]))


def test_a_robot_within_the_margin_may_turn_on_the_spot():
    hits = np.array([(RADIUS + 0.01, 0.0)])
    star = CertifiedRegion(np.zeros(2), 0.0, np.zeros(4), hits, hits, np.zeros(1), seen=True)
    turning = roll_out(np.zeros(3), np.zeros(2), np.array((0.0, 1.0)), Actuation(LIMITS, disc(RADIUS), PERIOD, 0.0))
    assert PointCertificate(star, 0.05, RADIUS).accepts(turning)


def test_a_robot_that_almost_touches_something_is_not_driven_even_away_from_it():
    for clearance, moves in ((0.9 * ESCAPE_CLEARANCE, False), (1.1 * ESCAPE_CLEARANCE, True)):
        hits = np.array([(RADIUS + clearance, 0.0)])
        star = CertifiedRegion(np.zeros(2), 0.0, np.zeros(4), hits, hits, np.zeros(1), seen=True)
        backwards = np.array((-0.5, 0.0))
        assert (clear_twist(np.zeros(3), backwards, backwards, star) is not None) == moves


def recklessly_driven(
    seed: int, robot: RobotParameters = ROBOT, every: int = 2, reach: float = REACH
) -> tuple[float, float]:
    """10 s of random commands through the certificate: least distance to an obstacle, and the way driven, m.

    Args:
        seed: of the world and the commands.
        robot: its limits.
        every: so many periods lie between two scans.
        reach: hits within it are known, m.
    """
    rng = np.random.default_rng(seed)
    world = scattered(rng, discs=14, walls=8)
    pose, memory, twist = np.array((0.0, 0.0, rng.uniform(-4.0, 4.0))), ScanMemory(), np.zeros(2)
    least, driven, heading = np.inf, 0.0, 0.0
    for k in range(500):
        if k % every == 0:
            star, memory = sensed(world, pose, memory, reach)
        if rng.random() < 0.03:
            heading = rng.uniform(-4.0, 4.0)
        error = (heading - pose[2] + math.pi) % (2.0 * math.pi) - math.pi
        wanted = np.array((robot.max_speed * max(math.cos(error), 0.0), np.clip(4.0 * error, -2.0, 2.0)))
        tried = clear_twist(pose, twist, wanted, star, robot.limits)
        commanded = limited_twist(twist, np.zeros(2) if tried is None else tried, robot, PERIOD)
        poses, twist = simulated(pose, twist, commanded, PERIOD)
        driven += float(np.hypot(*np.diff(poses[:, :2], axis=0).T).sum())
        pose = poses[-1]
        least = min(least, distance(world, poses[:, :2]).min())
    return least, driven


@pytest.mark.parametrize("seed", range(8))
def test_a_reckless_driver_never_touches_anything(seed):
    least, driven = recklessly_driven(seed)
    assert least >= RADIUS
    assert driven > 0.5


@pytest.mark.parametrize("seed", range(8))
def test_a_fast_reckless_driver_with_rare_and_short_scans_never_touches_anything(seed):
    least, driven = recklessly_driven(seed, RobotParameters(max_speed=1.5), every=40, reach=1.2)
    assert least >= RADIUS
    assert driven > 0.5


def test_what_lies_beyond_the_hits_that_are_known_certifies_no_motion():
    post = World("post", (0, 0, 0), (3, 0), cylinders=[(2.5, 0.0, 0.1)])
    star, _ = sensed(post, np.zeros(3), ScanMemory())
    assert star.reach == REACH
    ahead, pose = np.array((0.8, 0.0)), np.array((1.3, 0.0, 0.0))  # it brakes within 0.32 m
    assert clear_twist(pose, ahead, ahead, star) is not None
    pose = np.array((1.45, 0.0, 0.0))
    assert clear_twist(pose, ahead, ahead, star) is None


def test_a_winding_gap_that_the_star_refuses():
    """Most of a turn about a pillar keeps its distance, but leaves the sight of where the scan was taken."""
    world = World("pillar", (0, 0, 0), (1, 1), cylinders=[(0.0, 0.5, 0.05)])
    pose, arc = np.zeros(3), np.array((0.5, 1.0))
    star, _ = sensed(world, pose, ScanMemory())
    needed = needed_distances(star.half_gaps, RADIUS)
    assert least_clearance(motion(pose, arc, arc, 2.5, LIMITS), star.hits, needed) > 0.15
    assert not certified(pose, arc, arc, 2.5, LIMITS, star)


def test_between_two_hits_of_a_surface_the_disc_stays_off_their_chord():
    away = needed_distances(np.array([0.0, 0.07]), RADIUS)
    np.testing.assert_allclose(away, [RADIUS, math.hypot(RADIUS, 0.07)])


@pytest.mark.parametrize("half", [2.3, 2.8])
def test_a_disc_backs_no_farther_than_it_has_seen(half):
    """Towards a post that stands where its lidar does not look, and never did."""
    post = World("post", (0, 0, 0), (3, 0), cylinders=[(-0.8, 0.0, 0.1)])
    settings, seen = PerceptionSettings(MARGINS, disc(RADIUS)), Perceived.nothing()
    backwards, accepted = np.array((-0.5, 0.0)), []
    for x in (0.0, 0.1, 0.4):
        pose = np.array((x, 0.0, 0.0))
        scan = cast(post, pose, angle_min=-half, angle_increment=2.0 * half / 359)
        assert not np.isfinite(scan.ranges).any()
        seen = perceive(seen, (scan,), pose, settings)
        accepted.append(clear_twist(pose, backwards, backwards, seen.safety) is not None)
    assert accepted == [False, False, True]  # it stops within 0.14 m
