"""The controller and its shield: guidance is followed within limits, and nothing uncertain is driven into."""

import inspect
import math

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from pydrake.common.value import Value
from pydrake.systems.framework import LeafSystem

from drake_starnav.control import ControllerParameters
from drake_starnav.moving.kalman_tracks import Tracks
from drake_starnav.moving.parameters import DynamicObstacleParameters
from drake_starnav.planning.guidance import Guidance
from drake_starnav.robot import RobotParameters
from drake_starnav.surroundings.region_union import RegionUnion
from drake_starnav.surroundings.surroundings import Surroundings
from drake_starnav.systems.dsm_controller import DsmController
from drake_starnav.systems.twist_shield import TwistShield
from tests.helpers.controlling import PERIOD, Controlling
from tests.helpers.motions import only_star
from tests.helpers.scans import MARGINS

ROBOT, PARAMETERS = RobotParameters(), ControllerParameters()
WIDE = only_star(np.full(720, 5.0))
AHEAD = Guidance(np.array([[3.0, 0.0]]), False, RegionUnion.none())


def inputs(guidance: Guidance = AHEAD, surroundings: Surroundings = WIDE, state=(0.0,) * 5) -> dict:
    return {"guidance": Value(guidance), "surroundings": Value(surroundings), "state": np.array(state)}


def controlling_of(
    guidance: Guidance = AHEAD, surroundings: Surroundings = WIDE, *, twist=(0.0, 0.0), pose=(0.0, 0.0, 0.0)
) -> Controlling:
    systems = DsmController(ROBOT, PARAMETERS, MARGINS), TwistShield(ROBOT, PARAMETERS, MARGINS)
    return Controlling(*systems, inputs(guidance, surroundings, (*pose, *twist)), twist)


def names(system: LeafSystem) -> tuple[list[str], list[str]]:
    inward = [system.get_input_port(k).get_name() for k in range(system.num_input_ports())]
    return inward, [system.get_output_port(k).get_name() for k in range(system.num_output_ports())]


def test_ports() -> None:
    """A controller has no state; of the twist commanded last it asks only where it must search."""
    inward, outward = names(DsmController(ROBOT, PARAMETERS, MARGINS))
    assert inward == ["guidance", "surroundings", "state"]
    assert outward == ["desired_twist", "guiding_vector"]
    moving = DsmController(ROBOT, PARAMETERS, MARGINS, obstacles=DynamicObstacleParameters(max_speed=0.5))
    assert names(moving)[0] == [*inward, "tracks", "twist_command"]
    assert moving.CreateDefaultContext().num_continuous_states() == 0
    assert moving.CreateDefaultContext().num_discrete_state_groups() == 0
    # the plant would otherwise wait for the controller, which waits for the plant
    assert not TwistShield(ROBOT, PARAMETERS, MARGINS).HasDirectFeedthrough(0)


def test_stands_before_the_first_update_and_without_guidance() -> None:
    controlling = controlling_of(Guidance.none())
    assert np.array_equal(controlling.out("twist_command"), np.zeros(2))
    for _ in range(5):
        assert np.array_equal(controlling.update(), np.zeros(2))
    assert np.array_equal(controlling.out("guiding_vector"), np.zeros(2))


@given(v=st.floats(0.15, 0.8), omega=st.floats(-2.0, 2.0))
def test_without_a_certified_region_it_brakes_and_says_so(v, omega) -> None:
    controlling = controlling_of(AHEAD, Surroundings.unknown(), twist=(v, omega))
    braked = controlling.update()
    assert not controlling.out("certificate").certified
    change = ROBOT.max_yaw_acceleration * PERIOD
    expected = (v - PERIOD * ROBOT.max_acceleration, math.copysign(max(abs(omega) - change, 0.0), omega))
    assert braked == pytest.approx(expected, abs=1e-12)
    assert controlling.update(100)[0] == 0.0


def test_certificate_path_is_where_the_robot_stops_when_sight_is_lost() -> None:
    """A perfect robot that follows the twists from then on ends where the certificate said."""
    controlling = controlling_of(AHEAD, Surroundings.unknown(), twist=(0.8, 0.6))
    promised = controlling.out("certificate").path[-1]
    pose = np.zeros(3)
    v, omega = 0.8, 0.6
    for _ in range(60):
        after = controlling.update()
        v, omega = 0.5 * (v + after[0]), 0.5 * (omega + after[1])
        heading = pose[2] + 0.5 * omega * PERIOD
        pose += PERIOD * np.array([v * math.cos(heading), v * math.sin(heading), omega])
        controlling.put("state", [*pose, *after])
        v, omega = after
    assert v == 0.0
    assert np.hypot(*(pose[:2] - promised[:2])) < 0.02


@pytest.mark.parametrize("lead", [0.0, 0.3])
@pytest.mark.parametrize("kind", [DsmController, TwistShield])
def test_what_moves_is_as_old_as_its_scan_when_the_command_takes_effect(kind, lead: float, monkeypatch) -> None:
    def note(surroundings, margin, actuation, position, tracked):
        ages.append(tracked.age)
        return ()

    ages: list[float] = []
    monkeypatch.setattr(inspect.getmodule(kind), "make_certificates", note)
    moving = DynamicObstacleParameters(max_speed=0.5)
    controller = DsmController(ROBOT, PARAMETERS, MARGINS, obstacles=moving, state_lead=lead)
    shield = TwistShield(ROBOT, PARAMETERS, MARGINS, obstacles=moving, state_lead=lead)
    controlling = Controlling(controller, shield, {**inputs(), "tracks": Value(Tracks(-0.05))})
    controlling.simulator.AdvanceTo(1.5 * PERIOD)
    assert ages == pytest.approx([0.05 + lead, 0.05 + PERIOD + lead])
