"""The robot's body and limits."""

from collections.abc import Sequence
from dataclasses import dataclass
from functools import cached_property
from typing import NamedTuple

import numpy as np

from drake_starnav.parameters import check_parameters, parameter


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
    """A disc-shaped differential drive."""

    model: str = parameter("starbot", "shipped robot by name, or a path to a URDF (docs/extend.md)")
    wheel_joints: tuple[str, str] = parameter(
        ("left_wheel", "right_wheel"), "names of the joints of the left and the right wheel in a URDF of your own"
    )
    radius: float = parameter(
        0.25,
        "radius of the disc that contains the hull",
        unit="m",
        low=0.01,
        high=5.0,
        when="another robot: half the diagonal of its outline",
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

    @cached_property
    def limits(self) -> Limits:
        """Of speeds and accelerations; all floats, or kernels would be compiled again for whole numbers."""
        return Limits(
            float(self.max_speed),
            float(self.max_yaw_rate),
            float(self.max_acceleration),
            float(self.max_yaw_acceleration),
        )
