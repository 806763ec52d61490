"""The theorem of the certificate: an accepted command leads to no contact, and hardly anything safe is refused."""

import dataclasses
import math

import numpy as np
import pytest
from hypothesis import example, given, settings
from hypothesis import strategies as st

from drake_starnav.control.clear import Clear
from drake_starnav.control.motion import Actuation, roll_out
from drake_starnav.geometry.footprint import Footprint, disc, footprint
from drake_starnav.regions.erosion import smoothed_distances
from drake_starnav.regions.perception import Perceived, PerceptionSettings, perceive
from drake_starnav.regions.safe_region import CertifiedRegion, ScanMemory, certified_region
from drake_starnav.robot import BASES, RobotParameters
from drake_starnav.robot.base import SHARES
from drake_starnav.scenario.scenario_file import parse_scenario
from drake_starnav.simulation.kinematics import KinematicMotion
from drake_starnav.worlds.clearance import body_clearance
from drake_starnav.worlds.world import World
from scripts.experiments.footprint_soundness import least_distance, solid, sweep
from tests.helpers.motions import certified, limited_twist, motion, starred_twist
from tests.helpers.scans import MARGINS, RADIUS, cast, distance, free_point, noisy, scattered, seeds

ROBOT = RobotParameters()
LIMITS = ROBOT.limits
SPEEDS, ACCELERATIONS = np.array(LIMITS[:2]), np.array(LIMITS[2:4])
SAFE, REACH = RADIUS + 0.01, 1.2
PERIOD, MARGIN, NOISE = 0.02, 0.0145, 0.01
ROBOTS = {name: RobotParameters(base=name) for name in BASES}
OPEN = CertifiedRegion(np.zeros(2), 0.0, np.full(720, 10.0), np.zeros((0, 2)))


def sensed(world: World, pose: np.ndarray, memory: ScanMemory) -> tuple[CertifiedRegion, ScanMemory]:
    scan = cast(world, pose)
    return certified_region(memory, scan, smoothed_distances(scan), pose, SAFE, REACH, (REACH + 2.0 * SAFE, 5))


def moved(pose: np.ndarray, twist: np.ndarray, target: np.ndarray, time: float, step: float = 1e-3) -> tuple:
    """Poses every `step` (s) of a robot that ramps continuously to the target twist, and its last twist."""
    poses = []
    change = step * ACCELERATIONS
    for _ in range(round(time / step)):
        after = twist + np.clip(target - twist, -change, change)
        v, omega = 0.5 * (twist + after)
        middle = pose[2] + 0.5 * omega * step
        pose = pose + step * np.array((v * math.cos(middle), v * math.sin(middle), omega))
        twist = after
        poses.append(pose)
    return np.array(poses), twist


def random_situation(seed: int) -> tuple[World, CertifiedRegion, ScanMemory, np.ndarray, np.ndarray, np.ndarray]:
    """A random world, what is known of it, a pose near the scan's, a twist and a desired twist."""
    rng = np.random.default_rng(seed)
    world = scattered(rng, discs=14, walls=8)
    scan_pose = np.array((*free_point(rng, world, SAFE), rng.uniform(-4.0, 4.0)))
    star, memory = sensed(world, scan_pose, ScanMemory())
    pose = scan_pose + (*rng.uniform(-0.03, 0.03, 2), rng.uniform(-0.1, 0.1))
    limit = SPEEDS
    return world, star, memory, pose, rng.uniform((0.0, -limit[1]), limit), rng.uniform((-0.2, -limit[1]), limit)


@settings(max_examples=150)
@given(seeds, st.sampled_from([PERIOD, 0.1, 0.3]))
def test_an_accepted_command_and_full_braking_touch_nothing(seed, hold):
    _, star, memory, pose, twist, desired = random_situation(seed)
    hits = memory.points
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
        _, star, _, pose, twist, desired = random_situation(seed)
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
    pose, memory = np.array((0.0, 0.0, rng.uniform(-4.0, 4.0))), ScanMemory()
    commanded = actual = np.zeros(2)
    waiting = [commanded] * round(delay / PERIOD)
    least, driven, wanted, refused = np.inf, 0.0, adversary(rng), 0
    for k in range(500):
        if (k * PERIOD * scans) % 1.0 < PERIOD * scans - 1e-9:  # the first command after each scan
            star, memory = sensed(world, pose, memory)
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


def test_the_certified_motion_keeps_the_last_twist_for_the_declared_delay():
    twist, desired = np.array((0.5, 1.0)), np.array((0.8, -2.0))
    path = motion(np.zeros(3), twist, desired, PERIOD, LIMITS, delay=0.1)
    kept = motion(np.zeros(3), twist, twist, 0.1, LIMITS)
    later = motion(kept[kept[:, 2] <= 0.1 + 1e-9][-1], twist, desired, PERIOD, LIMITS)
    np.testing.assert_allclose(path[-1], later[-1], atol=1e-9)
    farthest = np.hypot(*path[:, :2].T).max()
    assert certified(np.zeros(3), twist, desired, PERIOD, LIMITS, ring(farthest + 1e-9), delay=0.1)
    assert not certified(np.zeros(3), twist, desired, PERIOD, LIMITS, ring(farthest - 1e-9), delay=0.1)


@settings(max_examples=60)
@given(seeds, st.sampled_from([PERIOD, 0.1, 0.3]))
def test_the_braking_path_is_what_is_certified(seed, hold):
    _, star, _, pose, twist, desired = random_situation(seed)
    path = motion(pose, twist, desired, hold, LIMITS)
    np.testing.assert_array_equal(path[0], pose)
    if star.alone.contains(path[1:, :2]).all():
        assert certified(pose, twist, desired, hold, LIMITS, star)
    assert np.hypot(*np.diff(path[:, :2], axis=0).T).max() <= ROBOT.shape.sampling + 1e-9
    held, at_end = moved(pose, twist, desired, hold)
    braked, _ = moved(held[-1], at_end, np.zeros(2), 1.0)
    exact = np.vstack((held, braked))
    off = np.hypot(*np.moveaxis(path[:, None, :2] - exact[None, :, :2], -1, 0))
    assert off.min(axis=0).max() < 0.01  # near every place of the real motion there is a sample


@settings(max_examples=60)
@given(seeds)
def test_the_first_certified_share_is_taken(seed):
    _, star, _, pose, twist, desired = random_situation(seed)
    tried = SHARES * desired
    good = [t for t in tried if certified(pose, twist, np.array(t), PERIOD, LIMITS, star)]
    v, omega, accepted = starred_twist(pose, twist, desired, PERIOD, LIMITS, star)
    assert accepted == bool(good)
    if good:
        assert (v, omega) == pytest.approx(good[0])
    else:
        assert v == 0.0
    assert (SHARES[0] == 1.0).all() and (np.diff(SHARES[:7, 0]) < 0.0).all()


def test_braking_is_all_that_is_left_when_nothing_can_be_certified():
    blind, pose = CertifiedRegion.none(), np.array((1.0, 1.0, 0.0))
    assert starred_twist(pose, np.array((0.5, 0.3)), np.array((0.8, 1.0)), PERIOD, LIMITS, blind) == (0.0, 0.0, False)
    standing = starred_twist(pose, np.zeros(2), np.array((0.8, 1.0)), PERIOD, LIMITS, blind)
    assert standing == (0.0, 1.0, False)  # a disc that turns about its centre covers no new ground


@pytest.mark.parametrize(("speed", "turn"), [(0.044, 1.0), (-0.044, 1.0), (0.046, 0.0), (-0.3, 0.0)])
def test_without_a_certificate_only_a_robot_that_stops_within_a_millimetre_turns(speed, turn):
    twist, desired = np.array((speed, 0.0)), np.array((0.8, 1.0))
    assert starred_twist(np.zeros(3), twist, desired, PERIOD, LIMITS, CertifiedRegion.none()) == (0.0, turn, False)


def test_in_the_open_everything_is_certified():
    desired = np.array((0.8, -1.0))
    assert starred_twist(np.zeros(3), np.zeros(2), desired, PERIOD, LIMITS, OPEN) == (0.8, -1.0, True)


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
    star = CertifiedRegion(np.zeros(2), 0.0, rng.uniform(0.4, 1.0, 8).repeat(4), np.zeros((0, 2)))
    pose = np.array((*rng.uniform(-0.3, 0.3, 2), rng.uniform(-math.pi, math.pi)))
    driven = roll_out(pose, np.zeros(2), rng.uniform(-SPEEDS, SPEEDS), Actuation(LIMITS, shape, 0.2, 0.0))
    turns = np.array([((math.cos(a), -math.sin(a)), (math.sin(a), math.cos(a))) for a in driven.pose[1:, 2]])
    centers = driven.position[1:, None] + np.einsum("nij,mj->nmi", turns, shape.cover)
    assert Clear(star, 0.01, shape).accepts(driven) == star.alone.contains(centers.reshape(-1, 2)).all()


def ring(reach: float) -> CertifiedRegion:
    return CertifiedRegion(np.zeros(2), 0.0, np.full(720, reach), np.zeros((0, 2)))


@pytest.mark.parametrize("speed", [0.05, 0.2, 0.5, 0.8])
def test_the_braking_distance_is_never_underestimated(speed):
    twist = np.array((speed, 0.0))
    needed = speed * PERIOD + speed**2 / (2.0 * ROBOT.max_acceleration)
    assert not certified(np.zeros(3), twist, twist, PERIOD, LIMITS, ring(needed - 1e-4))
    assert certified(np.zeros(3), twist, twist, PERIOD, LIMITS, ring(needed + 0.012))


@given(st.floats(-0.8, 0.8), st.floats(-1.5, 1.5), st.sampled_from([PERIOD, 0.04, 0.3]))
@example(0.1, 0.12, 0.04)  # at the wanted speed in the middle of a step
def test_a_straight_way_is_never_underestimated(speed, wanted, hold):
    target, a = min(max(wanted, -0.8), 0.8), ROBOT.max_acceleration
    if speed * target < 0.0:
        return
    ramp = min(abs(target - speed) / a, hold)
    end = speed + math.copysign(a * ramp, target - speed)
    way = 0.5 * abs(speed + end) * ramp + abs(target) * (hold - ramp) + end**2 / (2.0 * a)
    path = motion(np.zeros(3), np.array((speed, 0.0)), np.array((wanted, 0.0)), hold, LIMITS)
    assert way - 1e-9 <= np.abs(np.diff(path[:, 0])).sum() <= way + 0.012


@pytest.mark.parametrize("omega", [2.0, -0.5])
def test_a_steady_turn_is_followed_along_its_circle(omega):
    twist = np.array((0.8, omega))
    path = motion(np.zeros(3), twist, twist, 0.6, LIMITS)
    held = path[np.abs(path[:, 2]) <= 0.6 * abs(omega) + 1e-9]
    assert len(held) > 50
    np.testing.assert_allclose(np.hypot(held[:, 0], held[:, 1] - 0.8 / omega), 0.8 / abs(omega), atol=1e-4)


def test_driving_backwards_is_sampled_as_finely_and_mirrors_driving_forwards():
    back, forth = (motion(np.zeros(3), np.zeros(2), np.array((v, 1.0)), 0.8, LIMITS) for v in (-0.8, 0.8))
    assert np.hypot(*np.diff(back[:, :2], axis=0).T).max() <= ROBOT.shape.sampling + 1e-9
    np.testing.assert_allclose(back * (-1.0, -1.0, 1.0), forth, atol=1e-12)


def test_what_the_robot_drives_through_during_the_delay_is_checked_too():
    """A gap in the star that is behind the robot when its command takes effect."""
    bearing = 2.0 * math.pi / 720 * np.arange(720)
    cut = CertifiedRegion(np.zeros(2), 0.0, np.where(np.abs(bearing - 0.5 * math.pi) < 0.1, 0.2, 5.0), np.zeros((0, 2)))
    pose, ahead = np.array((-0.3, 0.3, 0.0)), np.array((0.8, 0.0))
    assert certified(pose, ahead, ahead, PERIOD, LIMITS, OPEN, delay=0.5)
    assert certified(pose + (0.4, 0.0, 0.0), ahead, ahead, PERIOD, LIMITS, cut)
    assert not certified(pose, ahead, ahead, PERIOD, LIMITS, cut, delay=0.5)


def test_a_longer_hold_never_makes_a_straight_approach_safer():
    twist, holds, tried = np.array((0.8, 0.0)), np.array((0.02, 0.1, 0.3, 0.6)), np.arange(0.3, 1.5, 0.01)
    reaches = [next(r for r in tried if certified(np.zeros(3), twist, twist, h, LIMITS, ring(r))) for h in holds]
    np.testing.assert_allclose(np.diff(reaches), 0.8 * np.diff(holds), atol=0.011)


def test_the_certified_motion_keeps_the_speed_limits():
    beyond = np.array((2.0, 6.0))
    path = motion(np.zeros(3), SPEEDS, beyond, 0.3, LIMITS)
    np.testing.assert_allclose(path, motion(np.zeros(3), SPEEDS, SPEEDS, 0.3, LIMITS))
    for reach in np.arange(0.1, 0.8, 0.05):
        decided = {certified(np.zeros(3), SPEEDS, wanted, 0.3, LIMITS, ring(reach)) for wanted in (beyond, SPEEDS)}
        assert len(decided) == 1


def rectangle(length: float, width: float, ahead: float = 0.0) -> tuple:
    x, y = 0.5 * length, 0.5 * width
    return ((ahead - x, -y), (ahead + x, -y), (ahead + x, y), (ahead - x, y))


SHAPES = {
    "jackal": footprint(rectangle(0.508, 0.43)),
    "carrier": footprint(rectangle(0.8, 0.5)),
    "rear axle": footprint(rectangle(0.6, 0.3, 0.2)),
    "triangle": footprint(((0.35, 0.0), (-0.2, 0.25), (-0.2, -0.25))),
    "disc": disc(0.25),
    "ell": footprint((rectangle(0.6, 0.25), ((-0.3, -0.1), (-0.05, -0.1), (-0.05, 0.4), (-0.3, 0.4)))),
}


def seen_by(
    world: World, pose: np.ndarray, shape: Footprint, rng: np.random.Generator | None = None
) -> CertifiedRegion:
    """What two scans certify, the first from 2 cm behind, with noise if there is an `rng`."""
    memory = ScanMemory()
    for step in (-0.02, 0.0):
        place = pose + (step * math.cos(pose[2]), step * math.sin(pose[2]), 0.0)
        scan = cast(world, place, beams=720)
        scan = scan if rng is None else noisy(scan, NOISE, rng)
        radius = shape.narrow + MARGIN
        star, memory = certified_region(
            memory, scan, smoothed_distances(scan), place, radius, 2.0, (2.0 + 2.0 * radius, 5)
        )
    return star


def tried(seed: int, shape: Footprint, noise: bool, robot: RobotParameters) -> tuple[bool, float]:
    """Whether a random command beside random obstacles is accepted; and the least distance that it would keep, m."""
    rng = np.random.default_rng(seed)
    world = scattered(rng, discs=14, walls=8, clear=shape.narrow + 0.02)
    while True:
        pose = np.array((*rng.uniform(-0.6, 0.6, 2), rng.uniform(-math.pi, math.pi)))
        if body_clearance(world, pose[None], shape)[0] > MARGIN + 0.01:
            break
    limits, speeds = robot.limits, np.full(len(robot.drive.components), robot.max_speed)
    speeds[-1] = limits.max_yaw_rate
    twist, target = (robot.drive.saturated(rng.uniform(-speeds, speeds), limits) for _ in range(2))
    twist *= rng.random() < 0.5
    delay, hold = rng.choice((0.0, 0.02)), rng.choice((0.02, 0.1))
    motion = roll_out(pose, twist, target, Actuation(limits, shape, hold, delay, robot.drive))
    if not motion.grips:
        return False, math.inf
    star = seen_by(world, pose, shape, rng if noise else None)
    certificate = Clear(star, MARGIN, shape)
    poses = sweep(pose, (twist, target), (delay, hold), limits)
    return certificate.accepts(motion), float(least_distance(poses, shape.parts, shape.radius, *solid(world)))


@pytest.mark.parametrize(
    ("name", "base"),
    [*((name, "differential") for name in SHAPES), ("carrier", "omnidirectional"), ("ell", "omnidirectional"),
     ("jackal", "car"), ("rear axle", "car")],
)  # fmt: skip
@settings(max_examples=40)
@given(seed=seeds)
def test_what_is_accepted_touches_nothing(name, base, seed):
    accepts, least = tried(seed, SHAPES[name], True, ROBOTS[base])
    assert not accepts or least > 0.0


@pytest.mark.parametrize("name", ["jackal", "ell"])
def test_hardly_anything_safe_is_refused(name):
    outcomes = [tried(seed, SHAPES[name], False, ROBOTS["differential"]) for seed in range(150)]
    safe = [accepts for accepts, least in outcomes if MARGIN + 0.012 < least < math.inf]
    assert len(safe) > 40
    assert np.mean(safe) >= 0.97


def wall(gap: float) -> World:
    """A wall 0.1 m thick with a gap."""
    half, far = 0.5 * gap, 2.0
    above = np.array(((0.4, half), (0.5, half), (0.5, far), (0.4, far)))
    return World("wall", (0, 0, 0), (0, 0), polygons=(above, above * (1.0, -1.0)), bounds=(-3.0, -3.0, 3.0, 3.0))


def test_a_rectangle_fits_where_the_disc_around_it_does_not():
    shape, twist = SHAPES["jackal"], np.array((0.3, 0.0))
    for gap, fits in ((0.48, True), (0.45, False)):
        accepted = []
        for x in np.arange(-0.3, 1.0, 0.05):
            pose = np.array((x, 0.0, 0.0))
            star = seen_by(wall(gap), pose, shape)
            motion = roll_out(pose, twist, twist, Actuation(LIMITS, shape, PERIOD, 0.0))
            accepted.append(Clear(star, MARGIN, shape).accepts(motion))
        assert all(accepted) == fits
        assert gap < 2.0 * shape.radius


def test_nothing_is_accepted_without_a_scan_or_beyond_what_is_known():
    shape, pose = SHAPES["jackal"], np.zeros(3)
    standing = roll_out(pose, np.zeros(2), np.array((0.1, 0.0)), Actuation(LIMITS, shape, PERIOD, 0.0))
    assert not Clear(CertifiedRegion.none(), MARGIN, shape).accepts(standing)
    star = seen_by(wall(1.0), pose, shape)
    near = dataclasses.replace(star.look, reach=shape.radius - 0.01)  # even where the scan was taken
    blind = dataclasses.replace(star, values=np.zeros(4), look=near)
    assert not Clear(blind, MARGIN, shape).accepts(standing)
    fast = roll_out(
        pose + (1.5, 0.0, 0.0),
        np.array((0.8, 0.0)),
        np.array((0.8, 0.0)),
        Actuation(LIMITS, shape, 0.5, 0.0),
    )
    assert not Clear(star, MARGIN, shape).accepts(fast)


@pytest.mark.parametrize(("half", "yaw"), [(2.0, 0.0), (1.6, 2.0), (2.4, -2.5)])
@pytest.mark.parametrize("base", list(BASES))
def test_a_robot_backs_no_farther_than_what_it_has_seen(half, yaw, base):
    """With a limited view, towards a wall behind it that it has never seen; it may back to where it began."""
    robot, view = RobotParameters(base=base, footprint=[list(p) for p in rectangle(0.5, 0.4)]), f"{half:.3f}"
    overrides = [f"lidar.angle_min=-{view}", f"lidar.angle_max={view}"]
    scenario = dataclasses.replace(
        parse_scenario("world: !Obstacles {}", name="wall", overrides=overrides), robot=robot
    )
    normal = np.array((math.cos(yaw), math.sin(yaw)))
    along = 2.0 * np.array((-normal[1], normal[0]))
    behind = np.array((-normal + along, -normal - along, -1.1 * normal - along, -1.1 * normal + along))
    world = World("wall", (0, 0, yaw), (0, 0), polygons=(behind,), bounds=(-6.0, -6.0, 6.0, 6.0))
    motion = KinematicMotion(scenario, world, 0, True)
    back, forth = np.zeros((2, len(robot.drive.components)))
    back[0], forth[0] = -0.5, 0.5
    motion.drive(back, 3.0)
    assert motion.pose[:2] == pytest.approx(np.zeros(2), abs=0.02)  # within the disc in which it began
    motion.drive(forth, 3.0)
    assert motion.pose[:2] @ normal > 1.2
    motion.drive(back, 6.0)
    assert abs(motion.pose[:2] @ normal) < 0.05 and motion.least > 0.5


@pytest.mark.parametrize("half", [1.6, 2.3, 2.8])
def test_a_disc_backs_no_farther_than_it_has_seen(half):
    """Towards a post that stands where its lidar does not look, and never did."""
    post = World("post", (0, 0, 0), (3, 0), cylinders=[(-0.8, 0.0, 0.1)])
    settings, seen = PerceptionSettings(MARGINS, disc(RADIUS)), Perceived.nothing()
    backwards, accepted = np.array((-0.5, 0.0)), []
    for x in (0.0, 0.1, 0.4):
        pose = np.array((x, 0.0, 0.0))
        scan = cast(post, pose, angle_min=-half, angle_increment=2.0 * half / 359)
        scan = dataclasses.replace(scan, time=x)
        assert not np.isfinite(scan.ranges).any()
        seen = perceive(seen, (scan,), pose, settings)
        accepted.append(certified(pose, backwards, backwards, PERIOD, LIMITS, seen.safety))
    assert accepted == [False, False, True]  # it stops within 0.14 m


TEE = footprint((rectangle(0.55, 0.2, -0.075), ((0.15, -0.4), (0.3, -0.4), (0.3, 0.4), (0.15, 0.4))))


def looks_at(world: World, poses: np.ndarray, shape: Footprint, **view) -> CertifiedRegion:
    """What scans at poses (n, 3) certify, one after the other."""
    state, settings = Perceived.nothing(), PerceptionSettings(MARGINS, shape)
    for k, pose in enumerate(poses):
        scan = dataclasses.replace(cast(world, pose, beams=720, **view), time=0.1 * k)
        state = perceive(state, (scan,), pose, settings)
    return state.safety


@pytest.mark.parametrize("first", [0.0, -0.6])
def test_what_an_arm_hides_from_the_lidar_is_unknown_until_a_look_has_seen_it(first: float) -> None:
    """A post in the notch of a T hides the arm beside it, and a thinner post beyond, into which the arm may not drive.

    That a body begins in a shadow tells nothing of what else is there.
    """
    shape, base = TEE, BASES["omnidirectional"]
    world = World(
        "posts", (0, 0, 0), (0, 0), cylinders=[(0.1, 0.2, 0.01), (0.225, 0.45, 0.01)], bounds=(-3.0, -3.0, 3.0, 3.0)
    )
    way = np.append(np.arange(first, 0.0, 0.02), np.zeros(6))
    star = looks_at(world, np.column_stack((0.0 * way, way, 0.0 * way)), shape)
    certificate = Clear(star, MARGINS.safety, shape)
    acting, driven = Actuation(LIMITS, shape, PERIOD, 0.0, base), []
    for ahead in ((0.0, 0.3, 0.0), (0.0, -0.3, 0.0), (0.3, 0.0, 0.0)):
        pose, twist, target, steps = np.zeros(3), np.zeros(3), np.array(ahead), 0
        while steps < 40:
            motion = roll_out(pose, twist, target, acting)
            if not certificate.accepts(motion):
                break
            pose, steps = motion.pose[motion.braking], steps + 1
            twist = target * min(1.0, steps * PERIOD * LIMITS.max_acceleration / 0.3)
        rest = roll_out(pose, twist, np.zeros(3), acting).pose
        assert body_clearance(world, rest, shape).min() > 0.0
        driven.append(steps)
    if first == 0.0:
        assert max(driven) == 0  # one look has not seen the arms
    else:
        assert driven[0] < 40 and driven[1] == driven[2] == 40


@pytest.mark.parametrize("half", [0.5 * math.pi, 0.75 * math.pi])
@settings(max_examples=25)
@given(seed=seeds)
def test_a_limited_view_accepts_nothing_that_touches(half: float, seed: int) -> None:
    """Of a robot that came along a curve, where only the disc in which it began was free without a look."""
    rng = np.random.default_rng(seed)
    shape = SHAPES[rng.choice(list(SHAPES))]
    begin, turns = np.array((*rng.uniform(-1.0, 1.0, 2), rng.uniform(-3.0, 3.0))), rng.uniform(-1.5, 1.5)
    poses = [begin]
    for _ in range(12):
        x, y, yaw = poses[-1]
        poses.append(np.array((x + 0.05 * math.cos(yaw), y + 0.05 * math.sin(yaw), yaw + 0.1 * turns)))
    world = scattered(rng, discs=14, walls=8, clear=0.1)
    free = body_clearance(world, np.array(poses), shape).min() > MARGINS.safety + 0.01
    if not free or body_clearance(world, begin[None], disc(shape.radius + MARGINS.safety))[0] < 0.0:
        return
    star = looks_at(world, np.array(poses), shape, angle_min=-half, angle_increment=2.0 * half / 719)
    certificate, most = Clear(star, MARGINS.safety, shape), np.array((LIMITS.max_speed, LIMITS.max_yaw_rate))
    for _ in range(20):
        twist, target = rng.uniform(-most, most) * rng.integers(0, 2), rng.uniform(-most, most)
        motion = roll_out(poses[-1], twist, target, Actuation(LIMITS, shape, 0.1, 0.0))
        if certificate.accepts(motion):
            assert body_clearance(world, motion.pose, shape).min() > 0.0
