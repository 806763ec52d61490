"""Checks of parameters that are lists of numbers."""

from collections.abc import Sequence
from typing import Any

from drake_starnav.errors import StarnavError, shown
from drake_starnav.parameters import is_number


def check_list(value: Any, name: str) -> Sequence:
    """The value, or a `StarnavError` that names it if it is no list."""
    if not isinstance(value, (list, tuple)):
        raise StarnavError(f"{name} is {shown(value)}; allowed: a list")
    return value


def check_ends(start: Any, goal: Any, prefix: str) -> tuple[tuple[float, float, float], tuple[float, float]]:
    """Start (x, y, yaw) and goal (x, y), or a `StarnavError` that names the wrong one after a prefix."""
    x, y, yaw = check_numbers(start, f"{prefix}start", ("x", "y", "yaw"))
    goal_x, goal_y = check_numbers(goal, f"{prefix}goal", ("x", "y"))
    return (x, y, yaw), (goal_x, goal_y)


def check_numbers(value: Any, name: str, entries: tuple[str, ...], *, or_empty: bool = False) -> Sequence:
    """The value, or a `StarnavError` if it is no list of as many finite numbers as there are `entries`."""
    numbers = check_list(value, name)
    if or_empty and not numbers:
        return numbers
    if len(numbers) != len(entries) or not all(map(is_number, numbers)):
        empty = ", or an empty list" if or_empty else ""
        raise StarnavError(f"{name} is {shown(list(numbers))}; allowed: finite [{', '.join(entries)}]{empty}")
    return numbers
