"""Collision avoidance: a search over sequences of manoeuvres for the best way past the predicted discs.

A manoeuvre is held for SEGMENT steps: follow the path, stop, keep the velocity, or drive in a direction, forwards or
backwards, as the base does it (`aimed`): turning and then driving aside is one manoeuvre. Each is simulated as in
`avoidance_rollout`. The first one must begin with a twist that the certificates accept. Of each generation the
BEAM best rollouts that differ are continued, up to the horizon.
"""

import functools
import math

import numpy as np

from drake_starnav.control.avoidance_rollout import (
    HEADING,
    PATH,
    ROLLOUT,
    TWIST,
    Scene,
    Settings,
    begun,
    drive,
    wanted_velocity,
)
from drake_starnav.control.inputs import ControllerInputs
from drake_starnav.control.moving_modulation import moving_modulation
from drake_starnav.control.rollout import (
    COMFORT,
    STEP,
    Discs,
    FreeSpace,
    foreseen_discs,
    goal_slowdown,
    times_left,
)
from drake_starnav.geometry.compiled import kernel, leaf, put
from drake_starnav.robot import Limits, RobotParameters
from drake_starnav.robot.base import twist_of
from drake_starnav.robot.limits import limited, wrapped_angle
from drake_starnav.robot.motion import Actuation, Pose, roll_out, velocity_of
from drake_starnav.safety.certificates import Certificate, accepted
from drake_starnav.safety.moving_certificate import MOVING_MARGIN, STANDING_SPEED
from drake_starnav.tracking.kalman_tracks import Tracks
from drake_starnav.tracking.prediction import HORIZON
from drake_starnav.tracking.tracker import TrackedObstacles

SEGMENT = 5
"""Steps of a manoeuvre."""
BEAM = 16
"""Rollouts that are continued."""
HEADINGS = 8
"""Directions that are tried."""
SAME_PLACE, SAME_HEADING, SAME_SPEED = 0.6, 0.5, 0.375
"""Rollouts that end nearer to each other than this do not differ: radii of the robot, rad, share of its speed."""
CHANGE_WEIGHT = 0.15
"""What a change of speed or turning rate by its whole range costs, s."""
LEAST_RISK = 0.15
"""Risk along the path, s, up to which no other way is searched."""
CREEPING_COMFORT = 0.1
COMFORT_TIME = 2.0
"""The robot gives way to what creeps at this distance, m, and as far as it comes in this, s: persons, by nature."""
STANDING_SPACING = 0.4
"""Hits on static objects that are nearer to each other than this, in radii of the robot, are treated as one."""


def manoeuvres(twist: np.ndarray, limits: Limits, aside: np.ndarray | None = None) -> np.ndarray:
    """What the robot may do next, shape (n, 4): kind, and a `Velocity`, (heading, speed), or a share of speed.

    Args:
        twist: of the base, commanded last.
        limits: of the robot.
        aside: a velocity that leads around dynamic obstacles, shape (2,), W, m/s.
    """
    v_max = limits.max_speed
    rows = [(PATH, share, 0.0, 0.0) for share in (1.0, 0.5)]
    rows += [(TWIST, *moves) for moves in ((0.0, 0.0, 0.0), velocity_of(twist), (-0.5 * v_max, 0.0, 0.0))]
    for k in range(HEADINGS):
        heading = 2.0 * math.pi * k / HEADINGS
        rows += [(HEADING, heading, v_max, 0.0), (HEADING, heading, -v_max, 0.0)]
    if aside is not None:
        rows.append((HEADING, math.atan2(aside[1], aside[0]), min(math.hypot(*aside), v_max), 0.0))
    return np.array(rows)


def around(pose: np.ndarray, path: np.ndarray, tracked: TrackedObstacles, robot: RobotParameters) -> np.ndarray | None:
    """The velocity towards the next way point, modulated around the foreseen tracks; None without one."""
    if not len(path):
        return None
    tracks, age, obstacles = tracked
    ahead = path[0] - pose[:2]
    velocity = robot.max_speed * ahead / max(math.hypot(*ahead), 1e-9)
    foreseen, velocities = tracks.foreseen, tracks.expected_velocity[tracks.foreseen]
    centers = tracks.position[foreseen] + age * velocities
    radii = tracks.radius[foreseen] + robot.radius + MOVING_MARGIN * robot.shape.narrow + obstacles.stopping_distance
    aside = moving_modulation(pose[:2], velocity, centers, velocities, radii)
    return aside if math.hypot(*aside) > STANDING_SPEED else None


def comfort(tracks: Tracks, guarded: bool) -> np.ndarray:
    """Foreseen distance from each track below which the robot gives way, shape (n,), m.

    Beside what might start at full speed a robot that is `guarded` could no longer move away.
    """
    speed = np.hypot(*tracks.drift.T)
    slow = np.minimum(CREEPING_COMFORT + COMFORT_TIME * speed, COMFORT)
    return np.where(tracks.confirmed | guarded, COMFORT, slow)


def avoid_collision(
    inputs: ControllerInputs,
    tracked: TrackedObstacles,
    certificates: tuple[Certificate, ...],
    actuation: Actuation,
    robot: RobotParameters,
) -> np.ndarray | None:
    """The certified twist, of the base, with which the best manoeuvre past obstacles that move or might start begins.

    None if the path leads near to none, or no manoeuvre is allowed.

    Args:
        inputs: what the controller is given.
        tracked: the moving obstacles.
        certificates: that the twist with which a manoeuvre begins must pass.
        actuation: what commands do.
        robot: its size and limits.
    """
    tracks, age, obstacles = tracked
    foreseen = tracks.foreseen
    if not (foreseen.any() or len(tracks.standing)):
        return None
    pose, twist, guidance, star = inputs
    limits, path = robot.limits, guidance.path
    line = np.vstack((pose[:2], path)) if len(path) else np.vstack((pose[:2], pose[:2]))
    known = FreeSpace.of(guidance.regions, star)
    standing = thinned(tracks.standing[:, :2], pose[:2], HORIZON * robot.max_speed, STANDING_SPACING * robot.radius)
    trajectories, near = tracks.predicted_trajectories[foreseen], comfort(tracks, obstacles.guarded)[foreseen]
    discs = Discs(trajectories, tracks.radius[foreseen], near, standing, age)
    settings = Settings(
        slowdown=goal_slowdown(limits) if guidance.arrives or not len(path) else np.inf,
        radius=robot.radius,
        spacing=MOVING_MARGIN * robot.shape.narrow + obstacles.stopping_distance,
        caution=obstacles.caution,
        max_speed=obstacles.max_speed,
    )
    settings = Settings._make(map(float, settings))  # a whole number would have all compiled again
    scene = Scene(line, times_left(line, limits), known, discs, limits, settings)
    start = begun(pose, twist, known.hits, settings.radius)
    ahead, during = start.copy(), foreseen_discs(discs, 0.0, int(math.ceil(HORIZON / STEP - 1e-9)), settings)
    drive(start[0], np.array([(PATH, 1.0, 0.0, 0.0)]), during, scene, np.inf, ahead)
    if ahead["least"][0] >= COMFORT and not ahead["held"][0] and ahead["risk"][0] <= LEAST_RISK:
        return None
    ways = manoeuvres(twist, limits, around(pose, path, tracked, robot))
    firsts, rows = _begun_by(ways, start, scene)
    twists, apart = twist_of(firsts, actuation.base), (SAME_PLACE * robot.radius, SAME_SPEED * limits.max_speed)

    @functools.cache  # several manoeuvres begin alike
    def passes(*first: float) -> bool:
        return accepted(roll_out(pose, twist, np.array(first), actuation), certificates)

    refused = [0]
    while refused:  # only those that the search would continue, or that may be its result, are asked
        asked = [*_continued(rows, *apart), *np.flatnonzero((rows["ended"] > 0) & (rows["cost"] < np.inf))]
        refused = [k for k in asked if not passes(*twists[k].tolist())]
        rows["ended"][refused], rows["cost"][refused] = 1, np.inf
    k = _searched(ways, rows, apart, scene)
    return twists[k] if k >= 0 else None


@kernel
def thinned(places, position, reach, spacing):
    """The places (n, 2) within `reach` (m) of a position, no two of them nearer to each other than `spacing` (m)."""
    kept = np.empty((len(places), 2))
    n = 0
    for k in range(len(places)):
        x, y = places[k]
        apart = math.hypot(x - position[0], y - position[1]) < reach
        for q in range(n):
            apart = apart and (x - kept[q, 0]) ** 2 + (y - kept[q, 1]) ** 2 >= spacing**2
        if apart:
            put(kept, n, (x, y))
            n += 1
    return kept[:n]


@kernel
def _begun_by(ways, start, scene):
    """The velocities (n, 3) with which manoeuvres begin, within the robot's limits, and the rollouts (n,) of each."""
    firsts, rows, limits, row = np.empty((len(ways), 3)), np.empty(len(ways), ROLLOUT), scene.limits, start[0]
    pose, k = Pose(row.x, row.y, row.yaw), row.way_point
    way_point = scene.line[k, 0], scene.line[k, 1], k == len(scene.line) - 1
    drive(row, ways, foreseen_discs(scene.discs, row.spent, SEGMENT, scene.settings), scene, np.inf, rows)
    for m in range(len(ways)):
        way = ways[m, 0], ways[m, 1], ways[m, 2], ways[m, 3]
        wanted = wanted_velocity(way, pose, way_point, limits, scene.settings)
        firsts[m, 0], firsts[m, 1] = limited(wanted.ahead, limits.max_speed), limited(wanted.aside, limits.max_speed)
        firsts[m, 2] = limited(wanted.turning, limits.max_yaw_rate)
        rows[m].first, rows[m].change = m, _change(firsts[m], row, limits)
        rows[m].cost += rows[m].change
    return firsts, rows


@kernel
def _searched(ways, rows, apart, scene):
    """The manoeuvre with which the best rollout begins that continues one of rows (n,), `apart` as given, or -1."""
    (best, cost), count = _best(rows, False, (-1, np.inf)), len(ways)
    last = int(math.ceil(HORIZON / (SEGMENT * STEP) - 1e-9))
    for depth in range(2, last + 1):
        generation, kept = rows, _continued(rows, apart[0], apart[1])
        if not len(kept):
            break
        foreseen = foreseen_discs(scene.discs, rows[kept[0]].spent, SEGMENT, scene.settings)
        rows = np.empty(len(kept) * count, ROLLOUT)
        for k in range(len(kept)):
            group = rows[k * count : (k + 1) * count]
            drive(generation[kept[k]], ways, foreseen, scene, cost if depth == last else np.inf, group)
            best, cost = _best(group, depth == last, (best, cost))
    return best


@leaf
def _best(rows, at_horizon, than):
    """The manoeuvre and the cost of the best rollout; those that ended compete with those at the horizon."""
    best, cost = than
    for m in range(len(rows)):
        if (at_horizon or rows[m].ended > 0) and rows[m].cost < cost:
            best, cost = rows[m].first, rows[m].cost
    return best, cost


@leaf
def _change(velocity, row, limits):
    """What it costs to change from the velocity of a rollout to one of shape (3,), s."""
    speed = math.hypot(velocity[0] - row.ahead, velocity[1] - row.aside)
    return CHANGE_WEIGHT * (speed / limits.max_speed + abs(velocity[2] - row.turning) / limits.max_yaw_rate)


@kernel
def _continued(generation, same_place, same_speed):
    """Indices of the BEAM best rollouts that have not ended and differ by these, m and m/s, the best first."""
    kept = np.empty(BEAM, np.int64)
    n = 0
    cost = np.array([row.cost for row in generation])
    for i in np.argsort(cost, kind="mergesort"):
        row = generation[i]
        if row.ended > 0:
            continue
        for q in range(n):
            other = generation[kept[q]]
            if (
                (row.x - other.x) ** 2 + (row.y - other.y) ** 2 < same_place * same_place
                and abs(wrapped_angle(row.yaw - other.yaw)) < SAME_HEADING
                and math.hypot(row.ahead - other.ahead, row.aside - other.aside) < same_speed
            ):
                break
        else:
            kept[n] = i
            n += 1
        if n == BEAM:
            break
    return kept[:n]
