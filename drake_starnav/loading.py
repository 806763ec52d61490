"""Scenarios with the shape of the robot's model where nothing is said of it."""

import dataclasses
from collections.abc import Sequence
from pathlib import Path
from typing import Any

from drake_starnav.scenario import Scenario, scenario_file


def load_scenario(name_or_path: str | Path, *, method: str = "star", overrides: Sequence[str] = ()) -> Scenario:
    """A shipped scenario by name, or one from a YAML file by path.

    If nothing is said of the shape of a robot of the user's own, it is that of the model's collision shapes.

    Args:
        name_or_path: e.g. "forest", or "my/world.yaml".
        method: whose settings the scenario's own keys are laid over; see `METHODS`.
        overrides: "dotted.key=value" texts, laid over the scenario's keys.

    Raises:
        StarnavError: no such scenario, method or model, broken YAML, unknown key, or a value that is not allowed.
    """
    return _with_own_shape(scenario_file.load_scenario(name_or_path, method=method, overrides=overrides))


def parse_scenario(text: str, *, name: str, **given: Any) -> Scenario:
    """A scenario from YAML text; arguments as of `scenario.parse_scenario`, and the shape as for `load_scenario`."""
    return _with_own_shape(scenario_file.parse_scenario(text, name=name, **given))


def _with_own_shape(scenario: Scenario) -> Scenario:
    if scenario.robots:
        return dataclasses.replace(scenario, robots=tuple(map(_with_own_shape, scenario.robots)))
    if scenario.robot.radius > 0.0:
        return scenario
    from drake_starnav.station.own_shape import with_own_shape  # by Drake, which numerics do without

    return with_own_shape(scenario)
