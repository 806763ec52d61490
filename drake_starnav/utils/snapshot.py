"""Immutable values, which Drake may copy at no cost."""

from dataclasses import dataclass
from typing import Any, TypeVar, dataclass_transform

T = TypeVar("T")


@dataclass_transform(frozen_default=True, eq_default=False)
def snapshot(cls: type[T]) -> type[T]:
    """Make a class a frozen dataclass that is equal to itself alone, and whose copy is itself.

    Arrays in it cannot be compared to a single truth value, and as they are immutable, Drake's copies of abstract state
    cost nothing.
    """
    made = dataclass(frozen=True, eq=False)(cls)
    made.__deepcopy__ = lambda self, memo: self  # type: ignore[attr-defined]
    return made


def replaced(value: T, **changes: Any) -> T:
    """A snapshot with other values of some fields, which are not checked; `dataclasses.replace` takes three times as
    long."""
    made, own = object.__new__(type(value)), vars(value)
    vars(made).update({name: own[name] for name in type(value).__dataclass_fields__}, **changes)  # type: ignore[attr-defined]
    return made
