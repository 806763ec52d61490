"""The shield through a context."""

import math

import numpy as np
import pytest

from drake_starnav.control import ControllerParameters
from drake_starnav.errors import StarnavError
from drake_starnav.robot import RobotParameters
from drake_starnav.surroundings.surroundings import Surroundings
from drake_starnav.systems.twist_shield import TwistShield, Unshielded
from drake_starnav.utils.stopwatch import Stopwatch
from tests.helpers.alone import Alone
from tests.helpers.motions import only_star
from tests.helpers.scans import MARGINS

WIDE, CONTROLLER = only_star(np.full(720, 5.0)), ControllerParameters()
STEP = np.array((1.0, -4.0)) / CONTROLLER.rate
"""Of the twists that are ramped to below, at the robot's accelerations."""


def shielding(
    desired, surroundings: Surroundings = WIDE, pose=(0.0, 0.0, 0.0), kind=TwistShield, controller=CONTROLLER, **changes
) -> Alone:
    needs, seen = ([MARGINS], {"surroundings": surroundings}) if kind is TwistShield else ([], {})
    system = kind(RobotParameters(), controller, *needs, **changes)
    return Alone(system, desired_twist=desired, state=[*pose, 0.0, 0.0], **seen)


def test_a_free_twist_is_reached_at_the_robots_accelerations() -> None:
    shield = shielding([0.5, -1.0])
    shield.simulator.AdvanceTo(0.21)
    assert shield.out("twist_command") == pytest.approx(math.ceil(0.21 * ControllerParameters().rate) * STEP)
    shield.simulator.AdvanceTo(1.0)
    assert shield.out("twist_command") == pytest.approx([0.5, -1.0])
    assert shield.out("certificate").certified


def test_before_anything_is_seen_it_stands() -> None:
    shield = shielding([0.5, 0.0], Surroundings.unknown())
    shield.simulator.AdvanceTo(0.5)
    assert shield.out("twist_command") == pytest.approx([0.0, 0.0])


@pytest.mark.parametrize(
    "desired, pose",
    [([np.nan, 0.0], (0.0, 0.0, 0.0)), ([0.1, 0.0], (0.0, np.inf, 0.0)), ([0.1, 0.0], (0.0, 0.0, np.nan))],
)
def test_what_is_not_finite_ends_the_simulation(desired, pose) -> None:
    with pytest.raises(StarnavError, match="desired_twist is .*; allowed: finite numbers"):
        shielding(desired, pose=pose).advance(0.1)


@pytest.mark.parametrize("kind", [TwistShield, Unshielded])
def test_nobody_is_faster_than_the_robot_may_be(kind) -> None:
    shield = shielding([5.0, -30.0], kind=kind)
    shield.simulator.AdvanceTo(3.0)
    robot = RobotParameters()
    assert shield.out("twist_command") == pytest.approx([robot.max_speed, -robot.max_yaw_rate])


def test_without_the_shield_nothing_is_certified_and_nothing_held_back() -> None:
    shield = shielding([0.5, -1.0], Surroundings.unknown(), kind=Unshielded)
    shield.simulator.AdvanceTo(0.21)
    assert shield.out("twist_command") == pytest.approx(math.ceil(0.21 * ControllerParameters().rate) * STEP)
    assert not shield.out("certificate").certified


def test_the_first_command_is_sent_at_once_whatever_the_rate() -> None:
    shield = shielding([0.5, -1.0], controller=ControllerParameters(rate=12.5))
    shield.simulator.AdvanceTo(0.01)
    assert shield.out("twist_command") == pytest.approx([0.08, -0.32])


def test_the_certificate_shows_the_robot_braking_from_where_it_is_without_delay() -> None:
    pose, late = (1.0, 2.0, 0.5), ControllerParameters(delay=0.02)
    wide = only_star(np.full(720, 5.0), np.array(pose[:2]))
    shield = shielding([0.6, 0.0], wide, pose, controller=late)
    shield.simulator.AdvanceTo(1.0)
    path = shield.out("certificate").path
    assert path[0] == pytest.approx(pose)
    stopping = 0.5 * 0.6**2
    assert path[-1] == pytest.approx([1.0 + stopping * np.cos(0.5), 2.0 + stopping * np.sin(0.5), 0.5])


def test_commands_are_timed_where_they_are_asked_to_be() -> None:
    stopwatch = Stopwatch()
    shielding([0.5, 0.0], stopwatch=stopwatch).advance(0.1)
    assert stopwatch.count("command") >= 0.1 * ControllerParameters().rate
