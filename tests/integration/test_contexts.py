"""Contexts own everything that changes: runs in them do not know of one another."""

import dataclasses
from collections.abc import Iterator
from typing import Any

import numpy as np
import pytest
from pydrake.systems.analysis import Simulator
from pydrake.systems.framework import Context, Diagram, DiagramBuilder, System
from pydrake.systems.primitives import LogVectorOutput, VectorLogSink

from drake_starnav.navigation import add_navigation
from drake_starnav.planning import PlannerStatus
from drake_starnav.planning.grid import Grid
from drake_starnav.scenario.scenario_file import parse_scenario
from drake_starnav.scenario.shipped import METHODS
from drake_starnav.simulation.monitors import ArrivalMonitor
from drake_starnav.station.monitors import CollisionMonitor
from drake_starnav.utils.stopwatch import Stopwatch
from tests.helpers.posts import POSTS, posts

pytestmark = pytest.mark.slow

OFF_GRID = 1.2013
"""Between two events of every system, s."""


UNLIKE = {"point_cloud", "X_WS"}
"""Ports whose values of Drake's own types cannot be compared; they follow from others."""
AT_EVENTS = 1.2
"""When every system is updated, or waits for its update, s."""
FAULTS = """
lidar: {noise: 0.02, dropout: 0.02, outliers: 0.01, delay: 0.06, scan_loss: 0.1, silence_start: 1.5,
    silence_duration: 0.2, quantisation: 0.01, rolling: true}
localization: {drift: 0.03, jump: 0.05, jump_interval: 0.7}
drive: {delay: 0.04, slip: 0.1}
"""


def all_states(diagram: Diagram, context: Context) -> dict[str, Any]:
    """Everything that the context remembers, comparable: all states of all systems, and what the outputs show."""
    found: dict[str, Any] = {"time": context.get_time()}
    for k in range(context.num_discrete_state_groups()):
        found[f"discrete {k}"] = context.get_discrete_state(k).value().copy()
    for system in python_systems(diagram):
        path, own = system.GetSystemPathname(), system.GetMyContextFromRoot(context)
        if isinstance(system, Diagram):
            continue
        for k in range(own.num_abstract_states()):
            found[f"{path} abstract {k}"] = own.get_abstract_state(k).get_value()
        for k in range(system.num_output_ports()):
            port = system.get_output_port(k)
            if port.get_name() not in UNLIKE:
                found[f"{path} {port.get_name()}"] = port.Eval(own)
    return {name: structure(value) for name, value in found.items()}


def motion(log: VectorLogSink, context: Context) -> tuple[np.ndarray, np.ndarray]:
    """Times and values that were logged, each time once: a run logs its beginning, which the one before it did too."""
    record = log.FindLog(context)
    times, first = np.unique(record.sample_times(), return_index=True)
    return times, record.data()[:, first]


def structure(value: Any) -> Any:
    """A value as nested tuples that compare by content; what cannot be looked into stands for itself by identity."""
    if isinstance(value, np.ndarray):
        return value.shape, value.tobytes()
    if isinstance(value, Grid):  # which of the tiles that grids share are whose depends on who came first
        return value.resolution, value.cap, structure(value.tiles)
    if dataclasses.is_dataclass(value) and not isinstance(value, type):
        fields = [f.name for f in dataclasses.fields(value) if f.compare]
        return type(value), tuple((name, structure(getattr(value, name))) for name in fields)
    if isinstance(value, dict):
        return tuple((structure(key), structure(item)) for key, item in value.items())
    if isinstance(value, (list, tuple)):
        return tuple(structure(item) for item in value)
    if isinstance(value, (set, frozenset)):
        return frozenset(structure(item) for item in value)
    if value is None or isinstance(value, (bool, int, float, str, PlannerStatus)):
        return value
    if type(value).__module__.startswith("drake_starnav") and not isinstance(value, System):
        return type(value), structure(vars(value))
    return id(value)


def python_systems(diagram: Diagram) -> Iterator[System]:
    """All systems of this package in a diagram, at every depth."""
    for system in diagram.GetSystems():
        if type(system).__module__.startswith("drake_starnav"):
            yield system
        if isinstance(system, Diagram):
            yield from python_systems(system)


@pytest.mark.parametrize(
    ("scenario", "method", "time"),
    [
        *(("posts", "star", time) for time in (0.0031, AT_EVENTS)),
        *(("obstacles", "star", time) for time in (0.0, OFF_GRID)),
        *(("posts", method, OFF_GRID) for method in METHODS if method != "star"),
        ("obstacles", "dwa", OFF_GRID),
    ],
)
def test_a_clone_under_a_new_simulator_goes_on_with_every_fault(scenario: str, method: str, time: float) -> None:
    """With all that a trial has: monitors, a log, and obstacles that move."""
    scenarios = {"posts": POSTS + FAULTS, "obstacles": "world: !Crowd {}\nobstacles: {max_speed: 0.8}\n" + FAULTS}
    builder = DiagramBuilder()
    made = parse_scenario(scenarios[scenario], name=scenario, method=method)
    navigation = add_navigation(builder, made, seed=3)
    CollisionMonitor.AddToBuilder(builder, navigation.station)
    port = navigation.station.GetOutputPort("cheat.robot_state")
    log = LogVectorOutput(port, builder, made.simulation.time_step)
    diagram = builder.Build()
    simulator = Simulator(diagram)
    simulator.Initialize()
    if time > 0.0:
        simulator.AdvanceTo(time)
    twin = Simulator(diagram, simulator.get_context().Clone())
    for until in (time + 0.0217, time + 1.0, time + 2.1003):
        simulator.AdvanceTo(until)
        twin.AdvanceTo(until)
        assert all_states(diagram, twin.get_context()) == all_states(diagram, simulator.get_context())
    expected, found = motion(log, simulator.get_context()), motion(log, twin.get_context())
    assert np.array_equal(expected[0], found[0])
    assert np.array_equal(expected[1], found[1])
    assert np.abs(np.diff(expected[1], axis=1)).max() > 0.0


def test_no_system_keeps_state_of_its_own() -> None:
    """What the objects hold is the same before and after a run, apart from the stopwatch."""
    stopwatch = Stopwatch()
    builder = DiagramBuilder()
    navigation = add_navigation(builder, posts(), stopwatch=stopwatch)
    station = navigation.station
    CollisionMonitor.AddToBuilder(builder, station)
    ArrivalMonitor.AddToBuilder(builder, navigation)
    diagram = builder.Build()

    def held() -> dict[str, Any]:
        return {
            system.GetSystemPathname(): {
                name: structure(value)
                for name, value in vars(system).items()
                if value is not stopwatch and not name.startswith("_pydrake")
            }
            for system in python_systems(diagram)
        }

    before = held()
    assert len(before) == 12
    simulator = Simulator(diagram)
    simulator.AdvanceTo(1.5)
    assert stopwatch.summarize("plan")["count"] >= 1
    assert held() == before
