"""The shield through a context."""

import math

import numpy as np
import pytest
from pydrake.common.value import Value
from pydrake.systems.analysis import Simulator

from drake_starnav.control import ControllerParameters
from drake_starnav.errors import StarnavError
from drake_starnav.moving.kalman_tracks import Tracks
from drake_starnav.robot import RobotParameters
from drake_starnav.surroundings.surroundings import Surroundings
from drake_starnav.systems.twist_shield import TwistShield, Unshielded
from drake_starnav.utils.stopwatch import Stopwatch
from tests.helpers.motions import only_star
from tests.helpers.scans import MARGINS

WIDE = only_star(np.full(720, 5.0))
STEP = np.array((1.0, -4.0)) / ControllerParameters().rate
"""Of the twists that are ramped to below, at the robot's accelerations."""


def shielding(
    desired,
    surroundings: Surroundings = WIDE,
    pose=(0.0, 0.0, 0.0),
    kind=TwistShield,
    tracks: Tracks | None = None,
    controller: ControllerParameters | None = None,
    **changes,
) -> Simulator:
    needs = (RobotParameters(), controller or ControllerParameters(), *([MARGINS] if kind is TwistShield else []))
    system = kind(*needs, **changes)
    simulator = Simulator(system)
    inputs = {
        "desired_twist": desired,
        "surroundings": Value(surroundings),
        "state": [*pose, 0.0, 0.0],
        "tracks": Value(Tracks() if tracks is None else tracks),
    }
    for index in range(system.num_input_ports()):
        port = system.get_input_port(index)
        if port.get_name() in inputs:
            port.FixValue(simulator.get_mutable_context(), inputs[port.get_name()])
    return simulator


def out(simulator: Simulator, name: str):
    return simulator.get_system().GetOutputPort(name).Eval(simulator.get_context())


def test_a_free_twist_is_reached_at_the_robots_accelerations() -> None:
    simulator = shielding([0.5, -1.0])
    simulator.AdvanceTo(0.21)
    assert out(simulator, "twist_command") == pytest.approx(math.ceil(0.21 * ControllerParameters().rate) * STEP)
    simulator.AdvanceTo(1.0)
    assert out(simulator, "twist_command") == pytest.approx([0.5, -1.0])
    assert out(simulator, "certificate").certified


def test_before_anything_is_seen_it_stands() -> None:
    simulator = shielding([0.5, 0.0], Surroundings.unknown())
    simulator.AdvanceTo(0.5)
    assert out(simulator, "twist_command") == pytest.approx([0.0, 0.0])


@pytest.mark.parametrize(
    "desired, pose",
    [([np.nan, 0.0], (0.0, 0.0, 0.0)), ([0.1, 0.0], (0.0, np.inf, 0.0)), ([0.1, 0.0], (0.0, 0.0, np.nan))],
)
def test_what_is_not_finite_ends_the_simulation(desired, pose) -> None:
    with pytest.raises(StarnavError, match="desired_twist is .*; allowed: finite numbers"):
        shielding(desired, pose=pose).AdvanceTo(0.1)


@pytest.mark.parametrize("kind", [TwistShield, Unshielded])
def test_nobody_is_faster_than_the_robot_may_be(kind) -> None:
    simulator = shielding([5.0, -30.0], kind=kind)
    simulator.AdvanceTo(3.0)
    robot = RobotParameters()
    assert out(simulator, "twist_command") == pytest.approx([robot.max_speed, -robot.max_yaw_rate])


def test_without_the_shield_nothing_is_certified_and_nothing_held_back() -> None:
    simulator = shielding([0.5, -1.0], Surroundings.unknown(), kind=Unshielded)
    simulator.AdvanceTo(0.21)
    assert out(simulator, "twist_command") == pytest.approx(math.ceil(0.21 * ControllerParameters().rate) * STEP)
    assert not out(simulator, "certificate").certified


def test_the_first_command_is_sent_at_once_whatever_the_rate() -> None:
    simulator = shielding([0.5, -1.0], controller=ControllerParameters(rate=12.5))
    simulator.AdvanceTo(0.01)
    assert out(simulator, "twist_command") == pytest.approx([0.08, -0.32])


def test_the_certificate_shows_the_robot_braking_from_where_it_is_without_delay() -> None:
    pose, late = (1.0, 2.0, 0.5), ControllerParameters(delay=0.02)
    wide = only_star(np.full(720, 5.0), np.array(pose[:2]))
    simulator = shielding([0.6, 0.0], wide, pose, controller=late)
    simulator.AdvanceTo(1.0)
    path = out(simulator, "certificate").path
    assert path[0] == pytest.approx(pose)
    stopping = 0.5 * 0.6**2
    assert path[-1] == pytest.approx([1.0 + stopping * np.cos(0.5), 2.0 + stopping * np.sin(0.5), 0.5])


def test_commands_are_timed_where_they_are_asked_to_be() -> None:
    stopwatch = Stopwatch()
    shielding([0.5, 0.0], stopwatch=stopwatch).AdvanceTo(0.1)
    assert stopwatch.count("command") >= 0.1 * ControllerParameters().rate
