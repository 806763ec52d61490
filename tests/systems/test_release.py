"""What has been let go of is freed at once, without the garbage collector."""

import dataclasses
import gc
import weakref
from collections.abc import Iterator
from typing import Any

import pytest
from pydrake.systems.framework import Diagram, DiagramBuilder, LeafSystem

from drake_starnav.scenario.scenario_file import load_scenario
from drake_starnav.simulation import run as trial_run
from drake_starnav.systems.release import declare_value, declare_vector, release, weakly
from tests.helpers.posts import posts

FAULTS = (
    "localization.drift=0.02", "localization.jump=0.05", "drive.delay=0.05", "drive.slip=0.1", "lidar.delay=0.06",
    "lidar.rolling=true",
)  # fmt: skip


class Source(LeafSystem):
    """A system with a port that it calculates."""

    def __init__(self) -> None:
        super().__init__()
        self.port = declare_vector(self, "one", 1, Source.one)
        self.other = declare_value(self, "two", "", lambda own, _: own.two, {self.nothing_ticket()})
        self.two, self.heard = "two", weakly(self.one)

    def one(self, context) -> list[float]:
        """The number 1."""
        return [1.0]


@pytest.fixture
def uncollected() -> Iterator[None]:
    gc.collect()
    gc.disable()
    yield
    gc.enable()


def everything(made: Diagram | DiagramBuilder) -> list[Any]:
    """Weak references to a diagram and all systems in it."""
    found = [weakref.ref(made)]
    for system in made.GetSystems():
        found.extend(everything(system) if isinstance(system, Diagram) else [weakref.ref(system)])
    return found


def test_a_method_held_weakly_works_as_long_as_its_system_lives() -> None:
    source = Source()
    context = source.CreateDefaultContext()
    assert source.port.Eval(context) == source.heard(context) == [1.0]
    assert source.other.Eval(context) == "two"


@pytest.mark.parametrize(
    ("scenario", "method"),
    [*(("posts", method) for method in ("star", "foa_roadmap", "dsm")), ("faults", "star"), ("crowd_room", "star")],
)
def test_a_trial_leaves_no_system_behind(scenario: str, method: str, monkeypatch, uncollected) -> None:
    made = posts(method=method, overrides=FAULTS if scenario == "faults" else ())
    if scenario == "crowd_room":
        made = load_scenario("crowd_room", method=method)
    left: list[Any] = []

    def watched(diagram: Diagram | DiagramBuilder) -> None:
        left.extend(each for each in everything(diagram) if not isinstance(each(), DiagramBuilder))
        release(diagram)

    made = dataclasses.replace(made, simulation=dataclasses.replace(made.simulation, timeout=0.2))

    trial_run.run_trial(made, method=method)  # a compiled one keeps its callers' frames until garbage is collected
    monkeypatch.setattr(trial_run, "release", watched)
    trial_run.run_trial(made, method=method)
    assert len(left) >= 8
    assert not [each() for each in left if each() is not None]
