"""Parameters that document and validate themselves.

A parameter is a field of a frozen dataclass, declared with `parameter(...)`: its unit, allowed range
and meaning stand beside its default, so that one check and one generated table serve every room.
"""

import contextlib
import dataclasses
import difflib
import functools
import math
import os
import types
import typing
from collections.abc import Iterable, Mapping
from typing import Any

import numpy as np

from drake_starnav.errors import StarnavError, shown

LARGEST = 1e300
"""Numbers whose size is larger count as infinite."""
LONGEST_NAME = 200
"""Characters of an unknown name that a message shows."""
_KINDS = {
    bool: "true or false",
    int: "a whole number",
    float: "a number",
    str: "a text",
    tuple[int, int]: "[least, most], two whole numbers",
    tuple[float, float]: "[least, most], two numbers",
    tuple[str, str]: "a list of two names",
    dict[str, Any]: "a mapping",
}
"""Types of parameters, in words."""


class Declaration(typing.TypedDict, total=False):
    """What may be declared of a parameter besides its default and its meaning.

    Attributes:
        unit: SI unit, empty for a pure number.
        low, high: smallest and largest allowed value, inclusive.
        above: exclusive lower limit.
        choices: the allowed strings.
        path: whether it names a file; a name in a scenario file is relative to that file.
        when: one sentence: when to change it, and how; empty where there is nothing to advise.
    """

    unit: str
    low: float
    high: float
    above: float
    choices: tuple[str, ...]
    path: bool
    when: str


def parameter(default: Any, help: str, **declared: typing.Unpack[Declaration]) -> Any:
    """A dataclass field that carries its own documentation and limits.

    A field of type `tuple[int, int]` or `tuple[float, float]` is a range [least, most]; the limits hold for both ends.
    One of type `tuple[str, str]` is two names.

    Args:
        default: the default value; of a list, each instance has a copy.
        help: its meaning, in one sentence.
        declared: its unit and limits, see `Declaration`.
    """
    given: dict[str, Any] = (
        {"default_factory": lambda: list(default)} if isinstance(default, list) else {"default": default}
    )
    return dataclasses.field(**given, metadata={"help": help, **declared})


def declared(cls: Any) -> list[dataclasses.Field]:
    """The fields of a dataclass, or of an instance of one, that `parameter` made; others are derived, never read."""
    return [field for field in dataclasses.fields(cls) if field.metadata]


def allowed_text(field: dataclasses.Field) -> str:
    """What a parameter may be, in words: `0 < x <= 5 m`, `one of a, b`, `true or false`."""
    meta = field.metadata
    if meta.get("choices"):
        return "one of " + ", ".join(meta["choices"])
    if field.type in (bool, "bool"):
        return "true or false"
    unit = f" {meta['unit']}" if meta.get("unit") else ""
    left = ""
    if meta.get("above") is not None:
        left = f"{meta['above']:g} < "
    elif meta.get("low") is not None:
        left = f"{meta['low']:g} <= "
    right = f" <= {meta['high']:g}" if meta.get("high") is not None else ""
    if field.type in (str, "str"):
        return "a path" if meta.get("path") else "a text"
    if typing.get_origin(field.type) is list:
        return "a list"
    if field.type in (tuple[str, str], dict[str, Any]):
        return _KINDS[field.type]
    is_range = typing.get_origin(field.type) is tuple
    kind = "whole number" if field.type in (int, "int", tuple[int, int]) else "finite number"
    text = f"{left}x{right}{unit}" if left or right else f"a {kind}{unit}"
    return f"[least, most], {text}" if is_range else text


def is_number(value: Any) -> bool:
    """Whether a value is a number with which arithmetic is possible; a whole one may be too large for that."""
    return isinstance(value, (int, float)) and not isinstance(value, bool) and abs(value) <= LARGEST


@functools.cache
def plain_struct(cls: type) -> Any:
    """A mutable twin of a frozen parameter dataclass: the same name, fields and defaults, unchecked until it is used.

    Drake's `yaml_load_typed` sets one attribute after the other, which a frozen dataclass does not allow. Tuples are
    lists in it.
    """
    kinds = typing.get_type_hints(cls)
    fields = []
    for given in declared(cls):
        kind: Any = kinds[given.name]
        default: dict[str, Any] = {"default": given.default}
        if given.default_factory is not dataclasses.MISSING:
            default = {"default_factory": given.default_factory}
        elif typing.get_origin(kind) is tuple:  # which Drake does not read
            kind = types.GenericAlias(list, typing.get_args(kind)[:1])
            default = {"default_factory": functools.partial(list, given.default)}
        fields.append((given.name, kind, dataclasses.field(**default, metadata=given.metadata)))
    return dataclasses.make_dataclass(cls.__name__, fields, namespace={"__doc__": cls.__doc__})


def check_parameters(parameters: Any, place: str) -> None:
    """Raise `StarnavError` for the first value of a wrong type or out of its declared limits.

    NumPy's scalars become Python's, and whole numbers floats where these are asked for.

    Args:
        parameters: an instance of a dataclass whose fields were made by `parameter`.
        place: dotted name of the instance for the message, e.g. "lidar".
    """
    kinds = typing.get_type_hints(type(parameters))
    for field in declared(parameters):
        meta = field.metadata
        given = getattr(parameters, field.name)
        try:
            value = convert(given, kinds[field.name], place)
            good = _within_limits(value, meta)
        except StarnavError:
            value, good = given, False
        if not good:
            written = list(given) if isinstance(given, tuple) else given
            raise StarnavError(f"{place}.{field.name} is {shown(written)}; allowed: {allowed_text(field)}")
        object.__setattr__(parameters, field.name, value)


class Checked:
    """A dataclass of parameters that are checked as it is made; `place` names its section in messages."""

    _place: typing.ClassVar[str]

    def __init_subclass__(cls, *, place: str) -> None:
        cls._place = place

    def __post_init__(self) -> None:
        check_parameters(self, self._place)


def _within_limits(value: Any, meta: Mapping[str, Any]) -> bool:
    """Whether a converted value is what its field's metadata declare; a range also has to be in order."""
    if isinstance(value, tuple):
        return (isinstance(value[0], str) or value[0] <= value[1]) and all(_within_limits(end, meta) for end in value)
    if meta.get("choices"):
        return value in meta["choices"]
    if isinstance(value, bool) or not isinstance(value, (int, float)):
        return True
    return (
        is_number(value)
        and not (meta.get("low") is not None and value < meta["low"])
        and not (meta.get("high") is not None and value > meta["high"])
        and not (meta.get("above") is not None and value <= meta["above"])
    )


def convert(value: Any, kind: Any, place: str) -> Any:
    """The value, as YAML or NumPy gives it, as a parameter of type `kind`, or a `StarnavError` that names `place`."""
    if isinstance(value, (np.generic, np.ndarray)):
        value = value.tolist()
    if kind is bool and isinstance(value, bool):
        return value
    if kind is int and isinstance(value, int) and not isinstance(value, bool):
        return value
    if kind is float and isinstance(value, (int, float)) and not isinstance(value, bool):
        return float(value) if not abs(value) > LARGEST else math.inf if value > 0 else -math.inf
    if kind is str and isinstance(value, (str, os.PathLike)):
        return os.fspath(value)
    if kind == dict[str, Any] and isinstance(value, dict):
        return dict(value)  # its owner checks the entries
    if typing.get_origin(kind) is list and isinstance(value, (list, tuple)):
        return list(value)  # its owner checks the entries
    if typing.get_origin(kind) is tuple and isinstance(value, (list, tuple)) and len(value) == 2:
        with contextlib.suppress(StarnavError):
            return tuple(convert(end, typing.get_args(kind)[0], place) for end in value)
    raise StarnavError(f"{place} is {shown(value)}; allowed: {_KINDS.get(kind, 'a list')}")


def build(cls: type, mapping: Any, place: str, base: Any = None) -> Any:
    """An instance of the parameter dataclass `cls` from a mapping, every key and value checked.

    Args:
        cls: the dataclass.
        mapping: key -> value, as read from YAML; None for all defaults.
        place: dotted name for messages.
        base: an instance whose values serve as defaults.

    Raises:
        StarnavError: unknown key (with the nearest valid one), wrong type, or value out of range.
    """
    if mapping is None:
        mapping = {}
    if not isinstance(mapping, dict):
        raise StarnavError(f"{place} is {shown(mapping)}; allowed: a mapping of {', '.join(_names(cls))}")
    kinds = typing.get_type_hints(cls)
    values = {}
    for key, value in mapping.items():
        if key not in _names(cls):
            raise unknown_name(f"key {place}.{key}", str(key), _names(cls))
        values[key] = convert(value, kinds[key], f"{place}.{key}")
    instance = dataclasses.replace(base, **values) if base is not None else cls(**values)
    check_parameters(instance, place)
    return instance


def unknown_name(what: str, name: str, valid: Iterable[str]) -> StarnavError:
    """The error for a name that is not among the valid ones; it suggests the nearest."""
    valid = list(valid)
    what = what if len(what) <= LONGEST_NAME else f"{what[: LONGEST_NAME - 3]}..."
    near = difflib.get_close_matches(name[:LONGEST_NAME], valid, n=1)
    hint = f"did you mean {near[0]}? " if near else ""
    return StarnavError(f"unknown {what}: {hint}allowed: {', '.join(valid) or 'none'}")


def _names(cls: type) -> list[str]:
    return [f.name for f in declared(cls)]
