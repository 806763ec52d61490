"""Parameters of the controller."""

from dataclasses import dataclass

from drake_starnav.errors import StarnavError
from drake_starnav.parameters import Checked, parameter


@dataclass(frozen=True)
class ControllerParameters(Checked, place="controller"):
    """How guidance becomes a twist, and what certifies it.

    Attributes:
        delay: time from a command to its effect, at most one control period, for which the certificate allows, s; for a
            controller that is wired by hand without a `StatePredictor`.
    """

    rate: float = parameter(40.0, "commands a second", unit="Hz", low=0.1, high=1000.0)
    delay: float = 0.0

    def __post_init__(self) -> None:
        super().__post_init__()
        if not 0.0 <= self.delay <= 1.0 / self.rate:
            raise StarnavError(
                f"controller.delay is {self.delay:g} s; allowed: at most one control period, {1.0 / self.rate:g} s"
            )
