"""Validate the lines of a file of trials."""

import json
from collections.abc import Callable, Iterable
from typing import Any

from drake_starnav.evaluation.jobs import NEVER_RAN
from drake_starnav.parameters import is_number
from drake_starnav.utils.stopwatch import STEPS

TEXT, NUMBER, COUNT, OR_NULL = "a text", "a finite number", "a whole number >= 0", " or null"
ALLOWED: dict[str, Callable[[Any], bool]] = {
    TEXT: lambda value: isinstance(value, str),
    NUMBER: is_number,
    COUNT: lambda value: type(value) is int and value >= 0,
    "a mapping": lambda value: isinstance(value, dict),
    "a list": lambda value: isinstance(value, list),
    "a list of [x, y]": lambda value: (
        isinstance(value, list)
        and all(isinstance(place, list) and len(place) == 2 and all(map(is_number, place)) for place in value)
    ),
    "true or false": lambda value: isinstance(value, bool),
}
"""Kinds of values, in words; those that end in `OR_NULL` may also be null."""
Schema = dict[str, Any]
"""Kinds of a mapping's fields, of which those that end in ? may be missing; a mapping or a list of one is nested."""

HEADER: Schema = {
    "format": COUNT, "versions": dict.fromkeys(("drake_starnav", "source", "drake"), TEXT), "seed": COUNT,
    "machine": {"processor": TEXT}, "suite": TEXT + OR_NULL, "overrides": [TEXT],
    "cases": [{"scenario": TEXT, "method": TEXT, "text": TEXT, "source?": TEXT}],
    "in_worlds?": "true or false", "files?": "a mapping", "command?": TEXT,
}  # fmt: skip
IF_THERE: Schema = {
    "world?": COUNT,
    "goals_s?": "a list",
    **dict.fromkeys(("contact?", "blocked_by?"), TEXT + OR_NULL),
    **dict.fromkeys(
        (
            "mean_speed_mps?", "mean_clearance_m?", "jerk_mps3?", "yaw_rate_change_radps2?", "twist_energy_m2ps?",
            "stops?", "stuck_s?", "nodes?", "blocked_s?",
        ),
        NUMBER + OR_NULL,
    ),
}  # fmt: skip
RECORD: Schema = {
    **dict.fromkeys(("scenario", "method", "outcome"), TEXT),
    **dict.fromkeys(("trial", "seed"), COUNT),
    "robots?": [{**dict.fromkeys(("robot", "scenario", "method", "outcome"), TEXT), **IF_THERE}],
    **IF_THERE,
}
RUN: Schema = {
    **dict.fromkeys(("time_s", "path_length_m", "wall_s"), NUMBER),
    **dict.fromkeys(
        ("shortest_path_m", "straight_line_m", "tightest_gap_m", "min_clearance_m", "score"), NUMBER + OR_NULL
    ),
    "state_hash": TEXT,
    "path": "a list of [x, y]",
    **dict.fromkeys(STEPS, {"count": COUNT, "p50_s": NUMBER + OR_NULL, "p99_s": NUMBER + OR_NULL}),
}
"""Fields of a trial that ran; one that did not run may have some of them."""


def header_fault(entry: Any) -> str | None:
    """The first fault of a header: field, value, and what is allowed; None if it is valid."""
    return _fault(entry, HEADER)


def record_fault(entry: Any) -> str | None:
    """The first fault of a record, or of one of its robots: field, value, and what is allowed; None if it is valid."""
    if fault := _fault(entry, RECORD):
        return fault
    if entry["outcome"] in NEVER_RAN and "time_s" not in entry:
        return _run_fault(entry, {f"{name}?": kind for name, kind in RUN.items()})
    robots = (_run_fault(robot, RUN, f"robots[{k}]") for k, robot in enumerate(entry.get("robots", ())))
    return _run_fault(entry, RUN) or _first(robots)


def _run_fault(entry: Schema, schema: Schema, place: str = "") -> str | None:
    """The first fault of what a robot drove; further numbers, of any name, are finite, and so are times of steps."""
    if fault := _fault(entry, schema, place):
        return fault
    timed = {step: {"p50_s": NUMBER, "p99_s": NUMBER} for step in STEPS if entry.get(step, {"count": 0})["count"]}
    numbers = {name: NUMBER for name, value in entry.items() if type(value) in (int, float)}
    return _fault(entry, timed | numbers, place)


def _fault(value: Any, schema: Any, place: str = "") -> str | None:
    """The first fault of a value whose place is named in its text."""
    kind = schema if isinstance(schema, str) else "a mapping" if isinstance(schema, dict) else "a list"
    if not ((value is None and kind.endswith(OR_NULL)) or ALLOWED[kind.removesuffix(OR_NULL)](value)):
        text = json.dumps(value)
        return f"{place or 'it'} is {text if len(text) <= 40 else f'{text[:37]}...'}; allowed: {kind}"
    if isinstance(schema, list):
        return _first(_fault(each, schema[0], f"{place}[{k}]") for k, each in enumerate(value))
    if isinstance(schema, dict):
        within = f"{place}." if place else ""
        for name, part in schema.items():
            if name not in value and not name.endswith("?"):
                return f"it has no {within}{name}; allowed: {part if isinstance(part, str) else 'a mapping'}"
        parts = ((name.removesuffix("?"), part) for name, part in schema.items())
        return _first(_fault(value[name], part, f"{within}{name}") for name, part in parts if name in value)
    return None


def _first(faults: Iterable[str | None]) -> str | None:
    return next(filter(None, faults), None)
