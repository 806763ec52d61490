"""Functions of arrays that tests may call with lists."""

from collections.abc import Callable
from typing import Any

import numpy as np


def taking_lists(function: Callable[..., Any]) -> Callable[..., Any]:
    """The function with its lists of numbers as arrays."""

    def called(*arguments: Any, **others: Any) -> Any:
        return function(*map(_array, arguments), **{name: _array(value) for name, value in others.items()})

    called.__name__ = function.__name__
    return called


def _array(value: Any) -> Any:
    return np.array(value, dtype=float) if isinstance(value, (list, tuple)) else value
