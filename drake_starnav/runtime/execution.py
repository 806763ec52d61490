"""Whether the base does what it is told, within what is declared. Pure functions."""

import math
from collections.abc import Sequence
from typing import NamedTuple

import numpy as np

from drake_starnav.runtime.intake import Odometry
from drake_starnav.scenario.schema import Scenario

WINDOW = 2.0
"""What is told and what is done are compared over this time, s."""
OFF, OFF_SHARE = 0.1, 0.1
"""The way driven may differ from the one commanded by this, m, and by this share of it, beside what is declared."""
TURNED, TURNED_SHARE = 0.6, 0.2
"""The same of the angle turned, rad; wheels that slide turn a robot by some 0.3 rad in MuJoCo."""
LEAST_ARM = 0.5
"""Distance of a wheel that slips from the robot's axis, as a share of its radius."""


class Told(NamedTuple):
    """What was commanded from a time on, s: speeds along x and y, m/s, and turning, rad/s."""

    time: float
    ahead: float
    aside: float
    turning: float


def compared(told: Sequence[Told], rows: Sequence[Odometry], delay: float) -> tuple[np.ndarray, np.ndarray, float]:
    """What was commanded and what was driven, each (ahead, aside, turned), m and rad, and the time of both, s.

    `delay` is that of a command's effect, s. The time is 0 where nothing can be compared.
    """
    nothing = np.zeros(3), np.zeros(3), 0.0
    if len(told) < 2 or len(rows) < 2:
        return nothing
    orders, driven = np.array(told), np.array(rows)
    times = driven[:, 0]
    begin = max(times[-1] - WINDOW, orders[0, 0] + delay, times[0])
    driven = driven[np.searchsorted(times, begin) :]
    if len(driven) < 2:
        return nothing
    begin, end = driven[0, 0], driven[-1, 0]
    edges = np.clip(np.append(orders[:, 0], math.inf) + delay, begin, end)
    asked = (np.diff(edges)[:, None] * orders[:, 1:]).sum(axis=0)
    step = np.diff(driven[:, 1:4], axis=0)
    turn = np.mod(step[:, 2] + math.pi, 2.0 * math.pi) - math.pi
    yaw = driven[:-1, 3] + 0.5 * turn
    ahead = step[:, 0] * np.cos(yaw) + step[:, 1] * np.sin(yaw)
    aside = step[:, 1] * np.cos(yaw) - step[:, 0] * np.sin(yaw)
    return asked, np.array((ahead.sum(), aside.sum(), turn.sum())), float(end - begin)


def not_executed(told: Sequence[Told], rows: Sequence[Odometry], scenario: Scenario) -> str:
    """What the base, or its odometry, does other than it is told; empty: nothing."""
    drive = scenario.drive
    asked, driven, time = compared(told, rows, drive.delay)
    way, off = math.hypot(*asked[:2]), math.hypot(*(driven - asked)[:2])
    turn, turned = asked[2], driven[2]
    if off > OFF + drive.error + (OFF_SHARE + drive.slip) * way:
        done = math.hypot(*driven[:2])
        return f"not executed: {done:.2f} m driven by the odometry, {way:.2f} m commanded in {time:.1f} s"
    slipped = drive.slip * (abs(turn) + way / (LEAST_ARM * scenario.robot.radius))
    if abs(turned - turn) > TURNED + TURNED_SHARE * abs(turn) + slipped:
        return f"not executed: {turned:.2f} rad turned by the odometry, {turn:.2f} rad commanded in {time:.1f} s"
    return ""
