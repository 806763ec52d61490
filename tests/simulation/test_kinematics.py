"""The kinematic robot does what it is commanded, and its shield lets nothing touch it."""

import dataclasses
import math

import numpy as np
import pytest

from drake_starnav.geometry.footprint import disc
from drake_starnav.lidar.mounts import ON_AXIS, Mount
from drake_starnav.robot import BASES, RobotParameters
from drake_starnav.robot.motion import Actuation, roll_out
from drake_starnav.safety.certificates import standard_certificates
from drake_starnav.safety.shield import certified_twist, ramped_twist
from drake_starnav.scenario.margins import derive_margins
from drake_starnav.scenario.scenario_file import load_scenario, parse_scenario
from drake_starnav.simulation.kinematics import KinematicMotion
from drake_starnav.station.model_world import make_world_with_footprints
from drake_starnav.worlds.clearance import body_clearance
from drake_starnav.worlds.world import World
from scripts.experiments.random_drives import PACE, PLANT_ONLY, drawn

OPEN = World("open", (0, 0, 0.5), (0, 0), cylinders=[(3.0, 0.0, 0.2)])
SCENARIO = parse_scenario("world: !Obstacles {}", name="open")


@pytest.mark.parametrize("base", list(BASES))
def test_it_drives_as_its_base_is_commanded(base: str) -> None:
    robot = RobotParameters(base=base)
    motion = KinematicMotion(dataclasses.replace(SCENARIO, robot=robot), OPEN, 0, False)
    twist = np.array({"differential": (0.5, 1.0), "omnidirectional": (0.3, 0.4, 1.0), "car": (0.5, 2.0)}[base])
    motion.drive(twist, 1.0)
    begun = motion.pose
    np.testing.assert_allclose(motion.twist, twist, atol=1e-12)
    motion.drive(twist, 1.0)
    away = motion.pose - begun
    assert away[2] == pytest.approx(1.0)
    assert math.hypot(*away[:2]) == pytest.approx(2.0 * 0.5 * math.sin(0.5), rel=1e-3)  # a chord of its circle
    assert not motion.touched


@pytest.mark.parametrize("shield", [True, False])
@pytest.mark.parametrize("mounts", [(Mount(0.0, 0.0, 0.0, False),), (Mount(0.15, -0.1, 2.0, False),)])
def test_only_with_the_shield_it_stops_before_an_obstacle(shield: bool, mounts: tuple[Mount, ...]) -> None:
    motion = KinematicMotion(SCENARIO, OPEN, 0, shield, mounts)
    motion.put(np.zeros(3))
    motion.drive(np.array((0.8, 0.0)), 6.0)
    assert motion.touched is not shield
    assert 3.0 - 0.2 - 0.25 - motion.pose[0] == pytest.approx(motion.least, abs=0.02)
    assert 0.0 < motion.least < 0.08 if shield else motion.least < 0.0


@pytest.mark.parametrize("seed", [11, 13, 22, 6])
def test_each_command_is_decided_and_driven_as_the_shield_does_one_by_one(seed: int) -> None:
    """By discs and polygons of all bases, with one lidar, with two, and with one of a limited view."""
    case, rng = drawn(seed), np.random.default_rng(seed)
    kept = [text for text in case.overrides if not text.startswith(PLANT_ONLY)]
    scenario = load_scenario(case.scenario, overrides=[*kept, *(f"{key}={value}" for key, value in PACE.items())])
    mounts = tuple(mount._replace(upside_down=False) for mount in case.mounts.values()) or (ON_AXIS,)
    world = make_world_with_footprints(scenario.world, seed, scenario.robot.radius)
    motion, robot, control = KinematicMotion(scenario, world, seed, True, mounts), scenario.robot, scenario.controller
    act = Actuation(robot.limits, robot.shape, 1.0 / control.rate, control.delay, robot.drive)
    margin = derive_margins(scenario, mounts).safety
    most = np.array((*(robot.max_speed,) * (len(motion.twist) - 1), robot.limits.max_yaw_rate))
    low, high = np.reshape(world.extent, (2, 2))
    places = np.column_stack((rng.uniform(low, high, (4000, 2)), rng.uniform(-np.pi, np.pi, 4000)))
    clear = body_clearance(world, places, disc(robot.radius))
    motion.put(places[np.flatnonzero((clear > 0.04) & (clear < 0.1))[0]])
    for step in range(16):
        if step % 4 == 0:
            wish = most * np.sign(rng.uniform(-1.0, 1.0, len(most))) * (*(1.0,) * (len(most) - 1), 0.2)
        pose, twist, desired = motion.pose, motion.twist, robot.drive.saturated(wish, robot.limits)
        certificates = standard_certificates(motion.seen.safety, margin, act, pose[:2])
        poses = motion.burst(wish, 24)
        for after in [*poses, *([poses[-1]] if len(poses) < 24 else [])]:
            target, _ = certified_twist(pose, twist, desired, certificates, act)
            rolled = roll_out(pose, twist, target, act)
            pose, twist = rolled.pose[rolled.braking], ramped_twist(twist, target, act)
            assert pose.tolist() == after.tolist()
        assert twist.tolist() == motion.twist.tolist()
        motion.look()
    assert motion.asked > 50 and motion.changed + motion.braked > 0
