"""The memory of diagrams that are no longer used.

Drake 1.51 never frees a diagram with systems of Python in it, in two ways. It owns each such system by a reference that
Python's garbage collector does not see, while the system's `__dict__` refers back to the diagram: `release` empties it.
And it owns what calculates an output port or a cache entry, which is a method that holds its system: what `weakly`,
`declare_value` and `declare_vector` make of it does not.
"""

import types
import weakref
from collections.abc import Callable
from typing import Any, TypeVar

from pydrake.common.value import AbstractValue, Value
from pydrake.systems.framework import BasicVector, Context, Diagram, DiagramBuilder, OutputPort

RELEASED = "_starnav_released"
"""Attribute of a system whose diagram was released: to touch more of it would crash Python."""

R = TypeVar("R")


def weakly(method: Callable[..., R]) -> Callable[..., R]:
    """A system's method as a function that does not keep the system alive."""
    bound: Any = method
    return types.MethodType(bound.__func__, weakref.proxy(bound.__self__))


def declare_value(
    system: Any, name: str, model: Any, value: Callable[[Any, Context], Any], depends: set | None = None
) -> OutputPort:
    """Declare an abstract output port of a system, in whose construction it is called.

    Args:
        system, name: to which it belongs, and what it is called.
        model: a value of its type.
        value: its value, by the system and a context.
        depends: tickets of what that follows from; None for everything.
    """
    owner = weakref.proxy(system)

    def calc(context: Context, output: AbstractValue) -> None:
        output.set_value(value(owner, context))

    return system.DeclareAbstractOutputPort(name, lambda: Value(model), calc, depends or {system.all_sources_ticket()})


def declare_vector(
    system: Any, name: str, size: int, value: Callable[[Any, Context], Any], depends: set | None = None
) -> OutputPort:
    """Declare a vector output port of a system, likewise."""
    owner = weakref.proxy(system)

    def calc(context: Context, output: BasicVector) -> None:
        output.SetFromVector(value(owner, context))

    return system.DeclareVectorOutputPort(name, size, calc, depends or {system.all_sources_ticket()})


def release(holder: Diagram | DiagramBuilder) -> None:
    """Release a diagram, or the contents of a builder not yet built: once nothing refers to it, its memory is freed.

    Systems of classes of the user's keep their attributes.

    Args:
        holder: it must not be simulated or read any more, nor its systems.
    """
    for system in holder.GetSystems():
        if isinstance(system, Diagram):
            release(system)
        else:
            _empty(system)
            setattr(system, RELEASED, True)
    _empty(holder)


def _empty(system: Any) -> None:
    """Empty what is of this package; what a system of the user's noted is the user's, even if Drake 1.51 keeps it."""
    if type(system).__module__.partition(".")[0] in ("drake_starnav", "pydrake"):
        vars(system).clear()
