"""The certificate with bodies of all shapes, and with views that do not reach all around."""

import dataclasses
import math

import numpy as np
import pytest
from hypothesis import given, settings

from drake_starnav.geometry.footprint import Footprint, disc, footprint
from drake_starnav.geometry.se2 import compose_poses, transform_points
from drake_starnav.lidar.mounts import ON_AXIS, Mount
from drake_starnav.robot import BASES, RobotParameters
from drake_starnav.robot.motion import Actuation, roll_out
from drake_starnav.safety.clear import ClearanceCertificate
from drake_starnav.scenario.margins import derive_margins
from drake_starnav.scenario.scenario_file import parse_scenario
from drake_starnav.surroundings.certified_star import CertifiedStar
from drake_starnav.surroundings.perception import PerceptionSettings, PerceptionState, perceive
from drake_starnav.surroundings.surroundings import Surroundings
from drake_starnav.surroundings.unseen import find_initial_disc_radius
from drake_starnav.surroundings.view_history import ViewHistory
from drake_starnav.utils.snapshot import replace_fields
from drake_starnav.worlds.clearance import compute_body_clearance
from drake_starnav.worlds.world import World
from tests.helpers.kinematic_robot import KinematicRobot
from tests.helpers.motions import certified, exact_poses
from tests.helpers.scans import MARGINS, RADIUS, cast, noisy, observe_scan, scattered, seeds

ROBOT = RobotParameters()
LIMITS = ROBOT.limits
PERIOD, MARGIN, NOISE = 0.02, 0.0145, 0.01
ROBOTS = {name: RobotParameters(base=name) for name in BASES}


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


def seen_by(world: World, pose: np.ndarray, shape: Footprint, rng: np.random.Generator | None = None) -> Surroundings:
    """What two scans certify, the first from 2 cm behind, with noise if there is an `rng`."""
    seen = Surroundings.unknown()
    for step in (-0.02, 0.0):
        place = pose + (step * math.cos(pose[2]), step * math.sin(pose[2]), 0.0)
        scan = cast(world, place, beams=720)
        scan = scan if rng is None else noisy(scan, NOISE, rng)
        seen = observe_scan(scan, place, shape.cover_radius + MARGIN, 2.0, seen, shape)
    return replace_fields(seen, past_views=ViewHistory())  # the last view alone


def tried(seed: int, shape: Footprint, noise: bool, robot: RobotParameters) -> tuple[bool, float]:
    """Whether a random command beside random obstacles is accepted; and the least distance that it would keep, m."""
    rng = np.random.default_rng(seed)
    world = scattered(rng, discs=14, walls=8, clear=shape.cover_radius + 0.02)
    while True:
        pose = np.array((*rng.uniform(-0.6, 0.6, 2), rng.uniform(-math.pi, math.pi)))
        if compute_body_clearance(world, pose[None], shape)[0] > MARGIN + 0.01:
            break
    limits, speeds = robot.limits, np.full(len(robot.drive.components), robot.max_speed)
    speeds[-1] = limits.max_yaw_rate
    twist, target = (robot.drive.saturate(rng.uniform(-speeds, speeds), limits) for _ in range(2))
    twist *= rng.random() < 0.5
    delay, hold = rng.choice((0.0, 0.02)), rng.choice((0.02, 0.1))
    actuation = Actuation(limits, shape, hold, delay, robot.drive)
    motion = roll_out(pose, twist, target, actuation)
    if not motion.grips:
        return False, math.inf
    star = seen_by(world, pose, shape, rng if noise else None)
    certificate = ClearanceCertificate(star, MARGIN, shape)
    x, y, yaw = exact_poses(twist, target, actuation)[::20].T
    poses = np.column_stack((transform_points(pose, np.column_stack((x, y))), pose[2] + yaw))
    return certificate.accepts(motion), float(compute_body_clearance(world, poses, shape).min())


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


def test_nothing_is_accepted_without_a_scan_or_beyond_what_is_known():
    shape, pose = SHAPES["jackal"], np.zeros(3)
    standing = roll_out(pose, np.zeros(2), np.array((0.1, 0.0)), Actuation(LIMITS, shape, PERIOD, 0.0))
    assert not ClearanceCertificate(Surroundings.unknown(), MARGIN, shape).accepts(standing)
    star = seen_by(World("hall", (0, 0, 0), (0, 0), bounds=(-3.0, -3.0, 3.0, 3.0)), pose, shape)
    near = replace_fields(star.view, reach=shape.radius - 0.01)  # even where the scan was taken
    views = star.current_views._replace(views=(near,))
    blind = replace_fields(star, certified_star=CertifiedStar.none(), current_views=views)
    assert not ClearanceCertificate(blind, MARGIN, shape).accepts(standing)
    ahead = np.array((0.8, 0.0))
    fast = roll_out(pose + (1.5, 0.0, 0.0), ahead, ahead, Actuation(LIMITS, shape, 0.5, 0.0))
    assert not ClearanceCertificate(star, MARGIN, shape).accepts(fast)


@pytest.mark.parametrize(
    ("base", "half", "yaw"), [("differential", 2.0, 0.0), ("omnidirectional", 1.6, 2.0), ("car", 2.4, -2.5)]
)
def test_a_robot_backs_no_farther_than_what_it_has_seen(base, half, yaw):
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
    motion = KinematicRobot(scenario, world, 0)
    back, forth = np.zeros((2, len(robot.drive.components)))
    back[0], forth[0] = -0.5, 0.5
    motion.drive(back, 3.0)
    assert motion.pose[:2] == pytest.approx(np.zeros(2), abs=0.02)  # within the disc in which it began
    motion.drive(forth, 3.0)
    assert motion.pose[:2] @ normal > 1.2
    motion.drive(back, 6.0)
    assert abs(motion.pose[:2] @ normal) < 0.05 and motion.least > 0.5


@pytest.mark.parametrize(
    ("name", "mount"),
    [("carrier", Mount(0.0, 0.0, 0.0, False)), *((name, Mount(0.15, 0.05, 0.2, False)) for name in SHAPES)],
)
def test_where_a_robot_has_driven_it_may_drive_back_and_turn(name: str, mount: Mount) -> None:
    """With a view of 270 degrees, in the open: what it has seen or stood on is not forgotten while it manoeuvres."""
    overrides = ["lidar.angle_min=-2.356", "lidar.angle_max=2.356", "lidar.beams=180"]
    scenario = parse_scenario("world: !Obstacles {}", name="open", overrides=overrides)
    corners = [list(map(list, part)) for part in SHAPES[name].parts]
    robot = RobotParameters(footprint=corners[0] if len(corners) == 1 else corners)
    world = World("open", (0, 0, 0), (0, 0), cylinders=[(2.5, 2.0, 0.2), (1.0, -2.0, 0.2)])
    motion = KinematicRobot(dataclasses.replace(scenario, robot=robot), world, 0, (mount,))
    for speed, turning, time in ((0.6, 0.0, 3.0), (-0.6, 0.0, 2.0), (0.0, 2.0, 1.5), (0.4, 0.0, 1.2)):
        before = motion.pose
        motion.drive(np.array((speed, turning)), time)
        moved = math.dist(motion.pose[:2], before[:2]) + abs(motion.pose[2] - before[2])
        assert moved > 0.6 * time * (abs(speed) + abs(turning)), (speed, turning, moved)
        motion.drive(np.zeros(2), 1.0)
    begun = motion.pose[2]
    for side in (1.0, -1.0) * 4:
        motion.drive(np.array((0.0, side)), 0.7)
        motion.drive(np.array((0.1, -side)), 0.7)
    motion.drive(np.array((0.0, 2.0)), 3.3)
    assert motion.pose[2] - begun > 5.0


@pytest.mark.parametrize("half", [1.6, 2.3, 2.8])
def test_a_disc_backs_no_farther_than_it_has_seen(half):
    """Towards a post that stands where its lidar does not look, and never did."""
    post = World("post", (0, 0, 0), (3, 0), cylinders=[(-0.8, 0.0, 0.1)])
    settings, seen = PerceptionSettings(MARGINS, disc(RADIUS)), PerceptionState.initial()
    backwards, accepted = np.array((-0.5, 0.0)), []
    for x in (0.0, 0.1, 0.4):
        pose = np.array((x, 0.0, 0.0))
        scan = cast(post, pose, angle_min=-half, angle_increment=2.0 * half / 359)
        scan = dataclasses.replace(scan, time=x)
        assert not np.isfinite(scan.ranges).any()
        seen = perceive(seen, (scan,), pose, settings)
        accepted.append(certified(pose, backwards, backwards, PERIOD, LIMITS, seen.surroundings))
    assert accepted == [False, False, True]  # it stops within 0.14 m


TEE = footprint((rectangle(0.55, 0.2, -0.075), ((0.15, -0.4), (0.3, -0.4), (0.3, 0.4), (0.15, 0.4))))


def looks_at(world: World, poses: np.ndarray, shape: Footprint, mount: Mount = ON_AXIS, **view: float) -> Surroundings:
    """What scans at poses (n, 3) certify, one after the other."""
    state, settings = PerceptionState.initial(), PerceptionSettings(MARGINS, shape, (mount,))
    for k, pose in enumerate(poses):
        scan = dataclasses.replace(cast(world, compose_poses(pose, mount[:3]), beams=720, **view), time=0.1 * k)
        state = perceive(state, (scan,), pose, settings)
    return state.surroundings


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
    certificate = ClearanceCertificate(star, MARGINS.safety, shape)
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
        assert compute_body_clearance(world, rest, shape).min() > 0.0
        driven.append(steps)
    assert driven[0] < (40 if first else 1)  # one look alone has not seen what is beside the arms: it may leave that
    assert driven[1] == driven[2] == 40


@pytest.mark.parametrize(
    ("half", "mount"),
    [
        *((half, ON_AXIS) for half in (0.5 * math.pi, 0.75 * math.pi)),
        *((half, Mount(0.2, 0.0, 0.0, False)) for half in (0.5 * math.pi, 0.75 * math.pi)),
        (0.75 * math.pi, Mount(0.2, -0.2, -0.25 * math.pi, False)),
    ],
)
@settings(max_examples=40)
@given(seed=seeds)
def test_a_limited_view_accepts_nothing_that_touches(half: float, mount: Mount, seed: int) -> None:
    """Of a robot that came along a curve, where only the disc in which it began was free without a look."""
    rng = np.random.default_rng(seed)
    shape = SHAPES[rng.choice(list(SHAPES))]
    begin, turns = np.array((*rng.uniform(-1.0, 1.0, 2), rng.uniform(-3.0, 3.0))), rng.uniform(-1.5, 1.5)
    poses = [begin]
    for _ in range(12):
        x, y, yaw = poses[-1]
        poses.append(np.array((x + 0.05 * math.cos(yaw), y + 0.05 * math.sin(yaw), yaw + 0.1 * turns)))
    world = scattered(rng, discs=14, walls=8, clear=0.1)
    free = compute_body_clearance(world, np.array(poses), shape).min() > MARGINS.safety + 0.01
    start = disc(find_initial_disc_radius(shape, MARGINS.safety, mount.x))
    if not free or compute_body_clearance(world, begin[None], start)[0] < 0.0:
        return
    star = looks_at(world, np.array(poses), shape, mount, angle_min=-half, angle_increment=2.0 * half / 719)
    certificate = ClearanceCertificate(star, MARGINS.safety, shape)
    most = np.array((LIMITS.max_speed, LIMITS.max_yaw_rate))
    for _ in range(20):
        twist, target = rng.uniform(-most, most) * rng.integers(0, 2), rng.uniform(-most, most)
        motion = roll_out(poses[-1], twist, target, Actuation(LIMITS, shape, 0.1, 0.0))
        if certificate.accepts(motion):
            assert compute_body_clearance(world, motion.pose, shape).min() > 0.0


@pytest.mark.parametrize(
    ("name", "half", "mount"),
    [
        ("carrier", 0.75 * math.pi, Mount(0.2, 0.0, 0.0, False)),
        ("jackal", 0.75 * math.pi, Mount(0.15, -0.15, -0.25 * math.pi, False)),
        ("ell", 0.5 * math.pi, Mount(0.2, 0.0, 0.0, False)),
        ("disc", 0.75 * math.pi, Mount(0.15, -0.15, -0.25 * math.pi, False)),
    ],
)
def test_no_driver_comes_nearer_than_the_margin_to_what_was_never_seen(name: str, half: float, mount: Mount) -> None:
    """One that backs and turns at random among posts close to where it began; it keeps the margin at all samples."""
    view = [f"lidar.angle_min={-half}", f"lidar.angle_max={half}", "lidar.beams=361", "lidar.noise=0"]
    corners = [list(map(list, part)) for part in SHAPES[name].parts]
    robot = RobotParameters(footprint=corners[0] if len(corners) == 1 else corners)
    scenario = parse_scenario("world: !Obstacles {}", name="posts", overrides=view)
    scenario = dataclasses.replace(scenario, robot=robot)
    margin = derive_margins(scenario, (mount,)).safety
    free = find_initial_disc_radius(robot.shape, margin, mount.x) + 0.02
    for seed in range(2):
        rng, far = np.random.default_rng(seed), free + 0.35
        posts = []
        for bearing, radius, away in rng.uniform((-math.pi, 0.03, 0.0), (math.pi, 0.15, 0.3), (10, 3)):
            away += free + radius
            posts.append((away * math.cos(bearing), away * math.sin(bearing), radius))
        begin = (0.0, 0.0, float(rng.uniform(-3.0, 3.0)))
        world = World("posts", begin, (0, 0), cylinders=posts, bounds=(-far, -far, far, far))
        motion = KinematicRobot(scenario, world, seed, (mount,))
        for _ in range(15):
            speed, turning = rng.uniform(-0.4, 0.4), rng.uniform(-1.2, 1.2)
            motion.drive(np.array((-abs(speed) if rng.random() < 0.5 else speed, turning)), rng.uniform(0.3, 1.0))
        assert motion.least > margin - 0.5 * robot.shape.sampling
