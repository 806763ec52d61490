"""The avoidance rollout: a robot that drives among the predicted discs, and the cost of doing so.

The discs follow their predicted trajectories; static objects are assumed to stay. The robot stops at the edge of known
free space, and brakes as soon as the certificate in time would make it, also for static objects, which might start: a
rollout that the robot's own caution would cut short thus shows where it really ends.

In seconds,

    cost = time passed + time to go + comfort lost + contact + walls + change of the twist

Comfort is lost by the least predicted distance d to a disc at a time t: w (1 - e / COMFORT)_+^2 (1 - t / (2 HORIZON))
with e = d / (1 + UNCERTAINTY t). A contact at t ends a rollout and costs w (1 + 3 (1 - t / HORIZON)): a late
contact costs less, since predictions far ahead are uncertain.
"""

import math
from typing import NamedTuple

import numpy as np
from numba import njit

from drake_starnav.control.motion import Pose, Velocity, advanced
from drake_starnav.control.moving_certificate import STANDING_SPEED
from drake_starnav.control.rollout import (
    ARRIVED,
    CREEP,
    FreeSpace,
    clearance_within,
    next_way_point,
    region_around,
    time_to_go,
)
from drake_starnav.geometry.compiled import leaf
from drake_starnav.regions.region_union import covers
from drake_starnav.robot import Limits
from drake_starnav.robot.limits import turning_twist, wrapped_angle
from drake_starnav.tracking.prediction import HORIZON, PREDICTION_STEP

COMFORT = 0.4
"""Predicted distance from a moving obstacle below which the robot gives way, m. From slow ones less is due: distances
from them count for more, in proportion."""
STEP = 0.1
"""Time step of the rollout, s."""
PATH, TWIST, HEADING = range(3)
"""Kinds of manoeuvre."""
CONTACT_COST = 8.0
"""w, s."""
UNCERTAINTY = 0.15
"""A predicted distance counts for less with time, by this share per second."""
ROLLOUT_MARGIN = 0.03
"""The simulated robot adds this to the certificate's margin, m: tracks are less exact than hits."""
WALL_ZONE = 0.4
WALL_COST = 0.6
"""Cost of the least clearance to static obstacles, s, if less than the zone, in radii: walls leave no room to evade."""
X, Y, YAW, V, OMEGA, WAY_POINT, REGION, CLEARANCE, CLOSEST, LOST, LEAST, SPENT, ARRIVAL, ENDED, HELD, FIRST, COST = (
    range(17)
)
COLUMNS = 17
"""Columns of the rollouts: where each ends, what happened on it, and with which manoeuvre it began."""


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


class Settings(NamedTuple):
    """Numbers of the controller, the robot and the moving obstacles, as named in their parameters; SI units.

    Attributes:
        slowdown: speed per distance to the goal; infinite where the path ends at a frontier.
        spacing: distance to moving obstacles that the certificate keeps, m.
    """

    slowdown: float
    radius: float
    spacing: float
    caution: float
    max_speed: float


class Scene(NamedTuple):
    """What the rollouts share.

    Attributes:
        line: shape (n, 2), the robot's place and the way points, W, m.
        left: shape (n,), time from each way point to the end, as from `times_left`, s.
        known: free space and hits.
        discs: the dynamic obstacles.
        limits: of the robot.
        settings: numbers of the controller, the robot and the moving obstacles.
    """

    line: np.ndarray
    left: np.ndarray
    known: FreeSpace
    discs: Discs
    limits: Limits
    settings: Settings


def start_row(pose: np.ndarray, twist: np.ndarray, hits: np.ndarray, radius: float) -> np.ndarray:
    """The rollout before its first step."""
    row = np.zeros(COLUMNS)
    row[[X, Y, YAW]], row[[V, OMEGA]] = pose, twist
    row[WAY_POINT], row[REGION], row[LEAST], row[ARRIVAL] = 1, -1, np.inf, np.inf
    row[CLEARANCE] = clearance_within(pose[0], pose[1], hits, radius, WALL_ZONE * radius)
    row[CLOSEST] = row[CLEARANCE]
    return row


@leaf
def wanted_twist(way, row, line, limits, settings):
    """The twist (v, omega) that a manoeuvre `way`, a row of `manoeuvres`, wants where the robot is."""
    kind, a, b = way
    if kind == TWIST:
        return a, b
    if kind == HEADING:
        error = wrapped_angle(a - row[YAW] if b > 0.0 else a + math.pi - row[YAW])
        return turning_twist(error, b, limits)
    k, last = int(row[WAY_POINT]), len(line) - 1
    dx, dy = line[k, 0] - row[X], line[k, 1] - row[Y]
    arrived = ARRIVED * settings.radius
    if dx * dx + dy * dy < (arrived * arrived if k == last else 1e-12):
        return 0.0, 0.0
    error = wrapped_angle(math.atan2(dy, dx) - row[YAW])
    want_v, want_omega = turning_twist(error, a * limits.max_speed, limits)
    if k == last:
        want_v = min(want_v, settings.slowdown * math.hypot(dx, dy) + limits.max_speed / CREEP)
    return want_v, want_omega


@leaf
def _place(trajectories, j, time):
    """Predicted position and velocity of disc j."""
    at = min(time / PREDICTION_STEP, trajectories.shape[1] - 1.001)
    i = int(at)
    share = at - i
    dx, dy = trajectories[j, i + 1, 0] - trajectories[j, i, 0], trajectories[j, i + 1, 1] - trajectories[j, i, 1]
    return (
        trajectories[j, i, 0] + share * dx,
        trajectories[j, i, 1] + share * dy,
        dx / PREDICTION_STEP,
        dy / PREDICTION_STEP,
    )


@leaf
def _must_brake(row, time, trajectories, radius, limits, settings):
    """Whether a robot that brakes fully now might be touched before it stops, with the discs at their predictions.

    Checked at half the braking time and at its end, for all discs, whether it approaches them or not: a robot that only
    watches those ahead is soon surrounded. `time` is that since the scan, s.
    """
    x, y, yaw, v = row[X], row[Y], row[YAW], row[V]
    if abs(v) < STANDING_SPEED:
        return False
    caution, stop = settings.caution, abs(v) / limits.max_acceleration
    distance = settings.radius + settings.spacing + ROLLOUT_MARGIN
    for share in (0.5, 1.0):
        t = share * stop
        way = v * t - 0.5 * math.copysign(limits.max_acceleration, v) * t * t
        px, py = x + way * math.cos(yaw), y + way * math.sin(yaw)
        for j in range(len(radius)):
            disc_x, disc_y, vx, vy = _place(trajectories, j, time)
            dx, dy = px - disc_x - (1.0 - caution) * vx * t, py - disc_y - (1.0 - caution) * vy * t
            needed = distance + radius[j] + caution * settings.max_speed * t
            if dx * dx + dy * dy < needed * needed:
                return True
    return False


@leaf
def _held(row, standing, limits, settings):
    """Whether a robot that brakes fully from the next step on might be touched by an object that is static now."""
    x, y, yaw, v = row[X], row[Y], row[YAW], row[V]
    if abs(v) < STANDING_SPEED:
        return False
    distance, stop = settings.radius + settings.spacing, abs(v) / limits.max_acceleration
    for share in (0.5, 1.0):
        t = share * stop
        way = v * (t + STEP) - 0.5 * math.copysign(limits.max_acceleration, v) * t * t
        px, py = x + way * math.cos(yaw), y + way * math.sin(yaw)
        needed = distance + settings.max_speed * (t + STEP)
        for j in range(len(standing)):
            if (px - standing[j, 0]) ** 2 + (py - standing[j, 1]) ** 2 < needed * needed:
                return True
    return False


@njit(cache=True)
def drive(rows, ways, steps, scene):
    """Continue rollouts (n, COLUMNS) in place by some steps, each of its manoeuvre: ways (n, 3), rows of `manoeuvres`.

    One ends early if the robot is touched or reaches a frontier. COST is then that so far plus the time to the goal,
    without the change of the twist, s.
    """
    line, left, known, discs, limits, settings = scene
    hits, star = known.hits, known.star
    center, bearing_0, values = star.center, star.bearing_0, star.values
    trajectories, radius, comfort, standing, age = discs
    last, arrived, zone = len(line) - 1, ARRIVED * settings.radius, WALL_ZONE * settings.radius
    for r in range(len(rows)):
        row, way = rows[r], (ways[r, 0], ways[r, 1], ways[r, 2])
        for _ in range(steps):
            time = age + row[SPENT]
            x, y, yaw, v, omega = row[X], row[Y], row[YAW], row[V], row[OMEGA]
            want_v, want_omega = wanted_twist(way, row, line, limits, settings)
            if _must_brake(row, time, trajectories, radius, limits, settings):
                want_v = 0.0
            if _held(row, standing, limits, settings):
                want_v = 0.0
                row[HELD] = 1.0
            moves, wanted = Velocity(v, 0.0, omega), Velocity(want_v, 0.0, want_omega)
            pose, moves, _ = advanced(Pose(x, y, yaw), moves, wanted, STEP, limits)
            x, y, row[YAW], row[V], row[OMEGA] = pose.x, pose.y, pose.yaw, moves.ahead, moves.turning
            free = covers(center, bearing_0, values, 0, x, y, 0.0)
            if not free:
                row[REGION] = region_around(known, int(row[REGION]), x, y)
                free = row[REGION] >= 0
            clearance = clearance_within(x, y, hits, settings.radius, zone)
            if free or clearance > row[CLEARANCE]:
                row[X], row[Y], row[CLEARANCE] = x, y, clearance
                row[CLOSEST] = min(row[CLOSEST], clearance)
                row[WAY_POINT] = next_way_point(line, int(row[WAY_POINT]), x, y, settings.radius)
            else:
                row[V] = 0.0
            row[SPENT] += STEP
            _meet(row, age + row[SPENT], trajectories, radius, comfort, settings)
            at_end = (line[-1, 0] - row[X]) ** 2 + (line[-1, 1] - row[Y]) ** 2 < arrived * arrived
            if row[ENDED] == 0.0 and int(row[WAY_POINT]) == last and at_end:
                row[ARRIVAL] = min(row[ARRIVAL], row[SPENT])
                if settings.slowdown == np.inf:  # at a frontier, where exploration continues
                    row[ENDED] = 1.0
            if row[ENDED] > 0.0:
                break
        row[COST] = row[LOST] + WALL_COST * (1.0 - row[CLOSEST] / zone) ** 2
        if row[ARRIVAL] < np.inf:  # it has been at the goal, wherever it goes to make way
            row[COST] += row[ARRIVAL]
        else:
            pose, moves = Pose(row[X], row[Y], row[YAW]), Velocity(row[V], 0.0, row[OMEGA])
            row[COST] = row[COST] + row[SPENT] + time_to_go(line, left, int(row[WAY_POINT]), pose, moves, limits)


@leaf
def _meet(row, time, trajectories, radius, comfort, settings):
    """Note how near a rollout comes to the discs at a time since the scan, s; it ends if one touches the robot."""
    touched = False
    for j in range(len(radius)):
        disc_x, disc_y, _, _ = _place(trajectories, j, time)
        away = math.hypot(row[X] - disc_x, row[Y] - disc_y) - settings.radius - radius[j]
        worth = away / (1.0 + UNCERTAINTY * time) * (COMFORT / comfort[j]) if away > 0.0 else away
        row[LEAST] = min(row[LEAST], worth)
        if worth < COMFORT:
            share = 1.0 - max(worth, 0.0) / COMFORT
            row[LOST] = max(row[LOST], CONTACT_COST * share**2 * (1.0 - 0.5 * row[SPENT] / HORIZON))
        touched = touched or away < 0.0
    if touched:
        row[ENDED] = 1.0
        row[LOST] = CONTACT_COST * (1.0 + 3.0 * (1.0 - row[SPENT] / HORIZON))
