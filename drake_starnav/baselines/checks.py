"""Argument checks that the baselines share."""

import math

import numpy as np

from drake_starnav.errors import StarnavError, shown


def vector(value: np.ndarray, size: int, place: str) -> np.ndarray:
    """`value` as a float array of shape (size,), or a `StarnavError` that names `place`."""
    return _finite(value, (size,), f"({size},)", place)


def rows(value: np.ndarray, columns: int, place: str, count: int | None = None) -> np.ndarray:
    """`value` as a contiguous float array (n, columns), n = `count` if given; a `StarnavError` names `place`."""
    return _finite(value, (count, columns), f"({'n' if count is None else count}, {columns})", place)


def positive(value: float, place: str) -> float:
    """`value` as a float, or a `StarnavError` that names `place`."""
    if not (math.isfinite(value) and value > 0.0):
        raise StarnavError(f"{place} is {value}; allowed: a finite number above 0")
    return float(value)


def _finite(value: np.ndarray, shape: tuple[int | None, ...], allowed: str, place: str) -> np.ndarray:
    try:
        array = np.ascontiguousarray(value, dtype=float)
    except (TypeError, ValueError) as error:
        raise StarnavError(f"{place} is {shown(value)}; allowed: numbers of shape {allowed}") from error
    if array.ndim != len(shape) or any(n not in (None, m) for n, m in zip(shape, array.shape, strict=True)):
        raise StarnavError(f"{place} has shape {array.shape}; allowed: {allowed}")
    if not np.isfinite(array).all():
        index = tuple(int(i) for i in np.argwhere(~np.isfinite(array))[0])
        raise StarnavError(f"{place}{list(index)} is {array[index]}; allowed: finite numbers")
    return array
