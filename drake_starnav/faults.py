"""What may go wrong with localisation and drive: declared bounds, and the seeded errors they stand for.

The faults of the lidar are parameters of the lidar, `mass_error` one of the robot. A declared fault is simulated, and
navigation allows for it (see `tolerance`); what is not declared is neither simulated nor allowed for.
"""

import math
from dataclasses import dataclass

import numpy as np

from drake_starnav.parameters import check_parameters, parameter
from drake_starnav.planar import composed, now_in

DRIFT, JUMP, SLIP = 2, 3, 4
"""Streams of chance, besides the lidar's."""


@dataclass(frozen=True)
class LocalizationParameters:
    """How the pose that the robot believes differs from the truth."""

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

    def __post_init__(self) -> None:
        check_parameters(self, "localization")

    @property
    def exact(self) -> bool:
        """Whether the believed pose is the truth."""
        return self.drift == 0.0 and self.jump == 0.0


@dataclass(frozen=True)
class DriveParameters:
    """How the robot's motion differs from what is commanded."""

    delay: float = parameter(
        0.0, "time from a command to its effect, rounded up to whole plant steps", unit="s", low=0.0, high=1.0
    )
    slip: float = parameter(
        0.0, "largest share of its speed that a wheel loses; drawn for each wheel anew every second", low=0.0, high=0.5
    )

    def __post_init__(self) -> None:
        check_parameters(self, "drive")


def drifted(believed: np.ndarray, before: np.ndarray, now: np.ndarray, drift: float, seed: int) -> np.ndarray:
    """The believed pose after the robot went from one true pose to another.

    The error has one direction relative to the robot, and one sign of the heading, for a whole trial, so that it adds
    up as that of a badly calibrated odometry does.

    Args:
        believed: (x, y, yaw) at the true pose `before`, m and rad.
        before, now: true poses (x, y, yaw) in W; little motion lies between them.
        drift: error as a share of the distance travelled and of the angle turned.
        seed: a non-negative whole number below 2**64.

    Returns:
        shape (3,).
    """
    along, across, turn = now_in(before, now)
    angle, sign = _direction(seed)
    along, across = along + drift * along * math.cos(angle), across + drift * along * math.sin(angle)
    return composed(believed, (along, across, turn * (1.0 + drift * sign)))


def jumped(jump: float, seed: int, index: int) -> np.ndarray:
    """By how much the believed position jumps, shape (2,), m: its size is given, its direction drawn.

    Args:
        jump: size, m.
        seed: a non-negative whole number below 2**64.
        index: number of the jump.
    """
    angle = _generator(seed, JUMP, index).uniform(-math.pi, math.pi)
    return jump * np.array((math.cos(angle), math.sin(angle)))


def wheel_shares(slip: float, seed: int, index: int) -> np.ndarray:
    """Which share of its speed each wheel keeps, shape (2,): left and right.

    Args:
        slip: largest share that is lost.
        seed: a non-negative whole number below 2**64.
        index: number of the second.
    """
    return 1.0 - slip * _generator(seed, SLIP, index).random(2)


def _direction(seed: int) -> tuple[float, float]:
    """Direction of a trial's drift relative to the robot, rad, and the sign of its heading's."""
    generator = _generator(seed, DRIFT)
    return generator.uniform(-math.pi, math.pi), 1.0 if generator.random() < 0.5 else -1.0


def _generator(seed: int, stream: int, index: int = 0) -> np.random.Generator:
    return np.random.Generator(np.random.Philox(key=np.array([seed, stream], np.uint64), counter=index))
