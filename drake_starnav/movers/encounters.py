"""Foreseen encounters: many ways on for the robot, each simulated among the predicted discs, and what it costs.

A way on is a first manoeuvre, held for a while, and then the path. A manoeuvre is a twist, or to head somewhere at a
speed, forwards or backwards: for a robot that must turn before it can step aside, that is one way on and not many. On
the way the robot stops at what is not known to be free, and brakes as soon as the certificate in time would make it: so
a way on that would be cut short by its own caution shows where it really ends.

In seconds,

    cost = time to go at the horizon + comfort lost + contact + change of the twist

Comfort is lost by the least foreseen distance d to a disc at a time t: w (1 - e / comfort)_+^2 (1 - t / (2 horizon)) with
e = d / (1 + UNCERTAINTY t), and a contact at t costs w (1 + 3 (1 - t / horizon)): better late than soon, since much may
happen until then.
"""

import math

import numpy as np
from numba import njit

from drake_starnav.control.braking import limited, limits_array, ramped
from drake_starnav.control.parameters import ControllerParameters
from drake_starnav.control.predictive import ARRIVED, next_way_point, time_to_go, times_left
from drake_starnav.control.tracking import CREEP_SPEED, wrapped_angle
from drake_starnav.movers.certificate import STANDING_SPEED
from drake_starnav.movers.parameters import MoverParameters
from drake_starnav.movers.tracks import Tracks
from drake_starnav.robot import RobotParameters
from drake_starnav.stars.region import RegionStack, covers, first_cover
from drake_starnav.stars.safety import SafetyStar

STEP = 0.1
"""Of the foreseen motion, s."""
TWIST, HEADING = 0, 1
"""Kinds of manoeuvre."""
HEADINGS = 16
"""Directions that are tried."""
TURNS = np.array([-1.0, -0.5, 0.0, 0.5, 1.0])
SPEEDS = np.array([1.0, 0.5, 0.0, -0.5])
"""Twists that are tried, as shares of the largest."""
TWIST_HOLD = 0.4
HEADING_HOLDS = (0.8, 1.6)
"""How long manoeuvres are held, s."""
CONTACT_COST = 8.0
"""w, s."""
UNCERTAINTY = 0.15
"""A foreseen distance is worth less with time by this share a second."""
CHANGE_WEIGHT = 0.15
"""What a change of speed or turning rate by its whole range costs, s."""


def manoeuvres(twist: np.ndarray, limits: np.ndarray) -> np.ndarray:
    """The ways on that are tried, shape (n, 4): kind, (v, omega) or (heading, speed), and hold, s.

    The first is the path itself, at once.
    """
    v_max, omega_max = limits[0], limits[1]
    rows = [(TWIST, 0.0, 0.0, 0.0), (TWIST, *twist, TWIST_HOLD)]
    rows += [(TWIST, v * v_max, omega * omega_max, TWIST_HOLD) for v in SPEEDS for omega in TURNS]
    rows.append((TWIST, 0.0, 0.0, HEADING_HOLDS[-1]))
    for k in range(HEADINGS):
        heading = 2.0 * math.pi * k / HEADINGS
        rows += [(HEADING, heading, sign * v_max, hold) for hold in HEADING_HOLDS for sign in (1.0, -1.0)]
    return np.array(rows)


def foreseen(
    ways: np.ndarray,
    pose: np.ndarray,
    twist: np.ndarray,
    path: np.ndarray,
    arrives: bool,
    regions: RegionStack,
    star: SafetyStar,
    tracks: Tracks,
    age: float,
    controller: ControllerParameters,
    robot: RobotParameters,
    movers: MoverParameters,
) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """What each way on costs, how near it comes to what moves, and the twist that it begins with.

    Args:
        ways: shape (n, 4), as from `manoeuvres`.
        pose: (x, y, yaw) of the robot in W, m and rad.
        twist: (v, omega) commanded last, m/s and rad/s.
        path: shape (k, 2), way points ahead, W, m; empty: nowhere to go.
        arrives: whether the last way point is the goal.
        regions: around the robot.
        star: what the last scans certify.
        tracks: of the last scan; those that count are predicted.
        age: time since then, s.
        controller, robot, movers: parameters.

    Returns:
        cost, shape (n,), s; least foreseen distance between the hulls, shape (n,), m, infinite beyond `comfort`;
        twists, shape (n, 2), m/s and rad/s.
    """
    counted = tracks.counted
    growth = np.minimum(tracks.speed + movers.speed_change, movers.max_speed)
    discs = np.column_stack((tracks.position, tracks.velocity, tracks.radius, growth))[counted]
    limits = limits_array(robot)
    line = np.vstack((pose[:2], path)) if len(path) else np.vstack((pose[:2], pose[:2]))
    settings = np.array(
        (
            movers.horizon, controller.heading_gain, controller.goal_slowdown if arrives else np.inf, robot.radius,
            movers.margin, movers.caution, movers.comfort,
        )
    )  # fmt: skip
    return _foreseen(
        ways, pose, twist, line, times_left(line, limits), *regions.arrays, star.center, star.bearing_0, star.values,
        discs, age, limits, settings,
    )  # fmt: skip


@njit(cache=True)
def _wanted(kind, a, b, x, y, yaw, limits, gain):
    if kind == TWIST:
        return a, b
    error = wrapped_angle(a - yaw if b > 0.0 else a + math.pi - yaw)
    return b * max(math.cos(error), 0.0) ** 3, limited(gain * error, limits[1])


@njit(cache=True)
def _followed(line, k, last, x, y, yaw, limits, gain, slowdown):
    dx, dy = line[k, 0] - x, line[k, 1] - y
    if dx * dx + dy * dy < 1e-12:
        return 0.0, 0.0
    error = wrapped_angle(math.atan2(dy, dx) - yaw)
    want_v = limits[0] * max(math.cos(error), 0.0) ** 3
    if k == last:
        want_v = min(want_v, slowdown * math.hypot(dx, dy) + CREEP_SPEED)
    return want_v, limited(gain * error, limits[1])


@njit(cache=True)
def _must_brake(x, y, yaw, v, discs, time, limits, distance, caution):
    """Whether a robot that brakes fully now might be touched before it stands, with the discs where they are foreseen.

    Checked half way in time and at the end.
    """
    if abs(v) < STANDING_SPEED:
        return False
    stop = abs(v) / limits[2]
    for share in (0.5, 1.0):
        t = share * stop
        way = v * t - 0.5 * math.copysign(limits[2], v) * t * t
        px, py = x + way * math.cos(yaw), y + way * math.sin(yaw)
        for j in range(len(discs)):
            ahead = time + (1.0 - caution) * t
            dx, dy = px - discs[j, 0] - discs[j, 2] * ahead, py - discs[j, 1] - discs[j, 3] * ahead
            needed = distance + discs[j, 4] + caution * discs[j, 5] * t
            if dx * dx + dy * dy < needed * needed:
                return True
    return False


@njit(cache=True)
def _foreseen(
    ways, pose, twist, line, left, center, bearing_0, values, reach,
    star_center, star_bearing_0, star_values, discs, age, limits, settings,
):  # fmt: skip
    horizon, gain, slowdown, radius, margin, caution, comfort = settings
    v_max, omega_max, last = limits[0], limits[1], len(line) - 1
    steps = int(math.ceil(horizon / STEP - 1e-9))
    count = len(ways)
    cost, nearest, twists = np.empty(count), np.full(count, np.inf), np.empty((count, 2))
    for c in range(count):
        x, y, yaw, v, omega = pose[0], pose[1], pose[2], twist[0], twist[1]
        k, region = 1, -1
        least, lost, spent = np.inf, 0.0, 0.0
        arrived = False
        for i in range(steps):
            if i * STEP < ways[c, 3] - 1e-9:
                want_v, want_omega = _wanted(ways[c, 0], ways[c, 1], ways[c, 2], x, y, yaw, limits, gain)
            else:
                want_v, want_omega = _followed(line, k, last, x, y, yaw, limits, gain, slowdown)
            if i == 0:
                twists[c, 0], twists[c, 1] = want_v, want_omega
            time = age + i * STEP
            if i > 0 and _must_brake(x, y, yaw, v, discs, time, limits, radius + margin, caution):
                want_v = 0.0
            before_v, before_omega = v, omega
            v = ramped(v, want_v, limits[2] * STEP)
            omega = ramped(omega, want_omega, limits[3] * STEP)
            travelled, turned = 0.5 * (before_v + v) * STEP, 0.5 * (before_omega + omega) * STEP
            next_x = x + travelled * math.cos(yaw + 0.5 * turned)
            next_y = y + travelled * math.sin(yaw + 0.5 * turned)
            yaw += turned
            known = region >= 0 and covers(center[region], bearing_0[region], values[region], next_x, next_y)
            if not known and not covers(star_center, star_bearing_0, star_values, next_x, next_y):
                region = first_cover(center, bearing_0, values, reach, next_x, next_y)
                known = region >= 0
            else:
                known = True
            if known:
                x, y = next_x, next_y
                k = next_way_point(line, k, x, y)
            else:
                v = 0.0
            spent = (i + 1) * STEP
            time = age + spent
            touched = False
            for j in range(len(discs)):
                dx, dy = x - discs[j, 0] - discs[j, 2] * time, y - discs[j, 1] - discs[j, 3] * time
                away = math.hypot(dx, dy) - radius - discs[j, 4]
                worth = away / (1.0 + UNCERTAINTY * time) if away > 0.0 else away
                if worth < least:
                    least = worth
                    if worth < comfort:
                        lost = CONTACT_COST * (1.0 - max(worth, 0.0) / comfort) ** 2 * (1.0 - 0.5 * spent / horizon)
                touched = touched or away < 0.0
            if touched:
                lost = CONTACT_COST * (1.0 + 3.0 * (1.0 - spent / horizon))
                break
            if k == last and (line[k, 0] - x) ** 2 + (line[k, 1] - y) ** 2 < ARRIVED * ARRIVED:
                arrived = True
                break
        go = spent if arrived else spent + time_to_go(line, left, k, x, y, yaw, v, omega, limits)
        change = abs(twists[c, 0] - twist[0]) / v_max + abs(twists[c, 1] - twist[1]) / omega_max
        cost[c] = go + lost + CHANGE_WEIGHT * change
        if least < comfort:
            nearest[c] = least
    return cost, nearest, twists
