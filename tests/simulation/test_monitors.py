"""A run ends when the robot has arrived, or stands without a way; the monitors connect themselves."""

import math

import pytest
from pydrake.common.value import Value
from pydrake.systems.analysis import Simulator, SimulatorStatus
from pydrake.systems.framework import DiagramBuilder
from pydrake.systems.primitives import ConstantVectorSource

from drake_starnav import Parts, World, add_navigation, parse_scenario
from drake_starnav.geometry.footprint import disc
from drake_starnav.geometry.trajectory import STANDING
from drake_starnav.planning import PlannerStatus
from drake_starnav.simulation.monitors import ArrivalMonitor
from drake_starnav.station.monitors import CollisionMonitor

GOAL = [3.0, 4.0]
FAR = (0.0, 0.0)
REACHED = SimulatorStatus.ReturnReason.kReachedTerminationCondition


def verdict(
    position=FAR, speed=(0.0, 0.0), status: PlannerStatus | None = PlannerStatus.EXPLORING, radius=1.0, reached=()
) -> str | None:
    """The message that ends the run, None if it goes on; `status` None leaves the port unconnected."""
    monitor = ArrivalMonitor(tolerance=0.3, period=0.02, footprint=disc(radius), goals=len(reached))
    simulator = Simulator(monitor)
    context = simulator.get_mutable_context()
    monitor.GetInputPort("state").FixValue(context, [*position, 0.5, *speed])
    name, value = ("reached", reached) if reached else ("goal", GOAL)
    monitor.GetInputPort(name).FixValue(context, value)
    if status is not None:
        monitor.GetInputPort("status").FixValue(context, Value(status))
    result = simulator.AdvanceTo(0.1)
    return result.message() if result.reason() == REACHED else None


@pytest.mark.parametrize("status", [None, *PlannerStatus])
def test_a_robot_within_the_tolerance_has_arrived_whatever_the_planner_says(status) -> None:
    assert verdict((3.0, 3.71), (0.5, 0.0), status) == "reached"


@pytest.mark.parametrize("status", [None, PlannerStatus.WAITING, PlannerStatus.EXPLORING, PlannerStatus.APPROACHING])
def test_the_run_goes_on_outside_the_tolerance(status) -> None:
    assert verdict((3.0, 3.69), status=status) is None


def test_unreachable_ends_the_run_only_once_the_robot_stands() -> None:
    given_up = PlannerStatus.UNREACHABLE
    assert verdict(status=given_up) == "unreachable"
    for speed in ((2.0 * STANDING, 0.0), (-2.0 * STANDING, 0.0), (0.0, 2.0 * STANDING), (0.0, -2.0 * STANDING)):
        assert verdict(speed=speed, status=given_up) is None
    turning = 0.0, 0.6 * STANDING  # a point on its rim moves by the radius for each radian
    assert [verdict(speed=turning, status=given_up, radius=radius) for radius in (0.8, 1.0)] == ["unreachable", None]


@pytest.mark.parametrize(("times", "said"), [((1.0, math.nan), None), ((1.0, 2.0), "reached")])
def test_of_several_goals_all_are_to_be_reached(times: tuple[float, float], said: str | None) -> None:
    assert verdict(GOAL, status=None, reached=times) == said


@pytest.mark.parametrize(
    ("goals", "post", "said"),
    [("", 9.0, "reached"), ("goals: [[0.6, 0], [1.2, 0]]", 9.0, "reached"), ("", 0.9, "collision of base_link with ")],
)
def test_monitors_connect_themselves_to_a_navigation(goals: str, post: float, said: str) -> None:
    """The robot is driven straight ahead by who looks nowhere."""
    world = World("straight", (0.0, 0.0, 0.0), (1.2, 0.0), cylinders=[(post, 0.3, 0.1)])
    blind = Parts(world, controller=ConstantVectorSource([0.5, 0.0]), certified=False)
    builder = DiagramBuilder()
    navigation = add_navigation(builder, parse_scenario(goals or "{}", name="one"), blind)
    ArrivalMonitor.AddToBuilder(builder, navigation)
    CollisionMonitor.AddToBuilder(builder, navigation.station)
    status = Simulator(builder.Build()).AdvanceTo(5.0)
    assert status.reason() == REACHED and status.message().startswith(said)
