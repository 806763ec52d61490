"""Values that never change, of which Drake may keep as many copies as it likes."""

from dataclasses import dataclass
from typing import TypeVar, dataclass_transform

T = TypeVar("T")


@dataclass_transform(frozen_default=True, eq_default=False)
def snapshot(cls: type[T]) -> type[T]:
    """Make a class a frozen dataclass that is equal to itself alone, and whose copy is itself.

    Arrays in it have no single truth value to compare by, and as nobody may change them, Drake's copies of abstract
    state cost nothing.
    """
    made = dataclass(frozen=True, eq=False)(cls)
    made.__deepcopy__ = _itself  # type: ignore[attr-defined]
    return made


def _itself(value: T, memo: dict) -> T:
    return value
