"""The robot's body and limits."""

from collections.abc import Sequence
from dataclasses import dataclass, field
from functools import cached_property
from typing import Any, NamedTuple

import numpy as np

from drake_starnav.errors import StarnavError, shown
from drake_starnav.geometry.footprint import Footprint, disc, footprint
from drake_starnav.parameters import check_parameters, parameter

MODEL_FILES = (".urdf", ".xacro")
"""What the name of a robot's own file ends with."""


class Limits(NamedTuple):
    """The limits of the drive, as compiled functions take them.

    Attributes:
        max_speed: m/s.
        max_yaw_rate: rad/s.
        max_acceleration: m/s^2.
        max_yaw_acceleration: rad/s^2.
    """

    max_speed: float
    max_yaw_rate: float
    max_acceleration: float
    max_yaw_acceleration: float


def saturated(twist: Sequence[float] | np.ndarray, limits: Limits) -> tuple[float, float]:
    """A twist (v, omega), m/s and rad/s, each cut off where it exceeds the robot's limit; NaN stays NaN.

    The one place where what is asked of a robot becomes what it can do: the shield asks here, and so do the wheels.
    """
    v, omega = float(twist[0]), float(twist[1])
    return (
        min(max(v, -limits.max_speed), limits.max_speed),
        min(max(omega, -limits.max_yaw_rate), limits.max_yaw_rate),
    )


@dataclass(frozen=True)
class RobotParameters:
    """A differential drive: a disc, or of polygons."""

    model: str = parameter("starbot", "shipped robot by name, or a path to a URDF (docs/extend.md)")
    wheel_joints: tuple[str, str] = parameter(
        ("", ""), "joints of the left and the right wheel, several separated by spaces; empty: found by their axes"
    )
    radius: float = parameter(
        0.25,
        "radius of the disc that contains the hull",
        unit="m",
        low=0.01,
        high=5.0,
        when="a round robot of another size",
    )
    footprint: list[Any] = field(
        default_factory=list,
        metadata={
            "help": "what it covers of the floor, if it is no disc: a convex polygon [[x, y], ...], m, x ahead, in the "
            "frame that it turns about; or a list of such polygons, of which it is the union",
            "when": "a robot that is no disc",
        },
    )
    max_speed: float = parameter(
        0.8,
        "largest forward speed",
        unit="m/s",
        low=0.01,
        high=10.0,
        when="raise it together with the accelerations, see docs/tuning.md",
    )
    max_yaw_rate: float = parameter(2.0, "largest turning rate", unit="rad/s", low=0.01, high=20.0)
    max_acceleration: float = parameter(
        1.0,
        "largest change of speed",
        unit="m/s^2",
        low=0.01,
        high=50.0,
        when="no more than the floor gives: the certificate trusts it to brake",
    )
    max_yaw_acceleration: float = parameter(4.0, "largest change of turning rate", unit="rad/s^2", low=0.01, high=200.0)
    mass_error: float = parameter(
        0.0, "by which share the simulated base is heavier than its model says", low=-0.9, high=10.0
    )

    def __post_init__(self) -> None:
        check_parameters(self, "robot")
        if not self.footprint:
            return
        circumscribed = self.shape.radius
        if self.radius not in (RobotParameters.radius, circumscribed):
            raise StarnavError(
                f"robot.radius is {self.radius:g} m beside robot.footprint; allowed: one of them, as the radius of a "
                "polygon follows from it"
            )
        object.__setattr__(self, "radius", circumscribed)

    @cached_property
    def shape(self) -> Footprint:
        """What it covers of the floor; `radius` is that of the disc which contains it.

        Raises:
            StarnavError: `footprint` holds no convex polygons.
        """
        if not self.footprint:
            return disc(self.radius)
        try:
            return footprint(_tuples(self.footprint))
        except (IndexError, TypeError, ValueError):
            raise StarnavError(
                f"robot.footprint is {shown(self.footprint)}; allowed: [[x, y], ...], or a list of such lists, m"
            ) from None
        except StarnavError as error:
            raise StarnavError(f"robot.{error}") from None

    @cached_property
    def limits(self) -> Limits:
        """Of speeds and accelerations; all floats, or kernels would be compiled again for whole numbers."""
        return Limits(
            float(self.max_speed),
            float(self.max_yaw_rate),
            float(self.max_acceleration),
            float(self.max_yaw_acceleration),
        )


def _tuples(value: Any) -> Any:
    """A nested list as nested tuples."""
    return tuple(_tuples(part) for part in value) if isinstance(value, (list, tuple)) else value
