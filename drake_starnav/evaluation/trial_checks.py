"""Validate the lines of a file of trials."""

import json
from collections.abc import Callable, Iterable, Mapping
from typing import Any

from drake_starnav.evaluation.jobs import NEVER_RAN
from drake_starnav.parameters import is_number
from drake_starnav.utils.stopwatch import STEPS


def _is_whole(value: Any) -> bool:
    return isinstance(value, int) and not isinstance(value, bool)


def _is_list(value: Any, of: Callable[[Any], bool]) -> bool:
    return isinstance(value, list) and all(map(of, value))


def _is_text(value: Any) -> bool:
    return isinstance(value, str)


ALLOWED: dict[str, Callable[[Any], bool]] = {
    "a text": _is_text,
    "a list of texts": lambda value: _is_list(value, _is_text),
    "true or false": lambda value: isinstance(value, bool),
    "a mapping": lambda value: isinstance(value, dict),
    "a list": lambda value: isinstance(value, list),
    "a list of [x, y]": lambda value: _is_list(value, lambda place: _is_list(place, is_number) and len(place) == 2),
    "a finite number": is_number,
    "a whole number": _is_whole,
    "a whole number >= 0": lambda value: _is_whole(value) and value >= 0,
}
"""Kinds of values, in words; those that end in `OR_NULL` may also be null."""
OR_NULL = " or null"
Kinds = Mapping[str, str]

HEADER: Kinds = {
    "format": "a whole number", "versions": "a mapping", "machine": "a mapping", "seed": "a whole number >= 0",
    "suite": "a text or null", "overrides": "a list of texts", "cases": "a list",
}  # fmt: skip
HEADER_IF_THERE: Kinds = {"in_worlds": "true or false", "files": "a mapping", "command": "a text"}
VERSIONS: Kinds = dict.fromkeys(("drake_starnav", "source", "drake"), "a text")
CASE: Kinds = dict.fromkeys(("scenario", "method", "text"), "a text")
RECORD: Kinds = {
    **dict.fromkeys(("scenario", "method", "outcome"), "a text"),
    **dict.fromkeys(("trial", "seed"), "a whole number >= 0"),
}
ROBOT: Kinds = dict.fromkeys(("robot", "scenario", "method", "outcome"), "a text")
"""Of one of several robots, beside what it drove."""
RUN: Kinds = {
    **dict.fromkeys(("time_s", "path_length_m", "wall_s"), "a finite number"),
    **dict.fromkeys(
        ("shortest_path_m", "straight_line_m", "tightest_gap_m", "min_clearance_m", "score"), "a finite number or null"
    ),
    "state_hash": "a text",
    "path": "a list of [x, y]",
    **dict.fromkeys(STEPS, "a mapping"),
}
"""Fields of a trial that ran; one that did not run may have some of them."""
RECORD_IF_THERE: Kinds = {
    "world": "a whole number >= 0",
    "goals_s": "a list",
    "robots": "a list",
    **dict.fromkeys(("contact", "blocked_by"), "a text or null"),
    **dict.fromkeys(
        (
            "mean_speed_mps", "mean_clearance_m", "jerk_mps3", "yaw_rate_change_radps2", "twist_energy_m2ps", "stops",
            "stuck_s", "nodes", "blocked_s",
        ),
        "a finite number or null",
    ),
}  # fmt: skip


def header_fault(entry: Any) -> str | None:
    """The first fault of a header: field, value, and what is allowed; None if it is valid."""
    fault = _wrong("it", entry, "a mapping") or _fault(entry, HEADER, HEADER_IF_THERE)
    fault = fault or _fault(entry["versions"], VERSIONS, {}, "versions.")
    fault = fault or _fault(entry["machine"], {"processor": "a text"}, {}, "machine.")
    for number, case in enumerate(entry["cases"] if not fault else []):
        name = f"cases[{number}]"
        fault = fault or _wrong(name, case, "a mapping") or _fault(case, CASE, {"source": "a text"}, f"{name}.")
    return fault


def record_fault(entry: Any) -> str | None:
    """The first fault of a record, or of one of its robots: field, value, and what is allowed; None if it is valid."""
    fault = _wrong("it", entry, "a mapping") or _fault(entry, RECORD, RECORD_IF_THERE)
    if not fault and entry["outcome"] in NEVER_RAN and "time_s" not in entry:
        return _fault(entry, {}, RUN) or _not_finite(entry)
    fault = fault or _run_fault(entry)
    for number, robot in enumerate(entry.get("robots", ()) if not fault else ()):
        place = f"robots[{number}]"
        fault = fault or _wrong(place, robot, "a mapping") or _fault(robot, ROBOT, RECORD_IF_THERE, f"{place}.")
        fault = fault or _run_fault(robot, f"{place}.")
    return fault


def _run_fault(entry: dict[str, Any], place: str = "") -> str | None:
    """The first fault of what a robot drove."""
    fault = _fault(entry, RUN, {}, place)
    for step in STEPS:
        fault = fault or _fault(entry[step], {"count": "a whole number >= 0"}, {}, f"{place}{step}.")
        if not fault:
            time = f"a finite number{'' if entry[step]['count'] else OR_NULL}"
            fault = _fault(entry[step], {"p50_s": time, "p99_s": time}, {}, f"{place}{step}.")
    return fault or _not_finite(entry)


def _fault(entry: dict[str, Any], kinds: Kinds, if_there: Kinds, place: str = "") -> str | None:
    """The first fault among a mapping's fields; those of `if_there` may be missing."""
    missing = [f"it has no {place}{name}; allowed: {kind}" for name, kind in kinds.items() if name not in entry]
    there = ((f"{place}{name}", entry[name], kind) for name, kind in {**kinds, **if_there}.items() if name in entry)
    return missing[0] if missing else _first(_wrong(*field) for field in there)


def _not_finite(entry: dict[str, Any]) -> str | None:
    """The first number that is not finite, in fields of any name."""
    numbers = ((name, value) for name, value in entry.items() if type(value) in (int, float))
    return _first(_wrong(name, value, "a finite number") for name, value in numbers)


def _first(faults: Iterable[str | None]) -> str | None:
    return next(filter(None, faults), None)


def _wrong(name: str, value: Any, kind: str) -> str | None:
    if (value is None and kind.endswith(OR_NULL)) or ALLOWED[kind.removesuffix(OR_NULL)](value):
        return None
    text = json.dumps(value)
    return f"{name} is {text if len(text) <= 40 else f'{text[:37]}...'}; allowed: {kind}"
