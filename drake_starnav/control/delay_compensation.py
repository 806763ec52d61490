"""The pose at which the next command takes effect: pending commands are motion already decided."""

import math

import numpy as np


def commands_in_delay(delay: float, period: float) -> int:
    """How many of the last commands are pending when the next one is due.

    Args:
        delay: from a command to its effect, s.
        period: between commands, s.
    """
    return math.ceil(delay / period - 1e-9)


def predicted_pose(pose: np.ndarray, twists: np.ndarray, delay: float, period: float) -> np.ndarray:
    """The pose at which the command that is due now takes effect, shape (3,).

    The certificate holds from there on: the motion up to it was certified when its commands were sent.

    Args:
        pose: (x, y, yaw) now, m and rad.
        twists: shape (n, 2), the last n = `commands_in_delay` commands (v, omega), oldest first, m/s and rad/s.
        delay: from a command to its effect, s.
        period: between commands, s.
    """
    x, y, yaw = pose
    for k, (v, omega) in enumerate(twists):
        time = delay - (len(twists) - 1) * period if k == 0 else period  # part of the oldest has already acted
        turn = omega * time
        # the chord of the arc: sin(turn/2) / (turn/2) of its length
        chord = v * time * float(np.sinc(turn / (2.0 * math.pi)))
        x, y = x + chord * math.cos(yaw + 0.5 * turn), y + chord * math.sin(yaw + 0.5 * turn)
        yaw += turn
    return np.array((x, y, yaw))
