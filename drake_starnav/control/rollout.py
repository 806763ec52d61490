"""Predicted motions: known free space, the dynamic obstacles, the next way point, and the time to go."""

import math
from typing import NamedTuple

import numpy as np

from drake_starnav.geometry.compiled import kernel, leaf
from drake_starnav.planning.guidance import PASSED_DISTANCE
from drake_starnav.robot.limits import STOPPING_GAIN, Velocity, wrapped_angle
from drake_starnav.surroundings.region_union import RegionUnion, cover_at, covers
from drake_starnav.surroundings.safe_region import CertifiedRegion
from drake_starnav.tracking.prediction import PREDICTION_STEP

GOAL_BRAKING = 0.96
"""On arrival a robot brakes with up to this share of its largest deceleration."""
CREEP = 10.0
"""On arrival a robot slows down to its largest speed divided by this, so that it does arrive."""
ARRIVED = 0.48
"""A predicted motion this near to the end of the path has arrived, in radii of the robot."""
COMFORT = 0.4
"""Predicted distance from a moving obstacle below which the robot gives way, m: as persons like it, nature. From slow
ones less is due: distances from them count for more, in proportion."""
STEP = 0.1
"""Time step of the rollout, s."""


class FreeSpace(NamedTuple):
    """Known free space and nearby hits.

    Attributes:
        regions: of the roadmap.
        star: the certified region as a union of one region.
        hits: shape (n, 2), filtered hits close to the robot, W, m.
    """

    regions: RegionUnion
    star: RegionUnion
    hits: np.ndarray

    @staticmethod
    def of(regions: RegionUnion, star: CertifiedRegion) -> "FreeSpace":
        """From the regions and the last scans."""
        return FreeSpace(regions, star.alone, star.near_hits)


class Discs(NamedTuple):
    """The dynamic obstacles, as predicted.

    Attributes:
        trajectories: shape (n, k, 2), places every PREDICTION_STEP from the time of the scan on, W, m.
        radius: shape (n,), m.
        comfort: shape (n,), foreseen distance below which the robot gives way, m: at most COMFORT.
        standing: shape (m, 2), places on static objects that might start, W, m.
        age: of the scan, s.
    """

    trajectories: np.ndarray
    radius: np.ndarray
    comfort: np.ndarray
    standing: np.ndarray
    age: float


@kernel
def foreseen_discs(discs, spent, steps, settings):
    """The discs after `spent` and at the end of each step, shape (steps + 1, n, 8), W, m and m/s.

    Columns: (x, y), velocity, radius, weight of distances to it and its inverse, speed with which it may come.
    """
    trajectories, last = discs.trajectories, discs.trajectories.shape[1] - 1.001
    foreseen = np.empty((steps + 1, len(discs.radius), 8))
    for s in range(steps + 1):
        at = min((discs.age + spent) / PREDICTION_STEP, last)
        i = int(at)
        share = at - i
        for j in range(len(discs.radius)):
            x, y = trajectories[j, i, 0], trajectories[j, i, 1]
            dx, dy = trajectories[j, i + 1, 0] - x, trajectories[j, i + 1, 1] - y
            foreseen[s, j, 0], foreseen[s, j, 1] = x + share * dx, y + share * dy
            foreseen[s, j, 2], foreseen[s, j, 3] = dx / PREDICTION_STEP, dy / PREDICTION_STEP
            foreseen[s, j, 4], foreseen[s, j, 5] = discs.radius[j], COMFORT / discs.comfort[j]
            coming = (1.0 - settings.caution) * math.hypot(dx, dy) / PREDICTION_STEP
            foreseen[s, j, 6] = discs.comfort[j] / COMFORT
            foreseen[s, j, 7] = coming + settings.caution * settings.max_speed
        spent += STEP
    return foreseen


@kernel
def region_around(known, region, x, y):
    """Index of a region that contains (x, y), or -1; `region`, which contained the last position, is tried first."""
    regions = known.regions
    if region >= 0 and covers(regions.center, regions.bearing_0, regions.values, region, x, y, 0.0):
        return region
    return cover_at(regions, x, y, 0.0)


@leaf
def goal_slowdown(limits):
    """Speed per distance to the goal on arrival, 1/s."""
    return min(GOAL_BRAKING * limits.max_acceleration / limits.max_speed, STOPPING_GAIN)


@leaf
def nearest_hit(x, y, hits):
    """Distance from a place to the nearest hit, m; infinite without any."""
    nearest = np.inf
    for q in range(len(hits)):
        dx, dy = x - hits[q, 0], y - hits[q, 1]
        nearest = min(nearest, dx * dx + dy * dy)
    return math.sqrt(nearest)


@leaf
def next_way_point(line, k, x, y, radius):
    """The way point that a robot of a radius heads for once it has passed k.

    A taut path bends around the obstacle that hides the following way point. That way point comes into view where the
    robot crosses the backward extension of the leg that leads to it.
    """
    passed = PASSED_DISTANCE * radius
    while k + 1 < len(line):
        dx, dy = x - line[k, 0], y - line[k, 1]
        leg_x, leg_y = line[k + 1, 0] - line[k, 0], line[k + 1, 1] - line[k, 1]
        bend = (line[k, 0] - line[k - 1, 0]) * leg_y - (line[k, 1] - line[k - 1, 1]) * leg_x
        inside = bend * (leg_x * dy - leg_y * dx) >= 0.0
        if inside and dx * dx + dy * dy > passed * passed:
            break
        k += 1
    return k


@kernel
def times_left(line, limits):
    """Time from each way point to the end of the path, starting along the next leg at full speed, shape (n,), s."""
    left = np.zeros(len(line))
    after = 0.0
    for k in range(len(line) - 2, 0, -1):
        dx, dy = line[k + 1, 0] - line[k, 0], line[k + 1, 1] - line[k, 1]
        heading = math.atan2(dy, dx)
        left[k] = math.hypot(dx, dy) / limits.max_speed + left[k + 1]
        if k + 2 < len(line):
            left[k] += heading_loss(wrapped_angle(after - heading), full_speed(limits), limits)
        after = heading
    return left


@leaf
def time_to_go(line, left, k, pose, velocity, limits):
    """T: from a `Pose` and a `Velocity` over the way points from k on, s; `left` as from `times_left`."""
    dx, dy = line[k, 0] - pose.x, line[k, 1] - pose.y
    heading = math.atan2(dy, dx)
    time = math.hypot(dx, dy) / limits.max_speed + heading_loss(wrapped_angle(heading - pose.yaw), velocity, limits)
    if k + 1 < len(line):
        leg = math.atan2(line[k + 1, 1] - line[k, 1], line[k + 1, 0] - line[k, 0])
        time += left[k] + heading_loss(wrapped_angle(leg - heading), full_speed(limits), limits)
    return time


@leaf
def full_speed(limits):
    """The `Velocity` straight ahead at full speed."""
    return Velocity(limits.max_speed, 0.0, 0.0)


@leaf
def heading_loss(error, velocity, limits):
    """Time lost until a robot with this heading error and this `Velocity` drives along its path at full speed, s.

    The duration of the turn, unless the base needs none, plus the time lost while the speed along the path grows to the
    maximum. A base that steers turns at full speed.
    """
    missing = limits.max_speed - velocity.ahead * math.cos(error) - velocity.aside * math.sin(error)
    gaining = missing * missing / (2.0 * limits.max_acceleration * limits.max_speed)
    if limits.holonomic > 0.0:
        return gaining
    if limits.steers > 0.0:
        speed = limits.max_speed
        rates = speed * limits.max_yaw_rate, speed * limits.max_yaw_acceleration
        return turning_time(error, velocity.turning * velocity.ahead, rates) + gaining
    return turning_time(error, velocity.turning, (limits.max_yaw_rate, limits.max_yaw_acceleration)) + gaining


@leaf
def turning_time(angle, rate, most):
    """Least time in which a robot that turns at `rate` turns by `angle` and stops, s: bang-bang, or bang-coast-bang.

    `most` are its largest turning rate, rad/s, and change of that, rad/s^2.
    """
    rate_max, acceleration = most
    if angle < 0.0:
        angle, rate = -angle, -rate
    beyond = rate * rate / (2.0 * acceleration) - angle
    if rate > 0.0 and beyond > 0.0:  # it stops too late: past the angle, and back
        return rate / acceleration + 2.0 * math.sqrt(beyond / acceleration)
    peak = math.sqrt(acceleration * angle + 0.5 * rate * rate)
    if peak <= rate_max:
        return (2.0 * peak - rate) / acceleration
    return (2.0 * rate_max - rate + (peak * peak - rate_max * rate_max) / rate_max) / acceleration
