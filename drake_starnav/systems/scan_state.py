"""State that a system's outputs show with the latest scan already in it."""

import dataclasses
import math
import warnings
from collections.abc import Callable
from typing import Any, Generic, TypeVar

from pydrake.common.value import AbstractValue, Value
from pydrake.systems.framework import Context, EventStatus, InputPort, LeafSystem, State, ValueProducer

from drake_starnav.systems.release import weakly
from drake_starnav.utils.snapshot import snapshot
from drake_starnav.utils.timing import EARLY

T = TypeVar("T")


@snapshot
class _Processed:
    """The owner's value after a scan, and which scan that was. Immutable.

    Attributes:
        value: the owner's.
        stamp: time of the last scan in it, s.
        clock: time of the context when that scan was processed, s.
        due: when another one is expected, s.
        ignored: time of the scan that came after it and is not processed, s; NaN if none did.
        dropped: number of scans that came after a later one.
    """

    value: Any
    stamp: float = -math.inf
    clock: float = -math.inf
    due: float = -math.inf
    ignored: float = math.nan
    dropped: int = 0


class ScanState(Generic[T]):
    """What a system knows from the scans that came so far: abstract state, and beside it the scan that came last.

    A scan is processed when something asks for it first, at the latest when the simulator takes its next step, and the
    result is cached. The state takes it over in the step in which another one is due or has come. Hence each scan that
    is shown for at least one step is processed, whatever the rate and the jitter, and so is each that something asked
    for, or that a forced update follows.

    A scan that is older than one before it is dropped, with a warning that counts them. When the context's time is set
    back, another run begins: with the initial value, and the first scan that is not the one shown until then.
    """

    def __init__(
        self,
        system: LeafSystem,
        initial: T,
        step_state: Callable[[Context, T], T],
        inputs: tuple[InputPort, ...],
        *,
        stamp: Callable[[Context], float],
    ) -> None:
        """
        Args:
            system: its owner, in whose construction it is made.
            initial: state before the first scan; an immutable snapshot.
            step_state: method of the owner: the state after what the inputs show, from the one before; the same
                object where they show nothing new.
            stamp: method of the owner: time of the scan that the inputs show, s; -inf if they show none.
        """
        initial_state = _Processed(initial)
        self._name, self._initial = type(system).__name__, initial
        self._state = system.DeclareAbstractState(Value[object](initial_state))
        self._step_state, self._stamp = weakly(step_state), weakly(stamp)
        self._known = system.DeclareCacheEntry(
            "the state, what was known before the latest scan, and with it",
            ValueProducer(
                allocate=lambda: Value[object]((initial_state, initial_state, initial_state)), calc=weakly(self._calc)
            ),
            {system.abstract_state_ticket(self._state), *(port.ticket() for port in inputs)},
        )
        self.ticket = self._known.ticket()
        system.DeclarePerStepUnrestrictedUpdateEvent(weakly(self._step))
        system.DeclareForcedUnrestrictedUpdateEvent(weakly(self._update))

    def Eval(self, context: Context) -> T:
        """What is known, the latest scan included."""
        return self._known.Eval(context)[2].value

    def dropped(self, context: Context) -> int:
        """Number of scans that were dropped, as they came after a later one."""
        return self._known.Eval(context)[2].dropped

    def _calc(self, context: Context, value: AbstractValue) -> None:
        stored_state, time = context.get_abstract_state(self._state).get_value(), context.get_time()
        base, previous_state, latest = value.get_value()
        if base is not stored_state or time < latest.clock:
            if time < stored_state.clock:
                previous_state = latest = _Processed(
                    self._initial, clock=time, ignored=max(stored_state.stamp, latest.stamp)
                )
            else:  # an integrator may look ahead, and go back
                previous_state = latest = stored_state
        stamp = self._stamp(context)
        next_state = self._next(context, latest, stamp)
        if next_state is latest:
            next_state, latest = latest, previous_state
        elif stamp == latest.stamp:  # other inputs have changed: what is known does not depend on who asked before
            next_state, latest = self._next(context, previous_state, stamp), previous_state
        value.set_value((stored_state, latest, next_state))

    def _next(self, context: Context, previous_state: _Processed, stamp: float) -> _Processed:
        if stamp in (-math.inf, previous_state.ignored):
            return previous_state
        if stamp < previous_state.stamp:
            dropped_count = previous_state.dropped + 1
            warnings.warn(
                f"{self._name}: a scan of {stamp:.3f} s came after that of {previous_state.stamp:.3f} s and is "
                "dropped; "
                f"{dropped_count} so far",
                stacklevel=1,
            )
            return dataclasses.replace(previous_state, ignored=stamp, dropped=dropped_count)
        value = self._step_state(context, previous_state.value)
        if value is previous_state.value:
            return previous_state
        time = context.get_time()
        due = 2.0 * time - previous_state.clock - EARLY if previous_state.clock > -math.inf else time
        return _Processed(value, stamp, time, due, dropped=previous_state.dropped)

    def _step(self, context: Context, state: State) -> EventStatus:
        stored_state, previous_state, latest_state = self._known.Eval(context)
        if previous_state is stored_state and context.get_time() < latest_state.due:
            return EventStatus.DidNothing()  # an update makes Drake copy all state, and forget all that follows from it
        return self._update(context, state)

    def _update(self, context: Context, state: State) -> EventStatus:
        stored_state, _, latest_state = self._known.Eval(context)
        if latest_state is stored_state:
            return EventStatus.DidNothing()
        state.get_mutable_abstract_state(self._state).set_value(latest_state)
        return EventStatus.Succeeded()
