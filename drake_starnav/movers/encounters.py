"""Foreseen encounters: a search among sequences of manoeuvres for the way on that the predicted discs leave.

A manoeuvre is held for SEGMENT seconds: follow the path, stand, keep the present twist, or head somewhere, forwards or
backwards, as the law does (omega = gain error, v = v_max cos^3 error): for a robot that must turn before it can step
aside, that is one manoeuvre. All are simulated among the discs where their tracks will be; the robot stops at what is
not known to be free, and brakes as soon as the certificate in time would make it: a way on that its own caution would
cut short shows where it really ends. Of each generation the BEAM best ways on that differ are continued to the horizon.

In seconds,

    cost = time passed + time to go + comfort lost + contact + walls + change of the twist

Comfort is lost by the least foreseen distance d to a disc at a time t: w (1 - e / comfort)_+^2 (1 - t / (2 horizon)) with
e = d / (1 + UNCERTAINTY t). A contact at t ends a way on and costs w (1 + 3 (1 - t / horizon)): better late than soon,
since much may happen until then.
"""

import math
from dataclasses import dataclass

import numpy as np
from numba import njit

from drake_starnav.control.braking import limited, limits_array, ramped, stops_inside
from drake_starnav.control.parameters import ControllerParameters
from drake_starnav.control.point_certificate import ESCAPE_CLEARANCE, clearance_at, least_clearance_of, needed_distances
from drake_starnav.control.predictive import ARRIVED, clearance_within, next_way_point, time_to_go, times_left
from drake_starnav.control.tracking import CREEP_SPEED, wrapped_angle
from drake_starnav.movers.certificate import STANDING_SPEED, stays_clear_of
from drake_starnav.movers.course import COURSE_STEP
from drake_starnav.movers.parameters import MoverParameters
from drake_starnav.movers.tracks import Tracks
from drake_starnav.robot import RobotParameters
from drake_starnav.stars.region import RegionStack, covers, first_cover
from drake_starnav.stars.safety import SafetyStar

STEP = 0.1
"""Of the foreseen motion, s."""
SEGMENT = 5
"""Steps of a manoeuvre."""
BEAM = 16
"""Ways on that are continued."""
PATH, TWIST, HEADING = range(3)
"""Kinds of manoeuvre."""
HEADINGS = 8
"""Directions that are tried."""
SAME_PLACE, SAME_HEADING, SAME_SPEED = 0.15, 0.5, 0.3
"""Ways on that end nearer to each other than this do not differ, m, rad, m/s."""
CONTACT_COST = 8.0
"""w, s."""
UNCERTAINTY = 0.15
"""A foreseen distance is worth less with time by this share a second."""
FORESEEN_MARGIN = 0.03
"""The foreseen robot brakes for this much more than the certificate's margin, m: tracks are not as exact as hits."""
WALL_ZONE = 0.1
WALL_COST = 0.6
"""What the least clearance to what stays costs, s, if it is less than the zone, m: from a wall one cannot step aside."""
CHANGE_WEIGHT = 0.15
"""What a change of speed or turning rate by its whole range costs, s."""
X, Y, YAW, V, OMEGA, WAY_POINT, REGION, CLEARANCE, CLOSEST, LOST, LEAST, SPENT, STATE, FIRST, COST = range(15)
"""Columns of the ways on: where each ends, what has happened on it, and with which manoeuvre it began."""
GOING, ARRIVED_THERE, TOUCHED = range(3)


@dataclass(frozen=True)
class Encounter:
    """What is foreseen.

    Attributes:
        nearest: least foreseen distance to a disc if the robot just follows its path, m, infinite beyond `comfort`.
        twist: the certified (v, omega) with which the best way on begins, m/s and rad/s; None if there is none.
        least: least foreseen distance on that way, m.
    """

    nearest: float
    twist: np.ndarray | None
    least: float


def manoeuvres(twist: np.ndarray, limits: np.ndarray) -> np.ndarray:
    """What the robot may do next, shape (n, 3): kind, and (v, omega), (heading, speed) or nothing. The path is first."""
    v_max = limits[0]
    rows = [(PATH, 1.0, 0.0), (PATH, 0.5, 0.0), (TWIST, 0.0, 0.0), (TWIST, *twist), (TWIST, -0.5 * v_max, 0.0)]
    for k in range(HEADINGS):
        heading = 2.0 * math.pi * k / HEADINGS
        rows += [(HEADING, heading, v_max), (HEADING, heading, -v_max)]
    return np.array(rows)


def encounter(
    pose: np.ndarray,
    twist: np.ndarray,
    path: np.ndarray,
    arrives: bool,
    regions: RegionStack,
    star: SafetyStar,
    tracks: Tracks,
    rows: np.ndarray,
    age: float,
    controller: ControllerParameters,
    robot: RobotParameters,
    movers: MoverParameters,
) -> Encounter:
    """Whether the path leads the robot too near to something that moves, and what it had better do.

    Args:
        pose: (x, y, yaw) of the robot in W, m and rad.
        twist: (v, omega) commanded last, m/s and rad/s.
        path: shape (k, 2), way points ahead, W, m; empty: nowhere to go.
        arrives: whether the last way point is the goal.
        regions: around the robot.
        star: what the last scans certify.
        tracks: of the last scan; those that count are predicted.
        rows: `threats` that the certificate in time counts with.
        age: time since the scan, s.
        controller, robot, movers: parameters.
    """
    counted = tracks.counted
    course, discs = tracks.course[counted], np.column_stack((tracks.radius, tracks.greatest_speed(movers)))[counted]
    limits = limits_array(robot)
    line = np.vstack((pose[:2], path)) if len(path) else np.vstack((pose[:2], pose[:2]))
    settings = np.array(
        (
            movers.horizon, controller.heading_gain, controller.goal_slowdown if arrives else np.inf, robot.radius,
            movers.margin, movers.caution, movers.comfort,
        )
    )  # fmt: skip
    static = (*regions.arrays, star.center, star.bearing_0, star.values, star.near_hits)
    goal, moving = (line, times_left(line, limits)), (course, discs, age)
    nearest = _along_the_path(pose, twist, static, goal, moving, limits, settings)
    if nearest >= movers.comfort:
        return Encounter(nearest, None, np.inf)
    needed = needed_distances(star.half_gaps, robot.radius)
    promise = np.array(
        (
            1.0 / controller.rate, controller.delay, robot.radius + movers.margin,
            -1.0 if not controller.certificate else controller.safety_margin, controller.margin_per_speed,
            1.0 if controller.certified_by == "star" else 0.0,
        )
    )  # fmt: skip
    v, omega, least, found = _searched(
        manoeuvres(twist, limits), pose, twist, static, goal, moving, limits, settings, rows, star.hits, needed, promise
    )
    return Encounter(nearest, np.array((v, omega)) if found else None, least)


@njit(cache=True)
def stops_clear(
    x, y, yaw, v, omega, want_v, want_omega, limits, promise, star_center, star_bearing_0, star_values, hits, needed
):
    """Whether a twist passes the certificate against what stays.

    Outside of the safety star, next to a wall, it must not come nearer to any hit than the robot is now.
    """
    hold, delay, _, margin, per_speed, by_star = promise
    if margin < 0.0:
        return True
    if by_star > 0.0 and stops_inside(
        x, y, yaw, v, omega, want_v, want_omega, hold, delay, limits, star_center, star_bearing_0, star_values
    ):
        return True
    if len(hits) == 0:
        return False
    enough = margin + per_speed * abs(want_v)
    if by_star > 0.0:
        enough = min(enough, clearance_at(x, y, hits, needed))
    enough = max(enough, ESCAPE_CLEARANCE)
    least = least_clearance_of(x, y, yaw, v, omega, want_v, want_omega, hold, delay, limits, hits, needed, enough)
    return least >= enough


@njit(cache=True)
def _start(pose, twist, static, limits, settings):
    row = np.zeros(15)
    row[X], row[Y], row[YAW], row[V], row[OMEGA] = pose[0], pose[1], pose[2], twist[0], twist[1]
    row[WAY_POINT], row[REGION], row[LEAST] = 1, -1, np.inf
    row[CLEARANCE] = row[CLOSEST] = clearance_within(pose[0], pose[1], static[7], settings[3], WALL_ZONE)
    return row


@njit(cache=True)
def _along_the_path(pose, twist, static, goal, moving, limits, settings):
    row = _start(pose, twist, static, limits, settings)
    steps = int(math.ceil(settings[0] / STEP - 1e-9))
    _drive(row, PATH, 1.0, 0.0, steps, static, goal, moving, limits, settings)
    return row[LEAST] if row[LEAST] < settings[6] else np.inf


@njit(cache=True)
def _wanted(kind, a, b, row, line, last, limits, gain, slowdown):
    """The twist that a manoeuvre wants where the robot is."""
    if kind == TWIST:
        return a, b
    if kind == HEADING:
        error = wrapped_angle(a - row[YAW] if b > 0.0 else a + math.pi - row[YAW])
        return b * max(math.cos(error), 0.0) ** 3, limited(gain * error, limits[1])
    k = int(row[WAY_POINT])
    dx, dy = line[k, 0] - row[X], line[k, 1] - row[Y]
    if dx * dx + dy * dy < 1e-12:
        return 0.0, 0.0
    error = wrapped_angle(math.atan2(dy, dx) - row[YAW])
    want_v = a * limits[0] * max(math.cos(error), 0.0) ** 3
    if k == last:
        want_v = min(want_v, slowdown * math.hypot(dx, dy) + CREEP_SPEED)
    return want_v, limited(gain * error, limits[1])


@njit(cache=True)
def _place(course, j, time):
    """Where disc j is foreseen to be, and its velocity."""
    at = min(time / COURSE_STEP, len(course[j]) - 1.001)
    i = int(at)
    share = at - i
    dx, dy = course[j, i + 1, 0] - course[j, i, 0], course[j, i + 1, 1] - course[j, i, 1]
    return course[j, i, 0] + share * dx, course[j, i, 1] + share * dy, dx / COURSE_STEP, dy / COURSE_STEP


@njit(cache=True)
def _must_brake(x, y, yaw, v, course, discs, time, limits, distance, caution):
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
            disc_x, disc_y, vx, vy = _place(course, j, time)
            dx, dy = px - disc_x - (1.0 - caution) * vx * t, py - disc_y - (1.0 - caution) * vy * t
            needed = distance + discs[j, 0] + caution * discs[j, 1] * t
            if dx * dx + dy * dy < needed * needed:
                return True
    return False


@njit(cache=True)
def _drive(row, kind, a, b, steps, static, goal, moving, limits, settings):
    """Continue a way on in place by one manoeuvre; it ends early where the robot arrives or is touched."""
    center, bearing_0, values, reach, star_center, star_bearing_0, star_values, hits = static
    line, _ = goal
    course, discs, age = moving
    horizon, gain, slowdown, radius, margin, caution, comfort = settings
    last = len(line) - 1
    for _ in range(steps):
        time = age + row[SPENT]
        x, y, yaw, v, omega = row[X], row[Y], row[YAW], row[V], row[OMEGA]
        want_v, want_omega = _wanted(kind, a, b, row, line, last, limits, gain, slowdown)
        if _must_brake(x, y, yaw, v, course, discs, time, limits, radius + margin + FORESEEN_MARGIN, caution):
            want_v = 0.0
        row[V] = ramped(v, want_v, limits[2] * STEP)
        row[OMEGA] = ramped(omega, want_omega, limits[3] * STEP)
        travelled, turned = 0.5 * (v + row[V]) * STEP, 0.5 * (omega + row[OMEGA]) * STEP
        x += travelled * math.cos(yaw + 0.5 * turned)
        y += travelled * math.sin(yaw + 0.5 * turned)
        row[YAW] = yaw + turned
        k = int(row[REGION])
        known = k >= 0 and covers(center[k], bearing_0[k], values[k], x, y)
        if not known and not covers(star_center, star_bearing_0, star_values, x, y):
            k = first_cover(center, bearing_0, values, reach, x, y)
            row[REGION] = k
            known = k >= 0
        else:
            known = True
        clearance = clearance_within(x, y, hits, radius, WALL_ZONE)
        if known or clearance > row[CLEARANCE]:
            row[X], row[Y], row[CLEARANCE] = x, y, clearance
            row[CLOSEST] = min(row[CLOSEST], clearance)
            row[WAY_POINT] = next_way_point(line, int(row[WAY_POINT]), x, y)
        else:
            row[V] = 0.0
            x, y = row[X], row[Y]
        row[SPENT] += STEP
        time = age + row[SPENT]
        touched = False
        for j in range(len(discs)):
            disc_x, disc_y, _, _ = _place(course, j, time)
            away = math.hypot(x - disc_x, y - disc_y) - radius - discs[j, 0]
            worth = away / (1.0 + UNCERTAINTY * time) if away > 0.0 else away
            row[LEAST] = min(row[LEAST], worth)
            if worth < comfort:
                lost = CONTACT_COST * (1.0 - max(worth, 0.0) / comfort) ** 2 * (1.0 - 0.5 * row[SPENT] / horizon)
                row[LOST] = max(row[LOST], lost)
            touched = touched or away < 0.0
        if touched:
            row[STATE] = TOUCHED
            row[LOST] = CONTACT_COST * (1.0 + 3.0 * (1.0 - row[SPENT] / horizon))
            return
        k = int(row[WAY_POINT])
        if k == last and (line[k, 0] - x) ** 2 + (line[k, 1] - y) ** 2 < ARRIVED * ARRIVED:
            row[STATE] = ARRIVED_THERE
            return


@njit(cache=True)
def _value(row, goal, limits):
    cost = row[SPENT] + row[LOST] + WALL_COST * (1.0 - row[CLOSEST] / WALL_ZONE) ** 2
    if row[STATE] != ARRIVED_THERE:
        cost += time_to_go(goal[0], goal[1], int(row[WAY_POINT]), row[X], row[Y], row[YAW], row[V], row[OMEGA], limits)
    return cost


@njit(cache=True)
def _searched(ways, pose, twist, static, goal, moving, limits, settings, rows, hits, needed, promise):
    horizon, gain, slowdown = settings[0], settings[1], settings[2]
    star_center, star_bearing_0, star_values = static[4], static[5], static[6]
    line, age = goal[0], moving[2]
    count = len(ways)
    start = _start(pose, twist, static, limits, settings)
    change, firsts = np.zeros(count), np.empty((count, 2))
    generation = np.empty((count, 15))
    n = 0
    for m in range(count):
        v, omega = _wanted(ways[m, 0], ways[m, 1], ways[m, 2], start, line, len(line) - 1, limits, gain, slowdown)
        firsts[m, 0], firsts[m, 1] = v, omega
        change[m] = CHANGE_WEIGHT * (abs(v - twist[0]) / limits[0] + abs(omega - twist[1]) / limits[1])
        x, y, yaw = pose[0], pose[1], pose[2]
        if not stays_clear_of(
            x, y, yaw, twist[0], twist[1], v, omega, promise[0], promise[1], limits, rows, promise[2], age
        ) or not stops_clear(
            x, y, yaw, twist[0], twist[1], v, omega, limits, promise, star_center, star_bearing_0, star_values,
            hits, needed,
        ):  # fmt: skip
            continue
        generation[n] = start
        _drive(generation[n], ways[m, 0], ways[m, 1], ways[m, 2], SEGMENT, static, goal, moving, limits, settings)
        generation[n, FIRST] = m
        generation[n, COST] = _value(generation[n], goal, limits) + change[m]
        n += 1
    best = start
    best_cost = np.inf
    generation = generation[:n]
    segments = int(math.ceil(horizon / (SEGMENT * STEP) - 1e-9))
    for depth in range(1, segments + 1):
        for i in range(len(generation)):  # what has ended competes with what has come to the horizon
            row = generation[i]
            if (depth == segments or row[STATE] != GOING) and row[COST] < best_cost:
                best_cost = row[COST]
                best = row
        if depth == segments:
            break
        kept = np.empty(BEAM, np.int64)
        picked = 0
        for i in np.argsort(generation[:, COST], kind="mergesort"):
            row = generation[i]
            differs = row[STATE] == GOING
            for q in range(picked):
                other = generation[kept[q]]
                if (
                    (row[X] - other[X]) ** 2 + (row[Y] - other[Y]) ** 2 < SAME_PLACE * SAME_PLACE
                    and abs(wrapped_angle(row[YAW] - other[YAW])) < SAME_HEADING
                    and abs(row[V] - other[V]) < SAME_SPEED
                ):
                    differs = False
                    break
            if differs:
                kept[picked] = i
                picked += 1
                if picked == BEAM:
                    break
        following = np.empty((picked * count, 15))
        n = 0
        for q in range(picked):
            for m in range(count):
                following[n] = generation[kept[q]]
                _drive(
                    following[n], ways[m, 0], ways[m, 1], ways[m, 2], SEGMENT, static, goal, moving, limits, settings
                )
                following[n, COST] = _value(following[n], goal, limits) + change[int(following[n, FIRST])]
                n += 1
        generation = following
    if best_cost == np.inf:
        return 0.0, 0.0, -np.inf, False
    first = int(best[FIRST])
    return firsts[first, 0], firsts[first, 1], best[LEAST], True
