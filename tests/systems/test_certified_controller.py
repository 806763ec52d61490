"""The controller through a context: it follows guidance, within limits, and brakes when nothing is certain."""

import math

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from pydrake.common.value import Value
from pydrake.systems.analysis import Simulator

from drake_starnav.baselines.sampling_mpc import predictive_step
from drake_starnav.control import ControllerParameters, control_step
from drake_starnav.errors import StarnavError
from drake_starnav.planning.guidance import Guidance
from drake_starnav.regions.safe_region import SafetyStar
from drake_starnav.regions.star_region import RegionStack
from drake_starnav.robot import RobotParameters
from drake_starnav.systems import certified_controller
from drake_starnav.systems.certified_controller import TWIST, CertifiedController
from drake_starnav.tracking import DynamicObstacleParameters, Tracks
from drake_starnav.utils.stopwatch import Stopwatch

ROBOT, PARAMETERS = RobotParameters(), ControllerParameters()
PERIOD = 1.0 / PARAMETERS.rate
WIDE = SafetyStar(np.zeros(2), 0.0, np.full(720, 5.0), np.zeros((0, 2)))
AHEAD = Guidance(np.array([[3.0, 0.0]]), False, RegionStack.of(()))


class Controlling:
    """A controller with a simulator, whose inputs are fixed by hand."""

    def __init__(
        self,
        guidance: Guidance = AHEAD,
        star: SafetyStar = WIDE,
        *,
        twist: tuple[float, float] = (0.0, 0.0),
        pose: tuple[float, float, float] = (0.0, 0.0, 0.0),
        parameters: ControllerParameters = PARAMETERS,
        stopwatch: Stopwatch | None = None,
    ) -> None:
        self.system = CertifiedController(ROBOT, parameters, stopwatch=stopwatch)
        self.simulator = Simulator(self.system)
        self.context = self.simulator.get_mutable_context()
        self.put("guidance", Value(guidance))
        self.put("safety_star", Value(star))
        self.put("state", [*pose, *twist])
        self.context.SetDiscreteState(TWIST, twist)

    def put(self, name: str, value) -> None:
        self.system.GetInputPort(name).FixValue(self.context, value)

    def update(self, count: int = 1) -> np.ndarray:
        """The twist after some periods."""
        # events at the end of a step are handled at the beginning of the next one
        self.simulator.AdvanceTo(self.context.get_time() + (count - 0.5) * PERIOD)
        twist = self.out("twist_command").copy()
        self.simulator.AdvanceTo(self.context.get_time() + 0.5 * PERIOD)
        return twist

    def out(self, name: str):
        return self.system.GetOutputPort(name).Eval(self.context)


def test_ports() -> None:
    system = Controlling().system
    inputs = [system.get_input_port(k).get_name() for k in range(system.num_input_ports())]
    assert inputs == ["guidance", "safety_star", "state"]
    outputs = [system.get_output_port(k) for k in range(system.num_output_ports())]
    assert [port.get_name() for port in outputs] == ["twist_command", "guiding_vector", "certificate"]
    assert [port.size() for port in outputs] == [2, 2, 0]
    # the plant would otherwise wait for the controller, which waits for the plant
    assert not system.HasDirectFeedthrough(0)
    assert not system.HasDirectFeedthrough(1)


def test_stands_before_the_first_update_and_without_guidance() -> None:
    controlling = Controlling(Guidance.none())
    assert np.array_equal(controlling.out("twist_command"), np.zeros(2))
    for _ in range(5):
        assert np.array_equal(controlling.update(), np.zeros(2))
    assert np.array_equal(controlling.out("guiding_vector"), np.zeros(2))


def test_without_guidance_a_moving_robot_brakes_as_hard_as_it_may() -> None:
    controlling = Controlling(Guidance.none(), twist=(0.5, -0.4))
    assert controlling.update() == pytest.approx([0.5 - PERIOD * ROBOT.max_acceleration, -0.4 + PERIOD * 4.0])
    assert controlling.update(50) == pytest.approx([0.0, 0.0], abs=1e-12)


@given(v=st.floats(0.15, 0.8), omega=st.floats(-2.0, 2.0))
def test_without_a_safety_star_it_brakes_and_says_so(v, omega) -> None:
    controlling = Controlling(AHEAD, SafetyStar.none(), twist=(v, omega))
    braked = controlling.update()
    assert not controlling.out("certificate").certified
    change = ROBOT.max_yaw_acceleration * PERIOD
    expected = (v - PERIOD * ROBOT.max_acceleration, math.copysign(max(abs(omega) - change, 0.0), omega))
    assert braked == pytest.approx(expected, abs=1e-12)
    assert controlling.update(100)[0] == 0.0


def test_with_a_wide_star_it_drives_to_the_short_term_goal_within_the_limits() -> None:
    controlling = Controlling()
    twists = np.array([controlling.update() for _ in range(60)])
    assert controlling.out("certificate").certified
    assert controlling.out("guiding_vector") == pytest.approx([1.0, 0.0])
    steps = np.diff(np.vstack((np.zeros(2), twists)), axis=0)
    assert np.abs(steps[:, 0]).max() <= ROBOT.max_acceleration * PERIOD + 1e-12
    assert np.abs(steps[:, 1]).max() <= ROBOT.max_yaw_acceleration * PERIOD + 1e-12
    assert twists[-1] == pytest.approx([ROBOT.max_speed, 0.0])


@pytest.mark.parametrize("side", [1.0, -1.0])
def test_turns_towards_the_short_term_goal(side: float) -> None:
    controlling = Controlling(Guidance(np.array([[0.0, 3.0 * side]]), False, RegionStack.of(())))
    v, omega = controlling.update(100)
    assert omega == pytest.approx(side * ROBOT.max_yaw_rate)
    assert v == pytest.approx(0.0, abs=1e-6)
    assert controlling.out("guiding_vector") == pytest.approx([0.0, side], abs=1e-9)


@given(
    v=st.floats(0.0, 0.8),
    omega=st.floats(-2.0, 2.0),
    x=st.floats(-5.0, 5.0),
    yaw=st.floats(-3.0, 3.0),
)
def test_certificate_path_begins_at_the_robot_and_ends_standing(v, omega, x, yaw) -> None:
    controlling = Controlling(twist=(v, omega), pose=(x, 1.0, yaw))
    path = controlling.out("certificate").path
    assert path[0] == pytest.approx([x, 1.0, yaw])
    steps = np.hypot(*np.diff(path[:, :2], axis=0).T)
    # full braking needs v^2 / 2a; what the steps of the path add must stay small
    needed = v**2 / (2.0 * ROBOT.max_acceleration)
    assert steps.sum() == pytest.approx(needed, abs=0.5 * v * 0.04 + 1e-3)
    if len(steps):
        assert steps[-1] <= 0.04**2 * ROBOT.max_acceleration + 1e-9  # the last step is the end of the ramp
    turned = abs(path[-1, 2] - yaw)
    assert turned <= omega**2 / (2.0 * ROBOT.max_yaw_acceleration) + abs(omega) * 0.04 + 1e-9


def test_certificate_path_is_where_the_robot_stops_when_sight_is_lost() -> None:
    """A perfect robot that follows the twists from then on ends where the certificate said."""
    controlling = Controlling(AHEAD, SafetyStar.none(), twist=(0.8, 0.6))
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


def test_a_context_owns_the_last_twist() -> None:
    controlling = Controlling()
    controlling.update(10)
    clone = controlling.context.Clone()
    before = controlling.system.GetOutputPort("twist_command").Eval(clone).copy()
    controlling.update(10)
    assert np.array_equal(controlling.system.GetOutputPort("twist_command").Eval(clone), before)
    assert controlling.out("twist_command")[0] > before[0] > 0.0
    assert np.array_equal(
        controlling.system.GetOutputPort("twist_command").Eval(controlling.system.CreateDefaultContext()), np.zeros(2)
    )


@pytest.mark.parametrize("lead", [0.0, 0.3])
def test_what_moves_is_as_old_as_its_scan_when_the_command_takes_effect(lead: float, monkeypatch) -> None:
    def note(law, now, parameters, robot, obstacles):
        ages.append(obstacles.age)
        return law(now, parameters, robot)

    ages: list[float] = []
    monkeypatch.setattr(certified_controller, "dynamic_step", note)
    system = CertifiedController(ROBOT, PARAMETERS, obstacles=DynamicObstacleParameters(max_speed=0.5), lead=lead)
    simulator = Simulator(system)
    tracks = Value(Tracks(-0.05))
    inputs = {"guidance": Value(AHEAD), "safety_star": Value(WIDE), "state": np.zeros(5), "tracks": tracks}
    for name, value in inputs.items():
        system.GetInputPort(name).FixValue(simulator.get_mutable_context(), value)
    simulator.AdvanceTo(1.5 * PERIOD)
    assert ages == pytest.approx([0.05 + lead, 0.05 + PERIOD + lead])


def test_each_period_is_one_command() -> None:
    stopwatch = Stopwatch()
    Controlling(stopwatch=stopwatch).update(7)
    assert len(stopwatch.seconds["command"]) == 7


@pytest.mark.parametrize("lost", [math.nan, math.inf])
@pytest.mark.parametrize("law", [control_step, predictive_step])
def test_a_pose_that_is_not_finite_ends_the_simulation(law, lost) -> None:
    system = CertifiedController(RobotParameters(), ControllerParameters(), law=law)
    context = system.CreateDefaultContext()
    hits = np.array([(2.0, 0.0)])
    star = SafetyStar(np.zeros(2), 0.0, np.ones(360), hits, hits, np.zeros(1), seen=True)
    system.GetInputPort("guidance").FixValue(context, Value(Guidance.none()))
    system.GetInputPort("safety_star").FixValue(context, Value(star))
    system.GetInputPort("state").FixValue(context, [0.0, lost, 0.0, 0.0, 0.0])
    with pytest.raises(StarnavError, match="controller's pose is .*allowed: finite x, y, m, and yaw, rad"):
        Simulator(system, context).AdvanceTo(0.1)
