"""The motion that follows a command: kept for its period after the delay, then full braking, as samples.

Every certificate is asked about this motion, and every prediction takes its steps.
"""

import math
from dataclasses import dataclass
from functools import cached_property
from typing import NamedTuple

import numpy as np
from numba.extending import register_jitable

from drake_starnav.geometry.compiled import kernel, leaf, put
from drake_starnav.geometry.footprint import Footprint
from drake_starnav.robot.base import Base
from drake_starnav.robot.limits import Limits, Velocity
from drake_starnav.robot.parameters import BASES
from drake_starnav.utils.snapshot import snapshot

LONGEST_STEP = 0.04
"""Longest time between two samples, s."""
LARGEST_TURN = 0.25
"""Largest turn between two samples, rad: the chord is then short of its arc by 0.3 %."""
AT_REST = 1e-9
"""A speed below this is zero, m/s or rad/s."""
GRIP = 8.0
"""Acceleration across the robot, speed times yaw rate, that its wheels follow without sliding, m/s^2."""
GRIP_WHILE_BRAKING = 3.0
"""GRIP holds up to this acceleration along the robot, m/s^2; beyond it grip falls with the third power."""
SAMPLES = 128
"""Samples for which there is room at first; a motion may have more."""


class Pose(NamedTuple):
    """The robot's place and heading in W; m and rad."""

    x: float
    y: float
    yaw: float


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


@dataclass(frozen=True)
class Actuation:
    """What a command does to the robot.

    Attributes:
        limits: of the robot.
        footprint: of the robot.
        hold: how long a command is followed, s: one control period.
        delay: from a command to its effect, s.
        base: how the robot moves.
    """

    limits: Limits
    footprint: Footprint
    hold: float
    delay: float
    base: Base = BASES["differential"]

    @cached_property
    def numbers(self) -> tuple[float, ...]:
        """Delay, hold, lever, sampling, limits: for compiled functions, which take plain tuples faster than records."""
        shape = self.footprint
        return tuple(map(float, (self.delay, self.hold, shape.lever, shape.sampling, *self.limits)))


class Motion(NamedTuple):
    """What the robot does if a command is sent and then it brakes, as samples.

    Neighbours are at most LONGEST_STEP and LARGEST_TURN apart. Between them no point of a footprint of polygons, nor a
    disc's centre, moves farther than its `sampling`.

    Attributes:
        samples: shape (n, 6): x, y, yaw, speed, turning rate and the time from now; W, SI units. The first is the
            robot now, in the last it stands.
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
        """Where the robot's centre is at each sample, shape (n, 2), W, m."""
        return self.samples[:, :2]

    @property
    def pose(self) -> np.ndarray:
        """(x, y, yaw), shape (n, 3), W, m and rad."""
        return self.samples[:, :3]

    @property
    def twist(self) -> np.ndarray:
        """Speed, with the sign of that along x, m/s, and turning rate, rad/s, shape (n, 2)."""
        return self.samples[:, 3:5]

    @property
    def time(self) -> np.ndarray:
        """From now, shape (n,), s."""
        return self.samples[:, 5]


def roll_out(pose: np.ndarray, twist: np.ndarray, target: np.ndarray, actuation: Actuation) -> Motion:
    """The motion that follows a command.

    Args:
        pose: (x, y, yaw) of the robot in W, m and rad.
        twist: commanded now, as many numbers as the base's twists have; the robot keeps it for the delay.
        target: that is commanded, within the robot's limits.
        actuation: what commands do.
    """
    numbers, samples = actuation.numbers, np.empty((SAMPLES, 6))  # made here: Numba takes longer to hand out an array
    sample_count, command_start, braking, within_grip = sample(pose, twist, target, numbers, samples)
    if sample_count > SAMPLES:
        samples = np.empty((sample_count, 6))
        sample(pose, twist, target, numbers, samples)
    return Motion(samples[:sample_count], command_start, braking, within_grip, actuation.footprint)


@register_jitable
def ramp_value(value, target, change):
    """The value, moved towards the target by at most `change`."""
    return value + min(max(target - value, -change), change)


@register_jitable
def average_ramp(value, target, change):
    """The mean of the value while it is moved towards the target by at most `change`, which it may reach on the way."""
    speed_difference = abs(target - value)
    if speed_difference >= change:
        return value + 0.5 * math.copysign(change, target - value)
    return target - 0.5 * (target - value) * speed_difference / change


@register_jitable
def convert_to_velocity(twist):
    """A twist of 2 or 3 components as a `Velocity`."""
    return Velocity(twist[0], twist[1] if len(twist) == 3 else 0.0, twist[-1])


@register_jitable
def ramp_speed(speed, target, time_step, limits):
    """A speed after a step (s) towards a target, and its mean in the step; to change its sign it falls, then grows."""
    growth, fall = limits.max_acceleration * time_step, limits.max_deceleration * time_step
    if growth == fall or speed * target >= 0.0 or abs(speed) >= fall:
        change = growth if speed * target >= 0.0 and abs(target) > abs(speed) else fall
        return ramp_value(speed, target, change), average_ramp(speed, target, change)
    share = abs(speed) / fall  # of the step, until it is zero
    growth *= 1.0 - share
    return ramp_value(0.0, target, growth), 0.5 * share * speed + (1.0 - share) * average_ramp(0.0, target, growth)


@leaf
def ramp_velocity(current_velocity, target, time_step, limits):
    """The velocity after a step (s) towards a target, and the mean one of the step."""
    turning_change = limits.max_yaw_acceleration * time_step
    turning = ramp_value(current_velocity.turning, target.turning, turning_change)
    mean_turning = average_ramp(current_velocity.turning, target.turning, turning_change)
    if current_velocity.v_y == 0.0 and target.v_y == 0.0:
        next_ahead, mean_ahead = ramp_speed(current_velocity.v_x, target.v_x, time_step, limits)
        return Velocity(next_ahead, 0.0, turning), Velocity(mean_ahead, 0.0, mean_turning)
    dx, dy = target.v_x - current_velocity.v_x, target.v_y - current_velocity.v_y
    change, slowest = max(math.hypot(dx, dy), 1e-12), 0.0
    if limits.max_acceleration != limits.max_deceleration:  # how far along the change the speed is least
        slowest = -(current_velocity.v_x * dx + current_velocity.v_y * dy) / change
    end_speed, mean_speed = ramp_speed(-slowest, change - slowest, time_step, limits)
    end_share, mean_share = (end_speed + slowest) / change, (mean_speed + slowest) / change
    next_velocity = Velocity(current_velocity.v_x + end_share * dx, current_velocity.v_y + end_share * dy, turning)
    return next_velocity, Velocity(
        current_velocity.v_x + mean_share * dx, current_velocity.v_y + mean_share * dy, mean_turning
    )


@leaf
def integrate_step(pose, mean_velocity, time_step, limits):
    """Return the pose after a step (s) at mean rates."""
    way = mean_velocity.v_x * time_step
    side = mean_velocity.v_y * time_step
    turn = mean_velocity.turning * time_step
    if limits.steers > 0.0:
        turn = mean_velocity.turning * way
    middle_yaw = pose.yaw + 0.5 * turn
    cosine, sine = math.cos(middle_yaw), math.sin(middle_yaw)
    return Pose(pose.x + way * cosine - side * sine, pose.y + way * sine + side * cosine, pose.yaw + turn)


@leaf
def advance_pose(pose, velocity, target, time_step, limits):
    """Return pose and velocity after a step (s) towards a target velocity, at its mean rates."""
    next_velocity, mean_velocity = ramp_velocity(velocity, target, time_step, limits)
    return integrate_step(pose, mean_velocity, time_step, limits), next_velocity


@leaf
def body_rates(velocity, limits):
    """Speed, with the sign of that along x, m/s, and turning rate, rad/s."""
    speed = velocity.v_x
    if velocity.v_y != 0.0:
        speed = math.copysign(math.hypot(velocity.v_x, velocity.v_y), velocity.v_x)
    return speed, velocity.turning * speed if limits.steers > 0.0 else velocity.turning


@kernel
def limit_to_grip(acceleration):
    """Largest speed times yaw rate of a robot whose speed may change so fast (m/s^2), m/s^2: more, and it slides."""
    return GRIP * min(GRIP_WHILE_BRAKING / acceleration, 1.0) ** 3


@kernel
def is_sliding(v, omega, limits):
    """Whether a robot that has this twist, and may speed up and brake as hard as its limits allow, slides."""
    return abs(v * omega) > limit_to_grip(max(limits.max_acceleration, limits.max_deceleration)) + 1e-9


@kernel
def sample(pose, twist, target, numbers, samples):
    """`roll_out` by `Actuation.numbers`, into `samples`: how many it has, room or not, and the rest of a `Motion`."""
    (delay, hold, lever, spacing), limits = numbers[:4], Limits(*numbers[4:])
    legs, leg_starts = np.empty((3, 4)), np.empty(3, np.int64)
    current_velocity, target_velocity = convert_to_velocity(twist), convert_to_velocity(target)
    for k, (each, leg_duration) in enumerate(
        ((current_velocity, delay), (target_velocity, hold), (Velocity(0.0, 0.0, 0.0), np.inf))
    ):
        put(legs, k, (each.v_x, each.v_y, each.turning, leg_duration))
    sample_count = simulate_legs(
        Pose(pose[0], pose[1], pose[2]), current_velocity, legs, limits, lever, spacing, samples, leg_starts
    )
    command_start, within_grip = leg_starts[1], True
    for k in range(command_start + 1, min(sample_count, len(samples))):
        within_grip = within_grip and not is_sliding(samples[k, 3], samples[k, 4], limits)
    return sample_count, command_start, leg_starts[2], within_grip


@kernel
def simulate_legs(pose, velocity, legs, limits, lever, spacing, samples, leg_starts):
    """The motion of any base over legs, written as samples of a `Motion`; returns their number, room or not.

    Args:
        pose, velocity: now.
        legs: shape (k, 4): a velocity that is approached as fast as the limits allow, and for how long, s. The robot
            brakes on a leg that lasts for ever, until it stands; a base that steers keeps its curvature.
        limits: of the robot.
        lever, spacing: lever and sampling of the footprint, m.
        samples: shape (n, 6), to be written; the last of many goes into the last row.
        leg_starts: shape (k,), to be written: the index of the sample with which each leg begins.
    """
    speed, rate = body_rates(velocity, limits)
    put(samples, np.int64(0), (pose.x, pose.y, pose.yaw, speed, rate, 0.0))
    sample_count, time = 1, 0.0
    for j in range(len(legs)):
        leg_starts[j], time_left = sample_count - 1, legs[j, 3]
        target_velocity = Velocity(legs[j, 0], legs[j, 1], legs[j, 2])
        if time_left == np.inf and limits.steers > 0.0:
            target_velocity = Velocity(target_velocity.v_x, target_velocity.v_y, velocity.turning)
        wanted_speed, wanted_rate = body_rates(target_velocity, limits)
        while time_left >= 1e-9 and (time_left < np.inf or abs(speed) >= AT_REST or abs(rate) >= AT_REST):
            fastest, turning = max(abs(speed), abs(wanted_speed)), max(abs(rate), abs(wanted_rate))
            if limits.steers > 0.0:
                turning = fastest * max(abs(velocity.turning), abs(target_velocity.turning))
            fastest += lever * turning
            step = min(LONGEST_STEP, spacing / max(fastest, 1e-9), LARGEST_TURN / max(turning, 1e-9))
            if time_left < np.inf:
                step = min(step, time_left)
                time_left -= step
            elif abs(speed) >= AT_REST:
                step = min(step, abs(speed) / limits.max_deceleration)
            else:
                step = min(step, abs(rate) / limits.max_yaw_acceleration)
            pose, velocity = advance_pose(pose, velocity, target_velocity, step, limits)
            speed, rate = body_rates(velocity, limits)
            time += step
            put(samples, min(sample_count, len(samples) - 1), (pose.x, pose.y, pose.yaw, speed, rate, time))
            sample_count += 1
    return sample_count


def predict_pose(pose: np.ndarray, pending: np.ndarray, delay: float, limits: Limits) -> np.ndarray:
    """The pose at which the command that is due now takes effect, shape (3,).

    The certificate holds from there on: the motion up to it was certified when its commands were sent.

    Args:
        pose: (x, y, yaw) now, m and rad.
        pending: shape (n, 4), a leg of `simulate_legs` for each command on its way, the oldest first, with its period.
        delay: from a command to its effect, s: of the oldest only the rest is still to come.
        limits: of the robot; each command was ramped when it was sent, and is reached at once.
    """
    legs = pending.copy()
    legs[:1, 3] -= legs[:, 3].sum() - delay
    at_once = limits._replace(max_acceleration=math.inf, max_deceleration=math.inf, max_yaw_acceleration=math.inf)
    leg_starts, end_sample = np.empty(len(legs), np.int64), np.empty((1, 6))
    simulate_legs(
        Pose(*map(float, pose)), convert_to_velocity(legs[0, :3]), legs, at_once, 0.0, math.inf, end_sample, leg_starts
    )
    return end_sample[0, :3]
