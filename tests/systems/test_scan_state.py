"""State whose latest scan is in its outputs before it is in the state."""

import pytest
from pydrake.systems.analysis import Simulator
from pydrake.systems.framework import BasicVector, Context, LeafSystem

from drake_starnav.systems.release import weakly
from drake_starnav.systems.scan_state import ScanState

PERIOD = 0.1


class Collector(LeafSystem):
    """Collects each new number from its input; `calls` counts how often it looks."""

    def __init__(self) -> None:
        super().__init__()
        self.calls = 0
        self.port = self.DeclareVectorInputPort("number", 1)
        self.collected = ScanState(self, (), self.after, (self.port,), rate=1.0 / PERIOD)
        self.DeclareVectorOutputPort("sum", 1, weakly(self.calc_sum), {self.collected.ticket})

    def after(self, context: Context, before: tuple[float, ...]) -> tuple[float, ...]:
        self.calls += 1
        number = float(self.port.Eval(context)[0])
        return before if number in before else (*before, number)

    def calc_sum(self, context: Context, output: BasicVector) -> None:
        output.SetAtIndex(0, sum(self.collected.Eval(context)))


@pytest.fixture
def collecting() -> tuple[Collector, Simulator, Context]:
    system = Collector()
    simulator = Simulator(system)
    context = simulator.get_mutable_context()
    system.port.FixValue(context, [1.0])
    simulator.AdvanceTo(0.5 * PERIOD)
    return system, simulator, context


def state(context: Context) -> tuple[float, ...]:
    return context.get_abstract_state(0).get_value()


def test_outputs_have_what_is_new_and_the_state_takes_it_at_the_next_multiple_of_the_period(collecting) -> None:
    system, simulator, context = collecting
    assert state(context) == (1.0,)
    system.port.FixValue(context, [2.0])
    assert system.get_output_port().Eval(context) == [3.0] and state(context) == (1.0,)
    simulator.AdvanceTo(0.9 * PERIOD)
    assert state(context) == (1.0,)
    simulator.AdvanceTo(1.1 * PERIOD)
    assert state(context) == (1.0, 2.0) and system.get_output_port().Eval(context) == [3.0]


def test_what_is_new_is_processed_once_however_often_it_is_asked_for(collecting) -> None:
    system, simulator, context = collecting
    system.port.FixValue(context, [2.0])
    before = system.calls
    for _ in range(3):
        system.get_output_port().Eval(context)
    assert system.calls == before + 1
    for until in (1.2, 1.5, 1.9):
        simulator.AdvanceTo(until * PERIOD)
        system.get_output_port().Eval(context)
    assert system.calls == before + 2  # the second found nothing new, in the state that had taken the first's


def test_a_clone_goes_its_own_way(collecting) -> None:
    system, _, context = collecting
    system.port.FixValue(context, [2.0])
    clone = context.Clone()
    system.port.FixValue(clone, [4.0])
    assert system.get_output_port().Eval(clone) == [5.0]
    assert system.get_output_port().Eval(context) == [3.0]
