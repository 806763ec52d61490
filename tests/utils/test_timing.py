"""Times that Drake would take amiss are refused by name."""

import math

import pytest

from drake_starnav import ArrivalMonitor, RobotParameters, StarnavError
from drake_starnav.systems import JumpGuard, StatePredictor
from drake_starnav.utils.timing import check_period, is_new_run

SYSTEMS = {
    "ArrivalMonitor: period": lambda value: ArrivalMonitor(tolerance=0.1, period=value),
    "JumpGuard: rate": lambda value: JumpGuard(tolerance=0.1, rate=value),
    "StatePredictor: rate": lambda value: StatePredictor(RobotParameters(), delay=0.1, rate=value),
}


@pytest.mark.parametrize("name", SYSTEMS)
@pytest.mark.parametrize("value", [0.0, -1.0, math.nan, math.inf])
def test_a_period_is_a_positive_time(value: float, name: str) -> None:
    with pytest.raises(StarnavError, match=rf"^{name} is {value}; allowed: 0 < x, finite$"):
        SYSTEMS[name](value)


def test_the_period_is_that_given_or_of_the_rate() -> None:
    assert check_period(None, period=0.25) == check_period(None, rate=4.0) == 0.25


@pytest.mark.parametrize(
    ("last", "begins"), [(math.nan, True), (0.0, False), (0.9, False), (1.0, True), (1.1, True), (20.0, True)]
)
def test_a_run_begins_without_a_past_or_when_time_was_set_back(last: float, begins: bool) -> None:
    assert is_new_run(1.0, last) is begins
