"""The controller and its shield: guidance is followed within limits, and nothing uncertain is driven into."""

import inspect

import numpy as np
import pytest
from pydrake.common.value import Value

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
from tests.helpers.scenes import moved

ROBOT, PARAMETERS = RobotParameters(), ControllerParameters()
WIDE = only_star(np.full(720, 5.0))
AHEAD = Guidance(np.array([[3.0, 0.0]]), False, RegionUnion.none())


def inputs(surroundings: Surroundings = WIDE, state=(0.0,) * 5) -> dict:
    return {"guidance": Value(AHEAD), "surroundings": Value(surroundings), "state": np.array(state)}


def test_a_controller_has_no_state_and_asks_for_the_last_twist_only_where_it_must_search() -> None:
    moving = DsmController(ROBOT, PARAMETERS, MARGINS, obstacles=DynamicObstacleParameters(max_speed=0.5))
    assert moving.HasInputPort("twist_command")
    assert not DsmController(ROBOT, PARAMETERS, MARGINS).HasInputPort("twist_command")
    context = moving.CreateDefaultContext()
    assert context.num_continuous_states() == context.num_discrete_state_groups() == 0
    # the plant would otherwise wait for the controller, which waits for the plant
    assert not TwistShield(ROBOT, PARAMETERS, MARGINS).HasDirectFeedthrough(0)


def test_certificate_path_is_where_the_robot_stops_when_sight_is_lost() -> None:
    """A perfect robot that follows the twists from then on ends where the certificate said."""
    systems, twist = (kind(ROBOT, PARAMETERS, MARGINS) for kind in (DsmController, TwistShield)), (0.8, 0.6)
    controlling = Controlling(*systems, inputs(Surroundings.unknown(), (0.0, 0.0, 0.0, *twist)), twist)
    assert not controlling.out("certificate").certified
    promised = controlling.out("certificate").path[-1]
    pose = np.zeros(3)
    for _ in range(60):
        before, twist = twist, controlling.update()
        pose = moved(pose, 0.5 * (twist + before), PERIOD)
        controlling.put("state", [*pose, *twist])
    assert twist[0] == 0.0
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
