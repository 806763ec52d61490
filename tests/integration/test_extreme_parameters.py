"""Each number that a parameter may be can be built with, or is refused in one sentence."""

import dataclasses
import math
import typing
import warnings

import numpy as np
import pytest
from pydrake.systems.analysis import Simulator
from pydrake.systems.framework import DiagramBuilder

from drake_starnav.errors import StarnavError
from drake_starnav.navigation import add_navigation
from drake_starnav.scenario.scenario_file import parse_scenario
from drake_starnav.scenario.schema import SECTIONS, Scenario
from drake_starnav.simulation.run import run_trial
from drake_starnav.visualization.recorder import Recorder
from drake_starnav.worlds import WORLD_KINDS, make_world

pytestmark = pytest.mark.slow

TEXT = "world: !Obstacles {cylinders: [[1.0, 0.9, 0.3]], goal: [1.5, 0.0], bounds: [-1, -2, 4, 2]}\n"
MODES = {
    "localization": ["localization.drift=0.01"],
    "obstacles": ["obstacles.max_speed=0.5"],
    **{kind: [f"controller.kind={kind}"] for kind in ("dsm", "foa", "dwa")},
}
"""What a section is in use with."""
HUGE = 1e300
SLOW = {
    ("Maze", "size"),
    ("Crowd", "moving_obstacles"),
    ("Crowd", "width"),
    ("Forest", "width"),
    ("Corridor", "fin"),
}
"""Worlds whose largest take seconds to draw."""


def numbers(cls: type) -> list[tuple[dataclasses.Field, type]]:
    """The numeric parameters of a section and their kinds."""
    kinds = typing.get_type_hints(cls)
    found = [(field, kinds[field.name]) for field in dataclasses.fields(cls)]
    return [(field, kind) for field, kind in found if kind in (int, float, tuple[int, int], tuple[float, float])]


def extremes(field: dataclasses.Field, kind: type) -> list[typing.Any]:
    """The least and the greatest value, those beside them, and some that are next to nothing."""
    if typing.get_origin(kind) is tuple:
        return [[value, value] for value in extremes(field, typing.get_args(kind)[0])]
    low, above, high = (field.metadata.get(name) for name in ("low", "above", "high"))
    if kind is int:
        return [low, high] if high is not None else [low, 10**30]
    tiny = [1e-300, 1e-12]
    least = [math.nextafter(above, math.inf)] if above is not None else [] if low is None else [low]
    greatest = [HUGE] if high is None else [high, math.nextafter(high, math.inf)]
    return [*least, *([] if low else tiny), *greatest]


@pytest.mark.parametrize(("first", "last"), [(0.0, 6.28), (6.28319, 0.0), (0.7, 6.9745)])
def test_a_robot_drives_wherever_the_seam_of_its_lidar_lies(first: float, last: float) -> None:
    scenario = parse_scenario(TEXT, name="seam", overrides=[f"lidar.angle_min={first}", f"lidar.angle_max={last}"])
    assert run_trial(scenario).outcome == "reached"


def build(overrides: list[str], record: bool = False) -> None:
    scenario: Scenario = parse_scenario(TEXT, name="extreme", overrides=overrides)
    builder = DiagramBuilder()
    navigation = add_navigation(builder, scenario)
    if record:
        recorder = Recorder("never.html")
        recorder.add_to(builder, navigation, scenario)
        recorder.start()
    simulator = Simulator(builder.Build())
    simulator.Initialize()
    simulator.AdvanceTo(scenario.simulation.time_step)


CASES = [(section, field, kind) for section, cls in SECTIONS.items() for field, kind in numbers(cls)]


@pytest.mark.parametrize(("section", "field", "kind"), CASES, ids=[f"{s}.{f.name}" for s, f, _ in CASES])
def test_extreme_parameters_are_built_with_or_refused(section: str, field: dataclasses.Field, kind: type) -> None:
    for value in extremes(field, kind):
        with warnings.catch_warnings():
            warnings.simplefilter("error")
            try:
                build([*MODES.get(section, []), f"{section}.{field.name}={value!r}"], record=section == "recording")
            except StarnavError as error:
                assert "allowed" in str(error) and "\n" not in str(error)


WORLD_CASES = [(name, field, kind) for name, cls in WORLD_KINDS.items() for field, kind in numbers(cls)]


@pytest.mark.parametrize(("name", "field", "kind"), WORLD_CASES, ids=[f"{n}.{f.name}" for n, f, _ in WORLD_CASES])
def test_extreme_worlds_are_made_or_refused(name: str, field: dataclasses.Field, kind: type) -> None:
    for value in extremes(field, kind)[: 2 if (name, field.name) in SLOW else None]:
        if (name, field.name) in SLOW and field.metadata.get("high") in (value, np.ravel(value)[0]):
            continue
        with warnings.catch_warnings():
            warnings.simplefilter("error")
            try:
                make_world(parse_scenario(f"world: !{name} {{{field.name}: {value!r}}}", name="x").world, 0, 0.25)
            except StarnavError as error:
                assert "allowed" in str(error) and "\n" not in str(error)
