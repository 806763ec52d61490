"""The ROS 2 messages that a robot's loop reads and writes, as types of Cyclone DDS."""

import dataclasses
import re
from functools import partial
from types import new_class
from typing import Any

from cyclonedds.idl import IdlStruct, types

from drake_starnav.runtime.ros2_definitions import FIELDS

PLAIN: dict[str, tuple[Any, Any]] = {"string": (str, ""), "bool": (bool, False)}
PLAIN |= {name: (getattr(types, name), 0) for name in ("uint8", "int32", "uint32")}
PLAIN |= {name: (getattr(types, name), 0.0) for name in ("float32", "float64")}


def make_dds_name(kind: str) -> str:
    """The name that DDS has for a type."""
    package, _, name = kind.partition("/")
    return f"{package}::msg::dds_::{name}_"


def make_ros_name(name: str) -> str:
    """The type that DDS has a name for; the name itself if it is no message of ROS."""
    match = re.fullmatch(r"(\w+)::msg::dds_::(\w+)_", name)
    return "/".join(match.groups()) if match else name


class Messages:
    """The classes of FIELDS as attributes; each field has a value from the start: zero, empty, or 1 of a `w`."""

    def __init__(self) -> None:
        for kind, definition in FIELDS.items():
            fields = [self._field(*each.split()) for each in definition.split(", ")]
            name = kind.partition("/")[2]
            message_class = new_class(name, (IdlStruct,), {"typename": make_dds_name(kind)}, partial(_declare, fields))
            setattr(self, name, dataclasses.dataclass(message_class))

    def __getattr__(self, name: str) -> Any:
        raise AttributeError(f"no message {name}; allowed: {', '.join(FIELDS)}")

    def _field(self, kind: str, name: str) -> tuple[str, Any, Any]:
        """Name, type and initial value of a field."""
        base, _, count = kind.rstrip("]").partition("[")
        each, value = PLAIN[base] if base in PLAIN else (getattr(self, base), None)
        if kind != base:
            field_type = types.array[each, int(count)] if count else types.sequence[each]
            return name, field_type, dataclasses.field(default_factory=lambda: int(count or 0) * [value])
        return name, each, dataclasses.field(default_factory=each) if value is None else 1.0 if name == "w" else value


def _declare(fields: list[tuple[str, Any, Any]], space: dict[str, Any]) -> None:
    """The body of a class with these fields."""
    for name, kind, value in fields:
        space["__annotations__"][name] = kind
        space[name] = value


MESSAGES = Messages()
