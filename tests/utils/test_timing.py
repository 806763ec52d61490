"""Times that Drake would take amiss are refused by name."""

import math

import pytest

from drake_starnav.errors import StarnavError
from drake_starnav.robot import RobotParameters
from drake_starnav.simulation.monitors import ArrivalMonitor
from drake_starnav.systems.jump_guard import JumpGuard
from drake_starnav.systems.state_predictor import StatePredictor
from drake_starnav.utils.timing import check_period, is_new_run

WITH_PERIOD = {
    "ArrivalMonitor": lambda **times: ArrivalMonitor(tolerance=0.1, **times),
}
WITH_RATE = {
    "JumpGuard": lambda **times: JumpGuard(tolerance=0.1, **times),
    "StatePredictor": lambda **times: StatePredictor(RobotParameters(), delay=0.1, **times),
}


@pytest.mark.parametrize("value", [0.0, -1.0, math.nan, math.inf])
def test_a_period_is_a_positive_time(value: float) -> None:
    for times, systems in (({"period": value}, WITH_PERIOD), ({"rate": value}, WITH_RATE)):
        for name, make in systems.items():
            with pytest.raises(StarnavError, match=rf"^{name}: (period|rate) is {value}; allowed: 0 < x, finite$"):
                make(**times)


def test_the_period_is_that_given_or_of_the_rate() -> None:
    monitor = ArrivalMonitor(tolerance=0.1, period=1.0)
    assert check_period(monitor, period=0.25) == 0.25
    assert check_period(monitor, rate=4.0) == 0.25


@pytest.mark.parametrize(
    ("last", "begins"), [(math.nan, True), (0.0, False), (0.9, False), (1.0, True), (1.1, True), (20.0, True)]
)
def test_a_run_begins_without_a_past_or_when_time_was_set_back(last: float, begins: bool) -> None:
    context = ArrivalMonitor(tolerance=0.1, period=1.0).CreateDefaultContext()
    context.SetTime(1.0)
    assert is_new_run(context.get_time(), last) is begins
