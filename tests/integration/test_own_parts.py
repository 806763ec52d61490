"""Systems of the user's own in the loop: controllers, planners, shields and certificates."""

import numpy as np
import pytest
from pydrake.common.value import Value
from pydrake.systems.analysis import Simulator
from pydrake.systems.framework import DiagramBuilder, LeafSystem
from pydrake.systems.primitives import LogVectorOutput

from drake_starnav.navigation import Navigation, Parts, add_navigation
from drake_starnav.planning.guidance import Guidance
from drake_starnav.safety.zones import KeepOut, SpeedZone
from drake_starnav.systems.star_roadmap_planner import StarRoadmapPlanner
from drake_starnav.systems.twist_shield import TwistShield
from tests.helpers.posts import GOALS, posts


class Pursuit(LeafSystem):
    """Drives straight towards the short-term goal, whatever stands there."""

    def __init__(self, *names: str) -> None:
        super().__init__()
        self._state = self.DeclareVectorInputPort("state", 5)
        self._target = self.DeclareVectorInputPort(*names or ("short_term_goal",), 2)
        self.DeclareVectorOutputPort("desired_twist", 2, self._calc_twist)

    def _calc_twist(self, context, output) -> None:
        x, y, yaw, _, _ = self._state.Eval(context)
        ahead = complex(*(self._target.Eval(context) - (x, y))) * np.exp(-1j * yaw)
        output.SetFromVector([min(0.6, max(0.0, ahead.real)), 2.0 * np.angle(ahead)])


class Beeline(LeafSystem):
    """Guidance straight to the goal."""

    def __init__(self) -> None:
        super().__init__()
        self._goal = self.DeclareVectorInputPort("goal", 2)
        self.DeclareAbstractOutputPort("guidance", lambda: Value(Guidance.none()), self._calc_guidance)

    def _calc_guidance(self, context, output) -> None:
        output.set_value(Guidance.along(self._goal.Eval(context)[None, :]))


def driven(time: float, scenario=None, **own) -> tuple[np.ndarray, Navigation, Simulator]:
    """The robot's last pose, and what drove it."""
    builder = DiagramBuilder()
    navigation = add_navigation(builder, scenario or posts(), Parts(**own))
    simulator = Simulator(builder.Build())
    simulator.AdvanceTo(time)
    port = navigation.localization("pose")
    pose = port.Eval(port.get_system().GetMyContextFromRoot(simulator.get_context())).copy()
    return pose, navigation, simulator


def test_a_controller_of_ones_own_follows_the_short_term_goals() -> None:
    pose, navigation, _ = driven(20.0, controller=Pursuit())
    assert np.hypot(*(pose[:2] - GOALS[0])) < 0.1
    assert isinstance(navigation.planner, StarRoadmapPlanner)
    assert isinstance(navigation.controller, Pursuit)
    assert isinstance(navigation.shield, TwistShield)


@pytest.mark.parametrize("faults", [[], ["drive.delay=0.1", "lidar.delay=0.05"], ["localization.drift=0.02"]])
def test_the_shield_stops_a_controller_that_drives_into_a_post(faults: list[str]) -> None:
    scenario = posts(overrides=["lidar.noise=0.0", *faults])
    pose, navigation, simulator = driven(8.0, scenario, controller=Pursuit("goal"))
    gap = np.hypot(*(pose[:2] - (1.7, 0.1))) - 0.4 - scenario.robot.radius
    assert 0.0 < gap < 0.25
    port = navigation.certificate
    path = port.Eval(port.get_system().GetMyContextFromRoot(simulator.get_context())).path
    assert path[0, :2] == pytest.approx(pose[:2], abs=0.2)


class Line:
    """A certificate from outside: what is left of a line."""

    def __init__(self, x: float) -> None:
        self.x, self.asked = x, 0

    def accepts(self, motion) -> bool:
        self.asked += 1
        return bool(motion.position[:, 0].max() <= self.x)


@pytest.mark.parametrize("moving", [[], ["obstacles.max_speed=0.5"]])
def test_certificates_of_ones_own_hold_in_every_world(moving: list[str]) -> None:
    """A line, a speed zone and a keep-out polygon, with no edit in the package."""
    line, zone = Line(0.9), np.array([(-1.0, -2.0), (5.0, -2.0), (5.0, 2.0), (-1.0, 2.0)])
    rules = (line, SpeedZone(zone, 0.3), KeepOut(zone + (7.0, 0.0)))
    builder = DiagramBuilder()
    navigation = add_navigation(builder, posts(overrides=moving), Parts(certificates=rules))
    log = LogVectorOutput(navigation.localization("state"), builder, 0.05)
    simulator = Simulator(builder.Build())
    simulator.AdvanceTo(5.0)
    states = log.FindLog(simulator.get_context()).data()
    assert 0.5 < states[0].max() <= 0.905 and line.asked > 100
    assert 0.1 < states[3].max() <= 0.31


@pytest.mark.parametrize("faults", [[], ["localization.drift=0.01"]])
def test_a_planner_of_ones_own_guides_our_controller(faults: list[str]) -> None:
    beeline = Beeline()
    pose, navigation, _ = driven(8.0, posts(overrides=faults), planner=beeline)
    assert navigation.planner is beeline
    assert pose[0] > 0.5  # as far as the certificate lets it
    assert np.hypot(*(pose[:2] - (1.7, 0.1))) > 0.65
