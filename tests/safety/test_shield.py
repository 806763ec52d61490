"""The shield: a free twist passes, one towards a wall is slowed down, and nothing unseen is driven into."""

import dataclasses
import math

import numpy as np
import pytest

from drake_starnav.robot import BASES, RobotParameters
from drake_starnav.robot.motion import roll_out
from drake_starnav.safety.clear import STOPPED_DISTANCE, ClearanceCertificate
from drake_starnav.safety.shield import find_certified_twist, ramp_twist, shield_twist
from drake_starnav.surroundings.surroundings import Surroundings
from tests.helpers.motions import actuation, only_star

ROBOT = RobotParameters()
REFUSING = type("Refusing", (), {"accepts": lambda self, motion: False})()


def wall() -> Surroundings:
    """A wall at x = 1 m, and free space up to 0.7 m for the robot's centre."""
    bearings = 2.0 * np.pi * np.arange(720) / 720
    values = np.where(np.cos(bearings) > 0.0, np.minimum(0.7 / np.maximum(np.cos(bearings), 1e-9), 5.0), 5.0)
    return only_star(values)


@pytest.mark.parametrize("base", list(BASES))
@pytest.mark.parametrize(  # more samples than there is room for at first; and wheels that slide
    ("acceleration", "braking"), [(0.5, 0.5), (4.0, 4.0)]
)
def test_the_ordinary_case_in_one_call_drives_what_the_certificates_do_one_by_one(base, acceleration, braking) -> None:
    robot = dataclasses.replace(ROBOT, base=base, max_speed=2.0, max_yaw_rate=4.0)
    robot = dataclasses.replace(robot, max_acceleration=acceleration, max_deceleration=braking)
    star, now, edge = (
        ClearanceCertificate(wall(), 0.0, robot.shape),
        actuation(robot, delay=0.05),
        0.7 - robot.shape.cover[:, 0].max(),
    )
    rng, size, ordinary, sliding = np.random.default_rng(1), len(robot.drive.components), 0, 0
    for _ in range(200):
        pose = np.array((edge - rng.uniform(0.0, 1.0 / braking), 0.0, 0.5 * rng.random()))
        twist, desired = (robot.drive.saturate(rng.uniform(-2.5, 2.5, size), robot.limits) for _ in range(2))
        target, certified = find_certified_twist(pose, twist, desired, (star,), now)
        driven, accepted = shield_twist(pose, twist, desired, (star,), now)
        assert accepted == certified
        np.testing.assert_array_equal(driven, ramp_twist(twist, target, now))
        assert not shield_twist(pose, twist, desired, (star, REFUSING), now)[1]
        assert not shield_twist(pose, twist, desired, (REFUSING,), now)[1]
        ordinary += certified and (target == desired).all()
        motion = roll_out(pose, twist, desired, now)
        sliding += star.accepts(motion) and not motion.grips
    assert 40 < ordinary < 180
    assert sliding > 5 or max(acceleration, braking) < 1.0


@pytest.mark.parametrize("braking", [0.4, 1.0, 4.0])
@pytest.mark.parametrize(("distance", "turns"), [(0.99 * STOPPED_DISTANCE, True), (1.01 * STOPPED_DISTANCE, False)])
def test_a_robot_that_may_drive_nowhere_turns_if_it_stops_within_a_millimetre(braking, distance, turns) -> None:
    robot = dataclasses.replace(ROBOT, max_deceleration=braking)
    twist, desired = np.array((math.sqrt(2.0 * braking * distance), 0.0)), np.array((0.5, 1.5))
    target, certified = find_certified_twist(np.zeros(3), twist, desired, (REFUSING,), actuation(robot))
    assert not certified
    assert tuple(target) == (0.0, 1.5 if turns else 0.0)
    square = dataclasses.replace(robot, footprint=[[0.2, 0.2], [-0.2, 0.2], [-0.2, -0.2], [0.2, -0.2]])
    target, _ = find_certified_twist(np.zeros(3), twist, desired, (REFUSING,), actuation(square))
    assert tuple(target) == (0.0, 0.0)  # its corners would cover new ground
    sideways = dataclasses.replace(robot, base="omnidirectional")
    twist, desired = np.array((0.0, twist[0], 0.0)), np.array((0.5, 0.5, 1.5))
    target, _ = find_certified_twist(np.zeros(3), twist, desired, (REFUSING,), actuation(sideways))
    assert tuple(target) == (0.0, 0.0, 1.5 if turns else 0.0)
    steering, steered = dataclasses.replace(robot, base="car"), np.array((0.0, 0.7))
    target, _ = find_certified_twist(np.zeros(3), steered, desired[1:], (REFUSING,), actuation(steering))
    assert tuple(target) == (0.0, 0.7)
