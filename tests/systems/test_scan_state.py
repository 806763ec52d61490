"""State whose latest scan is in its outputs before it is in the state."""

import pytest
from hypothesis import given
from hypothesis import strategies as st
from pydrake.common.value import Value
from pydrake.systems.analysis import Simulator
from pydrake.systems.framework import Context, DiagramBuilder, EventStatus, LeafSystem, State

from drake_starnav.systems.release import declare_value, declare_vector
from drake_starnav.systems.scan_state import ScanState

STEP = 0.01
NOTHING = float("-inf")


class Collector(LeafSystem):
    """Collects the time of each new scan from its input; `calls` counts how often it looks."""

    def __init__(self) -> None:
        super().__init__()
        self.calls = 0
        self.port = self.DeclareVectorInputPort("time", 1)
        self.collected = ScanState(self, (), self.after, (self.port,), stamp=self.stamp)
        declare_value(self, "times", (), lambda own, context: own.collected.Eval(context), {self.collected.ticket})

    def stamp(self, context: Context) -> float:
        return float(self.port.Eval(context)[0])

    def after(self, context: Context, before: tuple[float, ...]) -> tuple[float, ...]:
        self.calls += 1
        time = self.stamp(context)
        return before if before and time == before[-1] else (*before, time)


class Jittery(LeafSystem):
    """Shows scans of some times, each from a multiple of STEP on."""

    def __init__(self, shown: dict[int, float]) -> None:
        super().__init__()
        self.shown = shown
        self.state = self.DeclareAbstractState(Value[object](NOTHING))
        self.DeclarePeriodicUnrestrictedUpdateEvent(STEP, 0.0, self.update)
        depends = {self.abstract_state_ticket(self.state)}
        declare_vector(self, "time", 1, lambda own, context: [own.held(context)], depends)

    def held(self, context: Context) -> float:
        return context.get_abstract_state(self.state).get_value()

    def update(self, context: Context, state: State) -> EventStatus:
        stamp = self.shown.get(round(context.get_time() / STEP))
        if stamp is None:
            return EventStatus.DidNothing()
        state.get_mutable_abstract_state(self.state).set_value(stamp)
        return EventStatus.Succeeded()


def driven(shown: dict[int, float]) -> tuple[Collector, Context]:
    """A collector after a run of 1 s in which nothing asked for what it knows."""
    builder = DiagramBuilder()
    source, collector = builder.AddSystem(Jittery(shown)), builder.AddSystem(Collector())
    builder.Connect(source.get_output_port(), collector.port)
    simulator = Simulator(builder.Build())
    simulator.AdvanceTo(1.0)
    return collector, collector.GetMyContextFromRoot(simulator.get_context())


@given(st.sets(st.integers(0, 99), min_size=1))
def test_every_scan_is_processed_once_whatever_the_jitter_and_though_nothing_asks(steps: set[int]) -> None:
    times = {k: k * STEP for k in sorted(steps)}
    collector, context = driven(times)
    assert collector.collected.Eval(context) == tuple(times.values())
    assert collector.collected.dropped(context) == 0


def test_an_older_scan_is_dropped_and_counted() -> None:
    with pytest.warns(
        UserWarning, match=r"Collector: a scan of 0\.[12]00 s came after that of 0\.300 s .*; [12] so far"
    ):
        collector, context = driven({10: 0.1, 20: 0.3, 30: 0.1, 40: 0.2, 50: 0.5})
    assert collector.collected.Eval(context) == (0.1, 0.3, 0.5)
    assert collector.collected.dropped(context) == 2


@pytest.fixture
def collecting() -> tuple[Collector, Simulator, Context]:
    system = Collector()
    simulator = Simulator(system)
    context = simulator.get_mutable_context()
    system.port.FixValue(context, [0.0])
    simulator.AdvanceTo(0.05)
    return system, simulator, context


def known(system: Collector, context: Context) -> tuple[float, ...]:
    return system.get_output_port().Eval(context)


def state(context: Context) -> tuple[float, ...]:
    return context.get_abstract_state(0).get_value().value


def test_outputs_have_what_is_new_and_the_state_takes_it_when_another_is_due(collecting) -> None:
    system, simulator, context = collecting
    assert state(context) == (0.0,)
    system.port.FixValue(context, [0.05])
    assert known(system, context) == (0.0, 0.05) and state(context) == (0.0,)
    for until, taken in ((0.06, (0.0,)), (0.1, (0.0,)), (0.11, (0.0, 0.05))):
        simulator.AdvanceTo(until)
        assert state(context) == taken and known(system, context) == (0.0, 0.05)


def test_scans_that_are_shown_one_after_the_other_by_hand_are_all_processed(collecting) -> None:
    system, simulator, context = collecting
    for time in (0.05, 0.06, 0.07):
        system.port.FixValue(context, [time])
        assert known(system, context)[-1] == time
    simulator.AdvanceTo(0.2)
    assert known(system, context) == (0.0, 0.05, 0.06, 0.07)


def test_what_is_new_is_processed_once_however_often_it_is_asked_for(collecting) -> None:
    system, simulator, context = collecting
    system.port.FixValue(context, [0.05])
    before = system.calls
    for until in (0.05, 0.12, 0.15, 0.19):
        simulator.AdvanceTo(until)
        known(system, context), known(system, context)
    assert system.calls == before + 2  # the second found nothing new, in the state that had taken the first's


def test_time_that_is_set_back_begins_another_run(collecting) -> None:
    system, simulator, context = collecting
    for time in (0.1, 0.2):
        simulator.AdvanceTo(time)
        system.port.FixValue(context, [time])
    simulator.AdvanceTo(0.3)
    assert known(system, context) == (0.0, 0.1, 0.2)
    context.SetTime(0.0)
    simulator.Initialize()
    simulator.AdvanceTo(0.04)  # still shown is the last scan of the run before
    for time in (0.05, 0.1, 0.2):  # in the end one of the same time as that
        simulator.AdvanceTo(time)
        system.port.FixValue(context, [time])
    simulator.AdvanceTo(0.3)
    assert known(system, context) == (0.05, 0.1, 0.2) and system.collected.dropped(context) == 0


def test_looking_ahead_leaves_no_trace(collecting) -> None:
    """As an integrator does that takes a step back."""
    system, _, context = collecting
    for time in (0.1, 0.07):
        context.SetTime(time)
        system.port.FixValue(context, [time])
        assert known(system, context) == (0.0, time)
