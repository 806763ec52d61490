"""The shield through a context."""

import numpy as np
import pytest
from pydrake.common.value import Value
from pydrake.systems.analysis import Simulator

from drake_starnav.control import ControllerParameters
from drake_starnav.errors import StarnavError
from drake_starnav.regions.safe_region import CertifiedRegion
from drake_starnav.robot import RobotParameters
from drake_starnav.systems.twist_shield import TwistShield, Unshielded
from drake_starnav.tracking import Tracks
from tests.helpers.scans import MARGINS

WIDE = CertifiedRegion(np.zeros(2), 0.0, np.full(720, 5.0), np.zeros((0, 2)))


def shielding(desired, star: CertifiedRegion = WIDE, pose=(0.0, 0.0, 0.0), kind=TwistShield, **changes) -> Simulator:
    needs = (RobotParameters(), ControllerParameters(), *([MARGINS] if kind is TwistShield else []))
    system = kind(*needs, **changes)
    simulator = Simulator(system)
    inputs = {
        "desired_twist": desired,
        "certified_region": Value(star),
        "state": [*pose, 0.0, 0.0],
        "tracks": Value(Tracks()),
    }
    for index in range(system.num_input_ports()):
        port = system.get_input_port(index)
        port.FixValue(simulator.get_mutable_context(), inputs[port.get_name()])
    return simulator


def out(simulator: Simulator, name: str):
    return simulator.get_system().GetOutputPort(name).Eval(simulator.get_context())


def test_a_free_twist_is_reached_at_the_robots_accelerations() -> None:
    simulator = shielding([0.5, -1.0])
    simulator.AdvanceTo(0.21)
    assert out(simulator, "twist_command") == pytest.approx([11 * 0.02, -11 * 0.08])
    simulator.AdvanceTo(1.0)
    assert out(simulator, "twist_command") == pytest.approx([0.5, -1.0])
    assert out(simulator, "certificate").certified


def test_before_anything_is_seen_it_stands() -> None:
    simulator = shielding([0.5, 0.0], CertifiedRegion.none())
    simulator.AdvanceTo(0.5)
    assert out(simulator, "twist_command") == pytest.approx([0.0, 0.0])


def test_a_twist_does_not_pass_in_the_same_instant() -> None:
    system = TwistShield(RobotParameters(), ControllerParameters(), MARGINS)
    assert not system.HasDirectFeedthrough(0)


@pytest.mark.parametrize("desired, pose", [([np.nan, 0.0], (0.0, 0.0, 0.0)), ([0.1, 0.0], (0.0, np.inf, 0.0))])
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
    simulator = shielding([0.5, -1.0], CertifiedRegion.none(), kind=Unshielded)
    simulator.AdvanceTo(0.21)
    assert out(simulator, "twist_command") == pytest.approx([11 * 0.02, -11 * 0.08])
    assert not out(simulator, "certificate").certified
