"""The kinematic robot does what it is commanded, and its shield lets nothing touch it."""

import dataclasses
import math

import numpy as np
import pytest

from drake_starnav.lidar.mounts import Mount
from drake_starnav.robot import BASES, RobotParameters
from drake_starnav.scenario.scenario_file import parse_scenario
from drake_starnav.simulation.kinematics import KinematicMotion
from drake_starnav.worlds.world import World

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
