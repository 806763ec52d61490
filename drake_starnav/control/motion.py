"""The motion that follows a command: kept for its period after the delay, then full braking, as samples.

Every certificate is asked about this motion, and every prediction takes its steps.
"""

import math
from typing import NamedTuple

import numpy as np
from numba import njit
from numba.extending import register_jitable

from drake_starnav.control.heading_controller import slides
from drake_starnav.geometry.footprint import Footprint
from drake_starnav.robot import Limits
from drake_starnav.utils.snapshot import snapshot

SAMPLE_SPACING = 0.008
"""Largest distance between two samples, m."""
LONGEST_STEP = 0.04
"""Longest time between two samples, s."""
LARGEST_TURN = 0.25
"""Largest turn between two samples, rad: the chord is then short of its arc by 0.3 %."""
AT_REST = 1e-9
"""A speed below this is zero, m/s or rad/s."""
SAMPLES = 128
"""Room for so many samples is made at first; a motion may have more."""


class Pose(NamedTuple):
    """Of the robot in W; m and rad."""

    x: float
    y: float
    yaw: float


class Twist(NamedTuple):
    """Of the robot; m/s and rad/s."""

    v: float
    omega: float


@snapshot
class BrakingMotion:
    """What the shield guarantees about the robot's motion. Immutable.

    Attributes:
        certified: whether the last command passed the certificates; if not, it brakes.
        path: shape (n, 3), (x, y, yaw) in W of the robot braking fully from now on, m and rad.
    """

    certified: bool
    path: np.ndarray

    @staticmethod
    def none() -> "BrakingMotion":
        """Before the first command."""
        return BrakingMotion(False, np.zeros((1, 3)))


class Actuation(NamedTuple):
    """What a command does to the robot.

    Attributes:
        limits: of the robot.
        footprint: of the robot.
        hold: how long a command is followed, s: one control period.
        delay: from a command to its effect, s.
    """

    limits: Limits
    footprint: Footprint
    hold: float
    delay: float


class Motion(NamedTuple):
    """What the robot does if a command is sent and then it brakes, as samples.

    No two neighbours are farther apart than LONGEST_STEP or LARGEST_TURN; nor than SAMPLE_SPACING, each point of a
    footprint of polygons.

    Attributes:
        samples: shape (n, 6): x, y, yaw, v, omega and the time from now; W, SI units. The first is the robot now, in
            the last it stands.
        commanded: index of the sample from which on the command has effect.
        braking: index of the sample from which on the robot brakes.
        grips: whether no sample after `commanded` asks the wheels for more than they grip.
        footprint: of the robot.
    """

    samples: np.ndarray
    commanded: int
    braking: int
    grips: bool
    footprint: Footprint

    @property
    def position(self) -> np.ndarray:
        """Of the robot's centre, shape (n, 2), W, m."""
        return self.samples[:, :2]

    @property
    def pose(self) -> np.ndarray:
        """(x, y, yaw), shape (n, 3), W, m and rad."""
        return self.samples[:, :3]

    @property
    def twist(self) -> np.ndarray:
        """(v, omega), shape (n, 2), m/s and rad/s."""
        return self.samples[:, 3:5]

    @property
    def time(self) -> np.ndarray:
        """From now, shape (n,), s."""
        return self.samples[:, 5]


def roll_out(pose: np.ndarray, twist: np.ndarray, target: np.ndarray, actuation: Actuation) -> Motion:
    """The motion that follows a command.

    Args:
        pose: (x, y, yaw) of the robot in W, m and rad.
        twist: (v, omega) commanded now, m/s and rad/s; the robot keeps it for the delay.
        target: (v, omega) that is commanded, within the robot's limits.
        actuation: what commands do.
    """
    limits, footprint, hold, delay = actuation
    samples, phases = np.empty((SAMPLES, 6)), (delay, hold)
    count, commanded, braking, grips = _roll_out(pose, twist, target, phases, tuple(limits), footprint.lever, samples)
    while count > len(samples):  # made here, as Numba takes longer to hand out an array
        samples = np.empty((2 * len(samples), 6))
        count, commanded, braking, grips = _roll_out(
            pose, twist, target, phases, tuple(limits), footprint.lever, samples
        )
    return Motion(samples[:count], commanded, braking, grips, footprint)


@register_jitable
def ramped(value, target, change):
    """The value, moved towards the target by at most `change`."""
    return value + min(max(target - value, -change), change)


@register_jitable
def ramp_mean(value, target, change):
    """The mean of the value while it is moved towards the target by at most `change`, which it may reach on the way."""
    gap = abs(target - value)
    if gap >= change:
        return value + 0.5 * math.copysign(change, target - value)
    return target - 0.5 * (target - value) * gap / change


@njit(cache=True)
def stepped(pose, twist, target, step, limits):
    """Pose and twist after a step (s) towards a target twist, and the way driven (m), at the mean rates of the step."""
    faster, turned = limits.max_acceleration * step, limits.max_yaw_acceleration * step
    way, turn = ramp_mean(twist.v, target.v, faster) * step, ramp_mean(twist.omega, target.omega, turned) * step
    middle = pose.yaw + 0.5 * turn
    after = Pose(pose.x + way * math.cos(middle), pose.y + way * math.sin(middle), pose.yaw + turn)
    return after, Twist(ramped(twist.v, target.v, faster), ramped(twist.omega, target.omega, turned)), way


@njit(cache=True)
def _roll_out(pose, twist, target, phases, limits, lever, samples):
    """`roll_out` on arrays and numbers: the number of samples, which may not all have room, and the fields after."""
    delay, hold = phases
    limits = Limits(limits[0], limits[1], limits[2], limits[3])
    now, moves = Pose(pose[0], pose[1], pose[2]), Twist(twist[0], twist[1])
    samples[0] = now.x, now.y, now.yaw, moves.v, moves.omega, 0.0
    count, commanded, braking, time, grips = 1, 0, 0, 0.0, True
    wanted, left, kept = moves, delay, 0  # the phases: keeping the twist, the target, and zero
    if delay <= 0.0:
        wanted, left, kept = Twist(target[0], target[1]), hold, 1
    while kept < 2 or abs(moves.v) >= AT_REST or abs(moves.omega) >= AT_REST:
        fastest, turning = max(abs(moves.v), abs(wanted.v)), max(abs(moves.omega), abs(wanted.omega))
        fastest += lever * turning
        step = min(LONGEST_STEP, SAMPLE_SPACING / max(fastest, 1e-9), LARGEST_TURN / max(turning, 1e-9))
        if kept < 2:
            step = min(step, left)
            left -= step
        elif abs(moves.v) >= AT_REST:
            step = min(step, abs(moves.v) / limits.max_acceleration)
        else:
            step = min(step, abs(moves.omega) / limits.max_yaw_acceleration)
        now, moves, _ = stepped(now, moves, wanted, step, limits)
        time += step
        grips = grips and (kept == 0 or not slides(moves.v, moves.omega, limits))
        if count < len(samples):
            samples[count] = now.x, now.y, now.yaw, moves.v, moves.omega, time
        if kept < 2 and left < 1e-9:
            if kept == 0:
                wanted, left, kept, commanded = Twist(target[0], target[1]), hold, 1, count
            else:
                wanted, kept, braking = Twist(0.0, 0.0), 2, count
        count += 1
    return count, commanded, braking, grips
