"""The certificate of polygons touches nothing and stays in seen space, and refuses hardly anything that is safe."""

import dataclasses
import math

import numpy as np
import pytest
from hypothesis import given, settings

from drake_starnav.control.braking_certificate import StarCertificate
from drake_starnav.control.certificates import AnyOf
from drake_starnav.control.footprint_certificate import FootprintCertificate
from drake_starnav.control.motion import Actuation, roll_out
from drake_starnav.geometry.footprint import Footprint, footprint
from drake_starnav.regions.erosion import smoothed_distances
from drake_starnav.regions.safe_region import CertifiedRegion, ScanMemory, certified_region
from drake_starnav.robot import BASES, RobotParameters
from drake_starnav.scenario.scenario_file import parse_scenario
from drake_starnav.simulation.kinematics import KinematicMotion
from drake_starnav.worlds.clearance import body_clearance
from drake_starnav.worlds.world import World
from scripts.experiments.footprint_soundness import least_distance, solid, sweep
from tests.helpers.scans import cast, noisy, scattered, seeds

ROBOTS = {name: RobotParameters(base=name) for name in BASES}
LIMITS = ROBOTS["differential"].limits
MARGIN, PERIOD, REACH, NOISE = 0.0145, 0.02, 2.0, 0.01


def rectangle(length: float, width: float, ahead: float = 0.0) -> tuple:
    x, y = 0.5 * length, 0.5 * width
    return ((ahead - x, -y), (ahead + x, -y), (ahead + x, y), (ahead - x, y))


SHAPES = {
    "jackal": footprint(rectangle(0.508, 0.43)),
    "carrier": footprint(rectangle(0.8, 0.5)),
    "rear axle": footprint(rectangle(0.6, 0.3, 0.2)),
    "triangle": footprint(((0.35, 0.0), (-0.2, 0.25), (-0.2, -0.25))),
    "ell": footprint((rectangle(0.6, 0.25), ((-0.3, -0.1), (-0.05, -0.1), (-0.05, 0.4), (-0.3, 0.4)))),
}


def sensed(world: World, pose: np.ndarray, shape: Footprint, rng: np.random.Generator | None = None) -> CertifiedRegion:
    """What two scans certify, the first from 2 cm behind, with noise if there is an `rng`."""
    memory = ScanMemory()
    for step in (-0.02, 0.0):
        place = pose + (step * math.cos(pose[2]), step * math.sin(pose[2]), 0.0)
        scan = cast(world, place, beams=720)
        scan = scan if rng is None else noisy(scan, NOISE, rng)
        radius = shape.narrow + MARGIN
        star, memory = certified_region(
            memory, scan, smoothed_distances(scan), place, radius, REACH, (REACH + 2.0 * radius, 5)
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
    star = sensed(world, pose, shape, rng if noise else None)
    certificate = AnyOf((StarCertificate(star), FootprintCertificate(star, MARGIN, shape)))
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
            star = sensed(wall(gap), pose, shape)
            motion = roll_out(pose, twist, twist, Actuation(LIMITS, shape, PERIOD, 0.0))
            accepted.append(FootprintCertificate(star, MARGIN, shape).accepts(motion))
        assert all(accepted) == fits
        assert gap < 2.0 * shape.radius


def test_nothing_is_accepted_without_a_scan_or_beyond_what_is_known():
    shape, pose = SHAPES["jackal"], np.zeros(3)
    standing = roll_out(pose, np.zeros(2), np.array((0.1, 0.0)), Actuation(LIMITS, shape, PERIOD, 0.0))
    assert not FootprintCertificate(CertifiedRegion.none(), MARGIN, shape).accepts(standing)
    star = sensed(wall(1.0), pose, shape)
    blind = dataclasses.replace(star, reach=shape.radius - 0.01)  # even where the scan was taken
    assert not FootprintCertificate(blind, MARGIN, shape).accepts(standing)
    fast = roll_out(
        pose + (1.5, 0.0, 0.0),
        np.array((0.8, 0.0)),
        np.array((0.8, 0.0)),
        Actuation(LIMITS, shape, 0.5, 0.0),
    )
    assert not FootprintCertificate(star, MARGIN, shape).accepts(fast)


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
    assert motion.pose[:2] == pytest.approx(np.zeros(2), abs=1e-6)
    motion.drive(forth, 3.0)
    assert motion.pose[:2] @ normal > 1.2
    motion.drive(back, 6.0)
    assert abs(motion.pose[:2] @ normal) < 0.05 and motion.least > 0.5
