"""The seeded errors of localization and drive that simulate the declared faults."""

import math

import numpy as np

from drake_starnav.geometry.se2 import composed, now_in

DRIFT, JUMP, SLIP = 2, 3, 4
"""Random streams, besides the lidar's."""


def drifted(believed: np.ndarray, before: np.ndarray, now: np.ndarray, drift: float, seed: int) -> np.ndarray:
    """The believed pose after the robot went from one true pose to another, near it; (x, y, yaw) in W, m and rad.

    During a trial the error keeps one direction relative to the robot and one sign of the heading, so that it
    accumulates like that of a badly calibrated odometry.

    Args:
        believed: pose at the true one `before`.
        before, now: true poses.
        drift: error as a share of the distance travelled and of the angle turned.
        seed: a non-negative whole number below 2**64.
    """
    along, across, turn = now_in(before, now)
    generator = _generator(seed, DRIFT)
    angle, sign = generator.uniform(-math.pi, math.pi), 1.0 if generator.random() < 0.5 else -1.0
    along, across = along + drift * along * math.cos(angle), across + drift * along * math.sin(angle)
    return composed(believed, (along, across, turn * (1.0 + drift * sign)))


def jumped(jump: float, seed: int, index: int) -> np.ndarray:
    """The jump of that index of the believed position, shape (2,), m: its size is given, its direction drawn."""
    angle = _generator(seed, JUMP, index).uniform(-math.pi, math.pi)
    return jump * np.array((math.cos(angle), math.sin(angle)))


def wheel_shares(slip: float, seed: int, index: int) -> np.ndarray:
    """The share of its speed that each wheel, left and right, keeps in a second of that index; it may lose up to
    `slip`."""
    return 1.0 - slip * _generator(seed, SLIP, index).random(2)


def _generator(seed: int, stream: int, index: int = 0) -> np.random.Generator:
    return np.random.Generator(np.random.Philox(key=np.array([seed, stream], np.uint64), counter=index))
