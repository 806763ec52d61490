"""How long it takes to drive to the end of a path, and out of the way of something that moves."""

import math

import numpy as np

from drake_starnav.geometry.compiled import kernel, leaf
from drake_starnav.planning.guidance import PASSED_DISTANCE
from drake_starnav.robot.limits import Velocity, compute_time_from_rest, wrap_angle


@leaf
def find_next_way_point(line, k, x, y, radius):
    """Return the way point that a robot of a radius heads for once it has passed k.

    A taut path bends around the obstacle that hides the following way point. That way point comes into view where the
    robot crosses the backward extension of the leg that leads to it.
    """
    passed_distance = PASSED_DISTANCE * radius
    while k + 1 < len(line):
        dx, dy = x - line[k, 0], y - line[k, 1]
        leg_x, leg_y = line[k + 1, 0] - line[k, 0], line[k + 1, 1] - line[k, 1]
        bend_side = (line[k, 0] - line[k - 1, 0]) * leg_y - (line[k, 1] - line[k - 1, 1]) * leg_x
        is_inside = bend_side * (leg_x * dy - leg_y * dx) >= 0.0
        if is_inside and dx * dx + dy * dy > passed_distance * passed_distance:
            break
        k += 1
    return k


@kernel
def compute_times_along(line, limits):
    """Return the times from each way point to the end, starting along the next leg at full speed, shape (n,), s."""
    times = np.zeros(len(line))
    next_heading = 0.0
    for k in range(len(line) - 2, 0, -1):
        dx, dy = line[k + 1, 0] - line[k, 0], line[k + 1, 1] - line[k, 1]
        heading = math.atan2(dy, dx)
        times[k] = math.hypot(dx, dy) / limits.max_speed + times[k + 1]
        if k + 2 < len(line):
            times[k] += compute_heading_loss(wrap_angle(next_heading - heading), full_speed(limits), limits)
        next_heading = heading
    return times


@leaf
def compute_time_to_go(line, times_left, k, pose, velocity, limits):
    """Return the time from a `Pose`, at a `Velocity`, over the way points from k on, s.

    `times_left` are from `compute_times_along`.
    """
    dx, dy = line[k, 0] - pose.x, line[k, 1] - pose.y
    heading = math.atan2(dy, dx)
    time = math.hypot(dx, dy) / limits.max_speed + compute_heading_loss(
        wrap_angle(heading - pose.yaw), velocity, limits
    )
    if k + 1 < len(line):
        leg = math.atan2(line[k + 1, 1] - line[k, 1], line[k + 1, 0] - line[k, 0])
        time += times_left[k] + compute_heading_loss(wrap_angle(leg - heading), full_speed(limits), limits)
    return time


@leaf
def full_speed(limits):
    """Return the `Velocity` straight ahead at full speed."""
    return Velocity(limits.max_speed, 0.0, 0.0)


@leaf
def compute_heading_loss(error, velocity, limits):
    """Return the time lost until a robot with this heading error and `Velocity` drives along its path at full speed, s.

    The duration of the turn, unless the base needs none, plus the time lost while the speed along the path grows to the
    maximum. A base that steers turns at full speed.
    """
    missing_speed = limits.max_speed - velocity.v_x * math.cos(error) - velocity.v_y * math.sin(error)
    speed_up_time = missing_speed * missing_speed / (2.0 * limits.max_acceleration * limits.max_speed)
    if limits.holonomic > 0.0:
        return speed_up_time
    if limits.steers > 0.0:
        speed = limits.max_speed
        rates = speed * limits.max_yaw_rate, speed * limits.max_yaw_acceleration
        return compute_turning_time(error, velocity.turning * velocity.v_x, rates) + speed_up_time
    return (
        compute_turning_time(error, velocity.turning, (limits.max_yaw_rate, limits.max_yaw_acceleration))
        + speed_up_time
    )


@leaf
def compute_turning_time(angle, rate, most_rate):
    """Return the least time in which a robot that turns at `rate` turns by `angle` and stops, s.

    `most_rate` are its largest turning rate, rad/s, and change of that, rad/s^2.
    """
    rate_max, acceleration = most_rate
    if angle < 0.0:
        angle, rate = -angle, -rate
    overshoot = rate * rate / (2.0 * acceleration) - angle
    if rate > 0.0 and overshoot > 0.0:  # it stops too late: past the angle, and back
        return rate / acceleration + 2.0 * math.sqrt(overshoot / acceleration)
    peak_rate = math.sqrt(acceleration * angle + 0.5 * rate * rate)
    if peak_rate <= rate_max:
        return (2.0 * peak_rate - rate) / acceleration
    return (2.0 * rate_max - rate + (peak_rate * peak_rate - rate_max * rate_max) / rate_max) / acceleration


@leaf
def compute_time_to_escape(distance, limits):
    """Return the time in which a robot that stands drives a distance (m) out of the way of a mover, s.

    Forwards or backwards, after a turn by an eighth of a circle, the mean of what is needed; no turn if it steers or is
    holonomic.
    """
    turning_time = 0.0
    if limits.holonomic == 0.0 and limits.steers == 0.0:
        turning_time = compute_turning_time(0.25 * math.pi, 0.0, (limits.max_yaw_rate, limits.max_yaw_acceleration))
    return turning_time + compute_time_from_rest(distance, limits.max_speed, limits.max_acceleration)
