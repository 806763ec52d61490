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
    frozen_class = dataclass(frozen=True, eq=False)(cls)
    frozen_class.__deepcopy__ = lambda self, memo: self  # type: ignore[attr-defined]
    return frozen_class


def replace_fields(value: T, **changes: Any) -> T:
    """A snapshot with other values of some fields, which are not checked; `dataclasses.replace` takes three times as
    long."""
    new_value, own_fields = object.__new__(type(value)), vars(value)
    vars(new_value).update({name: own_fields[name] for name in type(value).__dataclass_fields__}, **changes)  # type: ignore[attr-defined]
    return new_value
