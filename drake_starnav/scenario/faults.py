"""Faults of localization and drive: declared bounds of the errors that `fault_models` draws.

The faults of the lidar are parameters of the lidar, `mass_error` one of the robot. A declared fault is simulated, and
navigation allows for it (see `margins`); what is not declared is neither simulated nor allowed for.
"""

from dataclasses import dataclass

from drake_starnav.parameters import Checked, parameter


@dataclass(frozen=True)
class LocalizationParameters(Checked, place="localization"):
    """How the believed pose of the robot differs from the true one."""

    drift: float = parameter(
        0.0,
        "error of the believed position as a share of the distance travelled, and of the heading as a share of the "
        "angle turned",
        low=0.0,
        high=0.5,
    )
    jump: float = parameter(0.0, "how far the believed position jumps at times", unit="m", low=0.0, high=5.0)
    jump_interval: float = parameter(10.0, "time from jump to jump", unit="s", low=0.1, high=1e6)
    matching: bool = parameter(
        True,
        "where the believed pose errs, new scans are aligned with old ones to correct it (methods that follow the "
        "planner's guidance)",
    )

    @property
    def exact(self) -> bool:
        """Whether the believed pose is the truth."""
        return self.drift == 0.0 and self.jump == 0.0


@dataclass(frozen=True)
class DriveParameters(Checked, place="drive"):
    """How the robot's motion differs from what is commanded."""

    delay: float = parameter(
        0.0, "time from a command to its effect, rounded up to whole plant steps", unit="s", low=0.0, high=1.0
    )
    error: float = parameter(
        0.0,
        "how much farther than the shipped robots the base strays from its commands until it stands",
        unit="m",
        low=0.0,
        high=0.5,
        when="for a base that does not follow its commands well; it widens the safety margin, and is not simulated",
    )
    slip: float = parameter(
        0.0, "largest share of its speed that a wheel loses; drawn again for each wheel every second", low=0.0, high=0.5
    )
