"""The ways to drive: our method, and baselines; all others are `Parts`."""

from collections.abc import Callable
from typing import NamedTuple

from pydrake.systems.framework import System

from drake_starnav.baselines import BASELINES
from drake_starnav.baselines.baseline_step import Baseline
from drake_starnav.control import follow_guidance
from drake_starnav.moving.parameters import DynamicObstacleParameters
from drake_starnav.navigation.parts import Parts, function_of
from drake_starnav.scenario.schema import Scenario
from drake_starnav.station.robot_interface import count_delay_steps
from drake_starnav.surroundings.margins import Margins
from drake_starnav.systems.baseline_controller import BaselineController
from drake_starnav.systems.dsm_controller import DsmController
from drake_starnav.utils.imported import import_named
from drake_starnav.utils.stopwatch import Stopwatch


class LoopConfig(NamedTuple):
    """What the systems of a loop are made of.

    Attributes:
        scenario: its parameters.
        margins: derived from it.
        parts: of the user's own.
        stopwatch: if any.
    """

    scenario: Scenario
    margins: Margins
    parts: Parts
    stopwatch: Stopwatch | None = None

    @property
    def method(self) -> "Method":
        """How the scenario is driven."""
        return BY_KIND[self.scenario.controller.kind]

    @property
    def obstacles(self) -> DynamicObstacleParameters | None:
        """What is declared of moving obstacles, where they are tracked and avoided."""
        has_tracker = self.scenario.obstacles.max_speed > 0.0 and self.plans and self.parts.certified
        return self.scenario.obstacles if has_tracker else None

    @property
    def plans(self) -> bool:
        """Whether there is a planner."""
        baseline = self.method.baseline
        return baseline is None or baseline.follows_roadmap

    @property
    def matches(self) -> bool:
        """Whether scans correct the believed pose: where it errs, and the controller follows the planner's guidance."""
        localization = self.scenario.localization
        return localization.matching and not localization.exact and self.method.guided

    @property
    def state_lead(self) -> float:
        """How late commands take effect, and so how far in the future a controller's state lies, s."""
        time_step = self.scenario.simulation.time_step
        return count_delay_steps(self.scenario.drive, time_step) * time_step


class Method(NamedTuple):
    """One way to drive.

    Attributes:
        controller: makes the system that proposes twists.
        baseline: that it compares with, as published: nothing certifies its twists. None for ours.
    """

    controller: Callable[[LoopConfig], System]
    baseline: Baseline | None = None

    @property
    def guided(self) -> bool:
        """Whether it follows the planner's guidance."""
        return self.baseline is None

    @property
    def shielded(self) -> bool:
        """Whether its twists are certified."""
        return self.baseline is None


def _make_dsm_controller(config: LoopConfig) -> System:
    return DsmController(
        config.scenario.robot,
        config.scenario.controller,
        config.margins,
        propose=function_of(config.parts.controller) or follow_guidance,
        obstacles=config.obstacles,
        state_lead=config.state_lead,
        stopwatch=config.stopwatch,
    )


def _make_baseline_controller(config: LoopConfig) -> System:
    baseline = config.method.baseline
    assert baseline is not None
    return BaselineController(config.scenario.robot, baseline, stopwatch=config.stopwatch)


BY_KIND = {
    "star": Method(_make_dsm_controller),
    **{
        name: Method(_make_baseline_controller, import_named("baseline", source)())
        for name, source in BASELINES.items()
    },
}
"""The methods by `controller.kind`."""
SHIELDED = ", ".join(kind for kind, method in BY_KIND.items() if method.shielded)
"""Kinds of those that are certified, as messages list them."""
