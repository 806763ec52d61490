"""Velocities and limits of any base's drive, and how it drives in a direction, for compiled functions."""

import math
from typing import NamedTuple

from numba.extending import register_jitable

from drake_starnav.geometry.compiled import leaf

HEADING_GAIN = 4.0
"""Turning rate per heading error, 1/s."""
STOPPING_GAIN = 8.0
"""Speed towards where a robot is to stop, for what is left, 1/s, as long as that asks for no more than it can brake."""
LEAST_SHARE = 0.3
"""Share of its speed with which a car drives towards what lies aside or behind."""


class Velocity(NamedTuple):
    """What the drive of any base does: speeds along the robot's x and y axes, m/s, and its turning, rad/s.

    The turning of a base that steers is its curvature, 1/m.
    """

    v_x: float
    v_y: float
    turning: float


class Limits(NamedTuple):
    """The limits of the drive, as compiled functions take them.

    Attributes:
        max_speed: m/s.
        max_yaw_rate: rad/s; of a base that steers the largest curvature, 1/m.
        max_acceleration, max_deceleration: largest rates at which the speed grows and falls, m/s^2.
        max_yaw_acceleration: rad/s^2; of a base that steers the largest change of the curvature, 1/(m s).
        steers: 1 if the base is commanded a curvature, 0 if a turning rate.
        holonomic: 1 if it drives in any direction without turning, else 0.
    """

    max_speed: float
    max_yaw_rate: float
    max_acceleration: float
    max_deceleration: float
    max_yaw_acceleration: float
    steers: float = 0.0
    holonomic: float = 0.0


@leaf
def make_turning_twist(heading, speed, limits):
    """The twist (v, omega) of a differential drive that turns towards a heading (rad), v = speed * cos(heading)^3.

    With v = 0 for what lies behind. It turns no faster than it can stop at that heading with the largest yaw
    acceleration.
    """
    v = speed * math.cos(heading) ** 3.0 if abs(heading) <= 0.5 * math.pi else 0.0
    stopping = math.sqrt(2.0 * limits.max_yaw_acceleration * abs(heading))
    return v, limit_value(HEADING_GAIN * heading, min(limits.max_yaw_rate, stopping))


@leaf
def compute_stopping_speed(distance, braking):
    """The speed from which a robot comes to rest after what is left: in m, m/s and m/s^2, or the same in rad.

    In proportion at the end, without a jump of the deceleration, and never more than `braking`.
    """
    soft_distance = braking / STOPPING_GAIN**2
    return (
        STOPPING_GAIN * distance
        if distance < soft_distance
        else math.sqrt(2.0 * braking * (distance - 0.5 * soft_distance))
    )


@leaf
def compute_time_from_rest(way: float, speed: float, acceleration: float) -> float:
    """Least time in which a way is driven from rest, s: in m, m/s and m/s^2, or the same in rad."""
    gaining = 0.5 * speed**2 / acceleration
    return math.sqrt(2.0 * way / acceleration) if way < gaining else (way + gaining) / speed


@leaf
def find_velocity_towards(error, speed, limits):
    """The velocity that begins to drive in a direction that is `error` (rad) to the left of the heading.

    A holonomic base drives there at once, and turns its x axis into the direction of motion, forwards or backwards. One
    that steers takes the circle through what lies there as far away as its least radius, or the tightest. Any other
    turns first. With a negative speed the direction is that of the robot's back.
    """
    if limits.holonomic > 0.0:
        turning = limit_value(wrap_angle(2.0 * error), limits.max_yaw_rate)
        return Velocity(speed * math.cos(error), speed * math.sin(error), turning)
    if limits.steers > 0.0:
        is_behind = abs(error) > 0.5 * math.pi
        bend = math.copysign(limits.max_yaw_rate, error) if is_behind else 2.0 * math.sin(error) * limits.max_yaw_rate
        bend = limit_value(bend if speed >= 0.0 else -bend, limits.max_yaw_rate)
        return Velocity(max(math.cos(error), LEAST_SHARE) * speed, 0.0, bend)
    v, omega = make_turning_twist(error, speed, limits)
    return Velocity(v, 0.0, omega)


@leaf
def cap_speed(velocity, speed):
    """The velocity with at most this speed ahead, m/s; one that leads aside keeps its direction."""
    if velocity.v_y == 0.0:
        return Velocity(min(velocity.v_x, speed), 0.0, velocity.turning)
    speed_share = min(speed / math.hypot(velocity.v_x, velocity.v_y), 1.0)
    return Velocity(speed_share * velocity.v_x, speed_share * velocity.v_y, velocity.turning)


@register_jitable
def limit_value(value, limit):
    """The value, cut off at `limit` in size; NaN stays NaN."""
    return min(max(value, -limit), limit)


@leaf
def wrap_angle(angle):
    """The angle in [-pi, pi), rad."""
    wrapped_turn, circle = angle + math.pi, 2.0 * math.pi
    if -circle <= wrapped_turn < 2.0 * circle:  # faster, and the same
        wrapped_turn += circle if wrapped_turn < 0.0 else -circle if wrapped_turn >= circle else 0.0
    else:
        wrapped_turn %= circle
    return wrapped_turn - math.pi
