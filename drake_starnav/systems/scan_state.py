"""State that a system's outputs show with the latest scan already in it."""

from collections.abc import Callable
from typing import Generic, TypeVar

from pydrake.common.value import AbstractValue, Value
from pydrake.systems.framework import Context, EventStatus, InputPort, LeafSystem, State, ValueProducer

from drake_starnav.systems.release import weakly
from drake_starnav.utils.timing import checked_period

T = TypeVar("T")


class ScanState(Generic[T]):
    """What a system knows from the scans that came so far: abstract state, and beside it the scan that came last.

    A scan is processed when something asks for it first, and the result is cached. The state takes it over at the next
    multiple of the lidar's period, when the next scan is taken and none is lost: no consumer waits for that.
    """

    def __init__(
        self,
        system: LeafSystem,
        initial: T,
        after: Callable[[Context, T], T],
        inputs: tuple[InputPort, ...],
        *,
        rate: float,
    ) -> None:
        """
        Args:
            system: its owner, in whose construction it is made.
            initial: state before the first scan; an immutable snapshot.
            after: method of the owner: the state after what the inputs show, from the one before; the same object where
                they show nothing new.
            rate: of the lidar, Hz.
        """
        period = checked_period(system, rate=rate)
        self._state = system.DeclareAbstractState(Value[object](initial))
        self._after = weakly(after)
        self._known = system.DeclareCacheEntry(
            "the state before and with the latest scan",
            ValueProducer(allocate=lambda: Value[object]((initial, initial)), calc=weakly(self._calc)),
            {system.abstract_state_ticket(self._state), *(port.ticket() for port in inputs)},
        )
        self.ticket = self._known.ticket()
        system.DeclarePeriodicUnrestrictedUpdateEvent(period, 0.0, weakly(self._update))

    def Eval(self, context: Context) -> T:
        """What is known, the latest scan included."""
        return self._known.Eval(context)[1]

    def _calc(self, context: Context, pair: AbstractValue) -> None:
        held = self._held(context)
        base, known = pair.get_value()
        # a port may have been calculated again without a change: what is known then follows from the same inputs
        before = known if base is held else held
        after = self._after(context, before)
        if after is not before and before is not held:
            after = self._after(context, held)
        pair.set_value((held, after))

    def _held(self, context: Context) -> T:
        return context.get_abstract_state(self._state).get_value()

    def _update(self, context: Context, state: State) -> EventStatus:
        known = self.Eval(context)
        if known is self._held(context):
            return EventStatus.DidNothing()
        state.get_mutable_abstract_state(self._state).set_value(known)
        return EventStatus.Succeeded()
