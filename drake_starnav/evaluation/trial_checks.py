"""Validate the lines of a file of trials."""

import json
import math
from collections.abc import Callable, Mapping
from typing import Any

from drake_starnav.evaluation.jobs import NEVER_RAN
from drake_starnav.utils.stopwatch import STEPS

Kind = tuple[str, Callable[[Any], bool]]
"""The allowed values in words, and a predicate for them."""
Kinds = Mapping[str, Kind]


def _is_number(value: Any) -> bool:
    if isinstance(value, bool) or not isinstance(value, (int, float)):
        return False
    try:
        return math.isfinite(value)
    except OverflowError:  # a whole number beyond the floats
        return False


def _is_whole(value: Any) -> bool:
    return isinstance(value, int) and not isinstance(value, bool) and value >= 0


def _or_null(kind: Kind) -> Kind:
    return f"{kind[0]} or null", lambda value: value is None or kind[1](value)


TEXT: Kind = "a text", lambda value: isinstance(value, str)
FLAG: Kind = "true or false", lambda value: isinstance(value, bool)
MAPPING: Kind = "a mapping", lambda value: isinstance(value, dict)
LIST: Kind = "a list", lambda value: isinstance(value, list)
NUMBER: Kind = "a finite number", _is_number
WHOLE: Kind = "a whole number >= 0", _is_whole
INTEGER: Kind = "a whole number", lambda value: isinstance(value, int) and not isinstance(value, bool)
TEXTS: Kind = "a list of texts", lambda value: isinstance(value, list) and all(map(TEXT[1], value))
CORNERS: Kind = (
    "a list of [x, y]",
    lambda value: (
        isinstance(value, list)
        and all(isinstance(corner, list) and len(corner) == 2 and all(map(_is_number, corner)) for corner in value)
    ),
)

HEADER: Kinds = {
    "format": INTEGER, "versions": MAPPING, "machine": MAPPING, "seed": WHOLE, "suite": _or_null(TEXT),
    "overrides": TEXTS, "cases": LIST,
}  # fmt: skip
HEADER_IF_THERE: Kinds = {"in_worlds": FLAG, "files": MAPPING, "command": TEXT}
VERSIONS: Kinds = {"drake_starnav": TEXT, "source": TEXT, "drake": TEXT}
MACHINE: Kinds = {"processor": TEXT}
CASE: Kinds = {"scenario": TEXT, "method": TEXT, "text": TEXT}
CASE_IF_THERE: Kinds = {"source": TEXT}
RECORD: Kinds = {"scenario": TEXT, "method": TEXT, "trial": WHOLE, "seed": WHOLE, "outcome": TEXT}
RUN: Kinds = {
    "time_s": NUMBER, "path_length_m": NUMBER, "shortest_path_m": _or_null(NUMBER),
    "straight_line_m": _or_null(NUMBER), "tightest_gap_m": _or_null(NUMBER), "min_clearance_m": _or_null(NUMBER),
    "score": _or_null(NUMBER), "wall_s": NUMBER, "state_hash": TEXT, "path": CORNERS,
    **dict.fromkeys(STEPS, MAPPING),
}  # fmt: skip
"""Fields of a trial that ran; one that did not run may have some of them."""
RECORD_IF_THERE: Kinds = {
    "world": WHOLE,
    "contact": _or_null(TEXT),
    "blocked_by": _or_null(TEXT),
    **dict.fromkeys(
        (
            "mean_speed_mps", "mean_clearance_m", "jerk_mps3", "yaw_rate_change_radps2", "twist_energy_m2ps", "stops",
            "stuck_s", "nodes", "blocked_s",
        ),
        _or_null(NUMBER),
    ),
}  # fmt: skip


def header_fault(entry: Any) -> str | None:
    """The first fault of a header: field, value, and what is allowed; None if it is valid."""
    if not isinstance(entry, dict):
        return _shown("it", entry, MAPPING)
    fault = _fault(entry, HEADER, HEADER_IF_THERE)
    fault = fault or _fault(entry["versions"], VERSIONS, {}, "versions.")
    fault = fault or _fault(entry["machine"], MACHINE, {}, "machine.")
    for number, case in enumerate(entry["cases"] if not fault else []):
        if not isinstance(case, dict):
            return _shown(f"cases[{number}]", case, MAPPING)
        fault = fault or _fault(case, CASE, CASE_IF_THERE, f"cases[{number}].")
    return fault


def record_fault(entry: Any) -> str | None:
    """The first fault of a record: field, value, and what is allowed; None if it is valid."""
    if not isinstance(entry, dict):
        return _shown("it", entry, MAPPING)
    if fault := _fault(entry, RECORD, RECORD_IF_THERE):
        return fault
    if entry["outcome"] in NEVER_RAN and "time_s" not in entry:
        return _fault(entry, {}, RUN) or _not_finite(entry)
    fault = _fault(entry, RUN, {})
    for step in STEPS:
        fault = fault or _fault(entry[step], {"count": WHOLE}, {}, f"{step}.")
        if not fault:
            time = NUMBER if entry[step]["count"] else _or_null(NUMBER)
            fault = _fault(entry[step], {"p50_s": time, "p99_s": time}, {}, f"{step}.")
    return fault or _not_finite(entry)


def _fault(entry: dict[str, Any], kinds: Kinds, if_there: Kinds, place: str = "") -> str | None:
    """The first fault among a mapping's fields; those of `if_there` may be missing."""
    for name, kind in kinds.items():
        if name not in entry:
            return f"it has no {place}{name}; allowed: {kind[0]}"
    for name, kind in (*kinds.items(), *if_there.items()):
        if name in entry and not kind[1](entry[name]):
            return _shown(f"{place}{name}", entry[name], kind)
    return None


def _not_finite(entry: dict[str, Any]) -> str | None:
    """The first number that is not finite, in fields of any name."""
    for name, value in entry.items():
        if isinstance(value, (int, float)) and not isinstance(value, bool) and not _is_number(value):
            return _shown(name, value, NUMBER)
    return None


def _shown(name: str, value: Any, kind: Kind) -> str:
    text = json.dumps(value)
    return f"{name} is {text if len(text) <= 40 else f'{text[:37]}...'}; allowed: {kind[0]}"
