"""The avoidance rollout: a robot that drives among the predicted discs, and the cost of doing so.

The discs follow their predicted trajectories; static objects are assumed to stay. The robot stops at the edge of known
free space, and brakes as soon as the certificate in time would make it, also for static objects, which might start: a
rollout that the robot's own caution would cut short thus shows where it really ends.

In seconds,

    cost = time passed + time to go + comfort lost + contact + risk + walls + change of the twist

Comfort is lost by the least predicted distance d to a disc at a time t: w (1 - e / COMFORT)_+^2 (1 - t / (2 HORIZON))
with e = d / (1 + UNCERTAINTY t). Discs that the end of a rollout leaves to be passed count as those met before do: who
retreats only puts the encounter off. A contact at t ends a rollout and costs w (1 + 3 (1 - t / HORIZON)): a late
contact costs less, since predictions far ahead are uncertain.

Risk is what it costs to be where a disc may come that turns: robots that keep their distance only once it is predicted
to be short are struck while they stand. Per time it is the rate at which discs turn, times the share of directions in
which one would meet the robot, times w; it vanishes where the robot has HAZARD_TIME to leave.
"""

import math
from typing import NamedTuple

import numpy as np

from drake_starnav.control.rollout import (
    ARRIVED,
    COMFORT,
    CREEP,
    STEP,
    Discs,
    FreeSpace,
    nearest_hit,
    next_way_point,
    region_around,
    time_to_go,
)
from drake_starnav.geometry.compiled import kernel, leaf, put
from drake_starnav.robot import Limits
from drake_starnav.robot.limits import Velocity, aimed, slowed, wrapped_angle
from drake_starnav.robot.motion import Pose, moved, ramped_velocity, velocity_of
from drake_starnav.safety.moving_certificate import MOVING_MARGIN, STANDING_SPEED
from drake_starnav.surroundings.region_union import covers
from drake_starnav.tracking.prediction import HORIZON

PATH, TWIST, HEADING = range(3)
"""Kinds of manoeuvre."""
CONTACT_COST = 8.0
"""w, s."""
UNCERTAINTY = 0.15
"""A predicted distance counts for less with time, by this share per second."""
TURNING_RATE = 0.8
"""How often a disc turns to another direction, 1/s, times 4: a contact at once costs 4 w."""
APPROACH_WEIGHT = 0.6
"""By how much more a disc that comes straight on is feared, and one that leaves less."""
HAZARD_TIME = 1.5
"""An obstacle that turns is feared as far as it comes in this, s: about the time to get out of its way."""
WALL_ZONE = 0.4
WALL_COST = 0.6
"""Cost of the least clearance to static obstacles, s, if less than the zone, in radii: walls leave no room to evade."""
ROLLOUT = np.dtype(
    [
        *((name, np.float64) for name in ("x", "y", "yaw", "ahead", "aside", "turning", "change")),
        *((name, np.int64) for name in ("way_point", "region", "first")),
        *((name, np.float64) for name in ("clearance", "closest", "lost", "risk", "least", "spent", "arrival", "cost")),
        *((name, np.int64) for name in ("ended", "held")),
    ]
)
"""A rollout: pose and `Velocity` at its end, what its first change of these costs, s; the way point ahead, the
region around it and the manoeuvre it began with; clearance, the least so far, comfort lost, risk, the least distance
to discs, the time spent, that of arrival and the cost, m and s; whether it ended, and whether the robot was held."""


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


def begun(pose: np.ndarray, twist: np.ndarray, hits: np.ndarray, radius: float) -> np.ndarray:
    """The rollout before its first step, shape (1,) of `ROLLOUT`, for any base's twist."""
    row = np.zeros(1, ROLLOUT)
    row["x"], row["y"], row["yaw"] = pose
    row["ahead"], row["aside"], row["turning"] = velocity_of(twist)
    row["way_point"], row["region"], row["least"], row["arrival"] = 1, -1, np.inf, np.inf
    room = min(nearest_hit(pose[0], pose[1], hits), (1.0 + WALL_ZONE) * radius)
    row["clearance"] = row["closest"] = max(room - radius, 0.0)
    return row


@leaf
def wanted_velocity(way, pose, way_point, limits, settings):
    """The `Velocity` that a manoeuvre `way`, a row of `manoeuvres`, wants at a `Pose`.

    The way point is (x, y, whether it is the last).
    """
    kind, a, b, c = way
    if kind == TWIST:
        return Velocity(a, b, c)
    if kind == HEADING:
        return aimed(wrapped_angle(a - pose.yaw if b > 0.0 else a + math.pi - pose.yaw), b, limits)
    dx, dy, last = way_point[0] - pose.x, way_point[1] - pose.y, way_point[2]
    arrived = ARRIVED * settings.radius
    if dx * dx + dy * dy < (arrived * arrived if last else 1e-12):
        return Velocity(0.0, 0.0, 0.0)
    wanted = aimed(wrapped_angle(math.atan2(dy, dx) - pose.yaw), a * limits.max_speed, limits)
    if last:
        wanted = slowed(wanted, settings.slowdown * math.hypot(dx, dy) + limits.max_speed / CREEP)
    return wanted


@leaf
def _course(row):
    """Speed, with the sign of that along x, and the direction in which it counts, rad in W."""
    if row.aside == 0.0:
        return row.ahead, row.yaw
    return math.hypot(row.ahead, row.aside), row.yaw + math.atan2(row.aside, row.ahead)


@leaf
def _must_brake(pose, course, foreseen, s, limits, settings):
    """Whether a robot that brakes fully now might be touched before it stops, with the discs at their predictions.

    Checked at half the braking time and at its end, for all discs, whether it approaches them or not: a robot that only
    watches those ahead is soon surrounded. The discs are those of `foreseen_discs` at s.
    """
    v, heading = course
    if abs(v) < STANDING_SPEED:
        return False
    caution, stop = settings.caution, abs(v) / limits.max_acceleration
    distance = settings.radius + settings.spacing + MOVING_MARGIN * settings.radius  # again: tracks err more than hits
    ux = uy = 0.0
    for j in range(foreseen.shape[1]):
        disc_x, disc_y, radius = foreseen[s, j, 0], foreseen[s, j, 1], foreseen[s, j, 4]
        far = distance + radius + (0.5 * abs(v) + foreseen[s, j, 7]) * stop + 1e-9
        if (pose.x - disc_x) ** 2 + (pose.y - disc_y) ** 2 > far * far:
            continue
        if not (ux or uy):
            ux, uy = math.cos(heading), math.sin(heading)
        for share in (0.5, 1.0):
            t = share * stop
            way = v * t - 0.5 * math.copysign(limits.max_acceleration, v) * t * t
            px, py = pose.x + way * ux, pose.y + way * uy
            dx = px - disc_x - (1.0 - caution) * foreseen[s, j, 2] * t
            dy = py - disc_y - (1.0 - caution) * foreseen[s, j, 3] * t
            needed = distance + radius + caution * settings.max_speed * t
            if dx * dx + dy * dy < needed * needed:
                return True
    return False


@leaf
def _held(pose, course, standing, limits, settings):
    """Whether a robot that brakes fully from the next step on might be touched by an object that is static now."""
    v, heading = course
    if abs(v) < STANDING_SPEED or not len(standing):
        return False
    ux, uy = math.cos(heading), math.sin(heading)
    distance, stop = settings.radius + settings.spacing, abs(v) / limits.max_acceleration
    for share in (0.5, 1.0):
        t = share * stop
        way = v * (t + STEP) - 0.5 * math.copysign(limits.max_acceleration, v) * t * t
        px, py = pose.x + way * ux, pose.y + way * uy
        needed = distance + settings.max_speed * (t + STEP)
        for j in range(len(standing)):
            if (px - standing[j, 0]) ** 2 + (py - standing[j, 1]) ** 2 < needed * needed:
                return True
    return False


@leaf
def _walls(row, zone):
    """What a rollout costs for its distance to walls, s, which counts within the zone, m."""
    return WALL_COST * (1.0 - row.closest / zone) ** 2


@leaf
def _risk_of_step(x, y, foreseen, s, radius):
    """What a step at (x, y) costs since the discs, as foreseen at s, may turn to any direction and come here, s.

    Those that approach are more likely to.
    """
    risk = 0.0
    for j in range(foreseen.shape[1]):
        dx, dy, vx, vy = x - foreseen[s, j, 0], y - foreseen[s, j, 1], foreseen[s, j, 2], foreseen[s, j, 3]
        speed, squared = math.sqrt(vx * vx + vy * vy), dx * dx + dy * dy
        reach, both = HAZARD_TIME * speed, radius + foreseen[s, j, 4]
        if squared < (both + reach) * (both + reach) and speed > STANDING_SPEED:
            away = max(math.sqrt(squared), 1e-9)
            approach = (vx * dx + vy * dy) / (speed * away)
            share = math.asin(min(both / away, 1.0)) / math.pi * (1.0 + APPROACH_WEIGHT * approach)
            risk += share * min(1.0 - (away - both) / reach, 1.0)
    return CONTACT_COST * TURNING_RATE * risk * STEP


@leaf
def _lost_to_go(row, line, foreseen, radius, speed):
    """The comfort lost to discs that the end of a rollout leaves to be passed on the way to its way point, s.

    As if robot and discs went straight on, the robot at full speed.
    """
    lost, last = 0.0, len(foreseen) - 1
    x, y = line[row.way_point, 0] - row.x, line[row.way_point, 1] - row.y
    way = max(math.hypot(x, y), 1e-9)
    for j in range(foreseen.shape[1]):
        dx, dy = row.x - foreseen[last, j, 0], row.y - foreseen[last, j, 1]
        vx, vy = speed * x / way - foreseen[last, j, 2], speed * y / way - foreseen[last, j, 3]
        time = -(dx * vx + dy * vy) / max(vx * vx + vy * vy, 1e-9)  # of the closest approach
        time = min(max(time, 0.0), way / speed)
        distance = math.hypot(dx + time * vx, dy + time * vy)
        share = max(1.0 - distance / (radius + foreseen[last, j, 4] + COMFORT), 0.0)
        lost = max(lost, CONTACT_COST * share * share * max(1.0 - 0.5 * (row.spent + time) / HORIZON, 0.0))
    return lost


@kernel
def drive(start, ways, foreseen, scene, most, rows):
    """Continue a rollout by each of some manoeuvres: ways (n, 4), rows of `manoeuvres`, as rows (n,) to be written.

    By as many steps as the discs are `foreseen` for. Manoeuvres that are alike so far are driven once: limits make many
    begin alike. A rollout ends early if the robot is touched or reaches a frontier. Its cost is then that so far plus
    the time to the goal, s. If none can cost less than `most`, all stay where they are, at infinite cost.
    """
    line, left, known, discs, limits, settings = scene
    hits, star, standing, age, radius = known.hits, known.star, discs.standing, discs.age, settings.radius
    center, bearing_0, values = star.center, star.bearing_0, star.values
    arrived, zone, steps = ARRIVED * radius, WALL_ZONE * radius, len(foreseen) - 1
    cost = start.lost + start.risk + _walls(start, zone) + start.change
    way = math.hypot(line[-1, 0] - start.x, line[-1, 1] - start.y)
    way = way if way > arrived + steps * STEP * limits.max_speed else 0.0
    cost += min(start.arrival, start.spent + way / limits.max_speed)
    if cost - 1e-9 >= most or not len(ways):
        for m in range(len(ways)):
            rows[m] = start
            rows[m].cost = np.inf
        return
    n, last = len(ways), len(line) - 1
    like, before = np.zeros(n, np.int64), np.zeros(n, np.int64)  # the first rollout that is the same so far
    brakes, room, moves = np.zeros(n, np.bool_), np.zeros(n), np.empty((n, 6))  # no hit is nearer than room, m
    rows[0] = start
    for s in range(steps):
        for m in range(n):
            before[m], row = like[m], rows[m]
            if like[m] == m and row.ended == 0:
                pose, course = Pose(row.x, row.y, row.yaw), _course(row)
                brakes[m] = _must_brake(pose, course, foreseen, s, limits, settings)
                if _held(pose, course, standing, limits, settings):
                    brakes[m], row.held = True, 1
        for m in range(n):
            row, k = rows[before[m]], rows[before[m]].way_point
            if row.ended > 0:
                continue
            asked, pose = (ways[m, 0], ways[m, 1], ways[m, 2], ways[m, 3]), Pose(row.x, row.y, row.yaw)
            wanted = wanted_velocity(asked, pose, (line[k, 0], line[k, 1], k == last), limits, settings)
            if brakes[before[m]]:
                wanted = Velocity(0.0, 0.0, wanted.turning)
            now = Velocity(row.ahead, row.aside, row.turning)
            after, mean = ramped_velocity(now, wanted, STEP, limits)
            put(moves, m, (after.ahead, after.aside, after.turning, mean.ahead, mean.aside, mean.turning))
            like[m] = _first_alike(moves, before, m)
            if like[m] == m != before[m]:
                rows[m], room[m] = row, room[before[m]]
        for m in range(n):
            row = rows[m]
            if like[m] < m or row.ended > 0:
                continue
            mean = Velocity(moves[m, 3], moves[m, 4], moves[m, 5])
            pose, driven = moved(Pose(row.x, row.y, row.yaw), mean, STEP, limits)
            row.yaw, row.ahead, row.aside, row.turning = pose.yaw, moves[m, 0], moves[m, 1], moves[m, 2]
            free = covers(center, bearing_0, values, np.int64(0), pose.x, pose.y, 0.0)
            if not free:
                row.region = region_around(known, row.region, pose.x, pose.y)
                free = row.region >= 0
            room[m] -= abs(driven) + 1e-9
            if room[m] <= radius + zone:
                room[m] = nearest_hit(pose.x, pose.y, hits)
            clearance = max(min(room[m], radius + zone) - radius, 0.0)
            if free or clearance > row.clearance:
                row.x, row.y, row.clearance = pose.x, pose.y, clearance
                row.closest = min(row.closest, clearance)
                row.way_point = next_way_point(line, row.way_point, pose.x, pose.y, radius)
            else:
                row.ahead = row.aside = room[m] = 0.0
            row.spent += STEP
            grown = 1.0 + UNCERTAINTY * (age + row.spent)
            apart = _worth(row.x, row.y, foreseen, s + 1, radius, grown, max(row.least, COMFORT))
            row.least = min(row.least, apart)
            sureness = 1.0 - 0.5 * row.spent / HORIZON
            row.risk += sureness * _risk_of_step(row.x, row.y, foreseen, s + 1, radius)
            if apart < COMFORT:
                share = 1.0 - max(apart, 0.0) / COMFORT
                row.lost = max(row.lost, CONTACT_COST * share**2 * sureness)
            if apart < 0.0:  # it is touched
                row.ended = 1
                row.lost = CONTACT_COST * (1.0 + 3.0 * (1.0 - row.spent / HORIZON))
            at_end = (line[-1, 0] - row.x) ** 2 + (line[-1, 1] - row.y) ** 2 < arrived * arrived
            if row.ended == 0 and row.way_point == last and at_end:
                row.arrival = min(row.arrival, row.spent)
                if settings.slowdown == np.inf:  # at a frontier, where exploration continues
                    row.ended = 1
    for m in range(n):
        row = rows[m]
        if like[m] < m:
            rows[m] = rows[like[m]]
            continue
        lost, time = row.lost, row.arrival
        if time == np.inf:  # else it has been at the goal, wherever it goes to make way
            pose, now = Pose(row.x, row.y, row.yaw), Velocity(row.ahead, row.aside, row.turning)
            lost = max(lost, _lost_to_go(row, line, foreseen, radius, limits.max_speed))
            time = row.spent + time_to_go(line, left, row.way_point, pose, now, limits)
        row.cost = lost + row.risk + _walls(row, zone) + time + row.change


@leaf
def _first_alike(moves, before, m):
    """The first rollout that was the same as number m before and moves alike, (n, 6)."""
    for k in range(before[m], m):
        alike = before[k] == before[m]
        for i in range(6):
            alike = alike and moves[k, i] == moves[m, i]
        if alike:
            return k
    return m


@leaf
def _worth(x, y, foreseen, s, radius, grown, most):
    """What the distance from a robot at (x, y) to the discs is worth, m: at most `most`, negative if one touches it."""
    for j in range(foreseen.shape[1]):
        dx, dy = x - foreseen[s, j, 0], y - foreseen[s, j, 1]
        far = radius + foreseen[s, j, 4] + (most + 1e-9) * grown * foreseen[s, j, 6]
        if dx * dx + dy * dy <= far * far:
            away = math.hypot(dx, dy) - radius - foreseen[s, j, 4]
            most = min(most, away / grown * foreseen[s, j, 5] if away > 0.0 else away)
    return most
