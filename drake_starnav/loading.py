"""Scenarios by name, file or text, with the footprint of the robot's model unless they give one."""

import dataclasses
from collections.abc import Sequence
from pathlib import Path
from typing import Any

from drake_starnav.scenario import scenario_file
from drake_starnav.scenario.schema import Scenario


def load_scenario(name_or_path: str | Path, *, method: str = "star", overrides: Sequence[str] = ()) -> Scenario:
    """A shipped scenario by name, or one from a YAML file by path.

    The footprint of a URDF of your own is that of its collision shapes, unless the scenario gives one.

    Args:
        name_or_path: e.g. "forest", or "my/world.yaml".
        method: whose settings the scenario's own keys are laid over; see `METHODS`.
        overrides: "dotted.key=value" texts, laid over the scenario's keys.

    Raises:
        StarnavError: no such scenario, method or model, broken YAML, unknown key, or a value that is not allowed.
    """
    return _with_own_shape(scenario_file.load_scenario(name_or_path, method=method, overrides=overrides))


def parse_scenario(text: str, *, name: str, **given: Any) -> Scenario:
    """A scenario from YAML text, otherwise as `load_scenario`.

    Args:
        text: what a scenario's file holds.
        name: of the scenario, in reports.
        given: `method` and `overrides` as in `load_scenario`; `folder`, at which paths in the text begin, without it
            where the program runs; `place`, which names the text in messages.

    Raises:
        StarnavError: as in `load_scenario`.
    """
    return _with_own_shape(scenario_file.parse_scenario(text, name=name, **given))


def _with_own_shape(scenario: Scenario) -> Scenario:
    if scenario.robots:
        robots = scenario_file.declare_each_other([_with_own_shape(each) for each in scenario.robots])
        return dataclasses.replace(scenario, robots=tuple(robots))
    if scenario.robot.radius > 0.0:
        return scenario
    from drake_starnav.station.robot_model import add_own_shape  # by Drake, which numerics do without

    return add_own_shape(scenario)
