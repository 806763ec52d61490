"""What the systems of a navigation loop are made of."""

from typing import NamedTuple

from drake_starnav.moving.parameters import DynamicObstacleParameters
from drake_starnav.navigation.parts import Parts
from drake_starnav.scenario.schema import Scenario
from drake_starnav.station.robot_interface import count_delay_steps
from drake_starnav.surroundings.margins import Margins
from drake_starnav.utils.stopwatch import Stopwatch


class LoopConfig(NamedTuple):
    """What the systems of a loop are made of.

    Attributes:
        scenario: its parameters.
        margins: derived from it.
        parts: of the user's own, or of a method.
        stopwatch: if any.
    """

    scenario: Scenario
    margins: Margins
    parts: Parts
    stopwatch: Stopwatch | None = None

    @property
    def obstacles(self) -> DynamicObstacleParameters | None:
        """What is declared of moving obstacles, where they are tracked and avoided."""
        is_tracked = self.scenario.obstacles.max_speed > 0.0 and self.parts.certified
        return self.scenario.obstacles if is_tracked else None

    @property
    def matches(self) -> bool:
        """Whether scans correct the believed pose: where it errs."""
        return self.scenario.localization.matching and not self.scenario.localization.exact

    @property
    def state_lead(self) -> float:
        """How late commands take effect, and so how far in the future a controller's state lies, s."""
        time_step = self.scenario.simulation.time_step
        return count_delay_steps(self.scenario.drive, time_step) * time_step
