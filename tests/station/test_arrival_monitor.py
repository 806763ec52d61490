"""When a run is over."""

import math

import pytest
from pydrake.common.value import Value
from pydrake.systems.analysis import Simulator, SimulatorStatus

from drake_starnav.planning import PlannerStatus
from drake_starnav.station.arrival_monitor import STANDING, ArrivalMonitor

GOAL = [3.0, 4.0]
FAR = (0.0, 0.0)
REACHED = SimulatorStatus.ReturnReason.kReachedTerminationCondition


def verdict(position=FAR, speed=(0.0, 0.0), status: PlannerStatus | None = PlannerStatus.EXPLORING) -> str | None:
    """The message that ends the run, None if it goes on; `status` None leaves the port unconnected."""
    monitor = ArrivalMonitor(tolerance=0.3, period=0.02)
    simulator = Simulator(monitor)
    context = simulator.get_mutable_context()
    monitor.GetInputPort("state").FixValue(context, [*position, 0.5, *speed])
    monitor.GetInputPort("goal").FixValue(context, GOAL)
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


@pytest.mark.parametrize(("times", "said"), [((1.0, math.nan), None), ((1.0, 2.0), "reached")])
def test_of_several_goals_all_are_to_be_reached(times: tuple[float, float], said: str | None) -> None:
    monitor = ArrivalMonitor(tolerance=0.3, period=0.02, goals=2)
    simulator = Simulator(monitor)
    context = simulator.get_mutable_context()
    monitor.GetInputPort("state").FixValue(context, [*GOAL, 0.0, 0.0, 0.0])
    monitor.GetInputPort("reached").FixValue(context, times)
    result = simulator.AdvanceTo(0.1)
    assert (result.message() if result.reason() == REACHED else None) == said


def test_checks_come_at_multiples_of_the_period_and_follow_the_inputs() -> None:
    monitor = ArrivalMonitor(tolerance=0.3, period=0.1)
    simulator = Simulator(monitor)
    context = simulator.get_mutable_context()
    monitor.GetInputPort("goal").FixValue(context, GOAL)
    monitor.GetInputPort("state").FixValue(context, [*FAR, 0.0, 0.0, 0.0])
    assert simulator.AdvanceTo(0.25).reason() != REACHED
    monitor.GetInputPort("state").FixValue(context, [*GOAL, 0.0, 0.0, 0.0])
    assert simulator.AdvanceTo(0.35).message() == "reached"
    assert simulator.get_context().get_time() == pytest.approx(0.3)
