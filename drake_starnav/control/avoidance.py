"""Collision avoidance: a search over sequences of manoeuvres for the best way past the predicted discs.

A manoeuvre is held for SEGMENT steps: follow the path, stop, keep the present twist, or drive in a direction, forwards
or backwards, by the heading law (omega = gain error, v = v_max cos^3 error): turning and then driving aside is one
manoeuvre. Each is simulated as in `avoidance_rollout`. The first one must begin with a twist that the certificates
accept. Of each generation the BEAM best rollouts that differ are continued, up to the horizon.
"""

import math
from dataclasses import dataclass

import numpy as np
from numba import njit

from drake_starnav.control.avoidance_rollout import (
    COLUMNS,
    COMFORT,
    COST,
    ENDED,
    FIRST,
    HEADING,
    HELD,
    LEAST,
    OMEGA,
    PATH,
    STEP,
    TWIST,
    YAW,
    Discs,
    Scene,
    Settings,
    V,
    X,
    Y,
    drive,
    start_row,
    wanted_twist,
)
from drake_starnav.control.certificates import Certificate, accepted
from drake_starnav.control.inputs import ControllerInputs, TrackedObstacles
from drake_starnav.control.motion import Actuation, roll_out
from drake_starnav.control.moving_certificate import MOVING_MARGIN, STANDING_SPEED
from drake_starnav.control.moving_modulation import moving_modulation
from drake_starnav.control.rollout import GOAL_SLOWDOWN, FreeSpace, times_left
from drake_starnav.robot import Limits, RobotParameters
from drake_starnav.robot.limits import limited, wrapped_angle
from drake_starnav.tracking.kalman_tracks import Tracks
from drake_starnav.tracking.prediction import HORIZON

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


CREEPING_COMFORT = 0.1
COMFORT_TIME = 2.0
"""The robot gives way to what creeps at this distance, m, and as far as that comes in this time, s."""
STANDING_SPACING = 0.4
"""Hits on static objects that are nearer to each other than this, in radii of the robot, are treated as one."""


@dataclass(frozen=True)
class Avoidance:
    """The prediction, and the response.

    Attributes:
        nearest: least predicted distance to a disc if the robot just follows its path, m, infinite beyond COMFORT.
        twist: the certified (v, omega) with which the best rollout begins, m/s and rad/s; None if there is none.
        least: least predicted distance on that rollout, m.
    """

    nearest: float
    twist: np.ndarray | None
    least: float


def manoeuvres(twist: np.ndarray, limits: Limits, aside: np.ndarray | None = None) -> np.ndarray:
    """What the robot may do next, shape (n, 3): kind, and (v, omega), (heading, speed), or a share of speed.

    Args:
        twist: (v, omega) commanded last, m/s and rad/s.
        limits: of the robot.
        aside: a velocity that leads around dynamic obstacles, shape (2,), W, m/s.
    """
    v_max = limits.max_speed
    rows = [(PATH, 1.0, 0.0), (PATH, 0.5, 0.0), (TWIST, 0.0, 0.0), (TWIST, *twist), (TWIST, -0.5 * v_max, 0.0)]
    for k in range(HEADINGS):
        heading = 2.0 * math.pi * k / HEADINGS
        rows += [(HEADING, heading, v_max), (HEADING, heading, -v_max)]
    if aside is not None:
        rows.append((HEADING, math.atan2(aside[1], aside[0]), min(math.hypot(*aside), v_max)))
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
    radii = tracks.radius[foreseen] + robot.radius + MOVING_MARGIN + obstacles.stopping_distance
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
) -> Avoidance:
    """Whether the path leads too near to an obstacle that moves or might start, and the best manoeuvre if so.

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
        return Avoidance(np.inf, None, np.inf)
    pose, twist, guidance, star = inputs
    limits, path = robot.limits, guidance.path
    line = np.vstack((pose[:2], path)) if len(path) else np.vstack((pose[:2], pose[:2]))
    known = FreeSpace.of(guidance.regions, star)
    standing = thinned(tracks.standing, pose[:2], HORIZON * robot.max_speed, STANDING_SPACING * robot.radius)
    trajectories, near = tracks.predicted_trajectories[foreseen], comfort(tracks, obstacles.guarded)[foreseen]
    discs = Discs(trajectories, tracks.radius[foreseen], near, standing, age)
    settings = Settings(
        slowdown=GOAL_SLOWDOWN if guidance.arrives or not len(path) else np.inf,
        radius=robot.radius,
        spacing=MOVING_MARGIN + obstacles.stopping_distance,
        caution=obstacles.caution,
        max_speed=obstacles.max_speed,
    )
    settings = Settings._make(map(float, settings))  # a whole number would have all compiled again
    scene = Scene(line, times_left(line, limits), known, discs, limits, settings)
    start = start_row(pose, twist, known.hits, settings.radius)
    ahead = start[None].copy()
    drive(ahead, np.array([(PATH, 1.0, 0.0)]), int(math.ceil(HORIZON / STEP - 1e-9)), scene)
    nearest = float(ahead[0, LEAST]) if ahead[0, LEAST] < COMFORT else np.inf
    if nearest >= COMFORT and not ahead[0, HELD]:
        return Avoidance(nearest, None, np.inf)
    ways = manoeuvres(twist, limits, around(pose, path, tracked, robot))
    firsts = _first_twists(ways, start, scene)
    allowed = np.array([accepted(roll_out(pose, twist, first, actuation), certificates) for first in firsts])
    k, least = _searched(ways, firsts, allowed, start, scene)
    return Avoidance(nearest, firsts[k] if k >= 0 else None, least)


@njit(cache=True)
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
            kept[n] = x, y
            n += 1
    return kept[:n]


@njit(cache=True)
def _first_twists(ways, start, scene):
    """The twists (n, 2) with which manoeuvres begin, within the robot's limits."""
    firsts, limits = np.empty((len(ways), 2)), scene.limits
    for m in range(len(ways)):
        v, omega = wanted_twist((ways[m, 0], ways[m, 1], ways[m, 2]), start, scene.line, limits, scene.settings)
        firsts[m, 0], firsts[m, 1] = limited(v, limits.max_speed), limited(omega, limits.max_yaw_rate)
    return firsts


@njit(cache=True)
def _searched(ways, firsts, allowed, start, scene):
    """The manoeuvre with which the best rollout begins, or -1, and its least predicted distance, m."""
    count, limits, allowed = len(ways), scene.limits, np.flatnonzero(allowed)
    speed, turning = np.abs(firsts[:, 0] - start[V]), np.abs(firsts[:, 1] - start[OMEGA])
    change = CHANGE_WEIGHT * (speed / limits.max_speed + turning / limits.max_yaw_rate)
    generation = np.empty((len(allowed), COLUMNS))
    generation[:] = start
    generation[:, FIRST] = allowed
    drive(generation, ways[allowed], SEGMENT, scene)
    generation[:, COST] += change[allowed]
    best = start
    best_cost = np.inf
    segments = int(math.ceil(HORIZON / (SEGMENT * STEP) - 1e-9))
    for depth in range(1, segments + 1):
        for i in range(len(generation)):  # rollouts that ended compete with those that reached the horizon
            row = generation[i]
            if (depth == segments or row[ENDED] > 0.0) and row[COST] < best_cost:
                best_cost = row[COST]
                best = row
        if depth == segments:
            break
        kept = _continued(generation, SAME_PLACE * scene.settings.radius, SAME_SPEED * limits.max_speed)
        following = np.empty((len(kept), count, COLUMNS))
        held = np.empty((len(kept), count, 3))
        for i in range(len(kept)):
            following[i] = generation[kept[i]]
            held[i] = ways
        generation = following.reshape(-1, COLUMNS)
        drive(generation, held.reshape(-1, 3), SEGMENT, scene)
        for i in range(len(generation)):
            generation[i, COST] += change[int(generation[i, FIRST])]
    if best_cost == np.inf:
        return -1, -np.inf
    return int(best[FIRST]), best[LEAST]


@njit(cache=True)
def _continued(generation, same_place, same_speed):
    """Indices of the BEAM best rollouts that have not ended and differ by so much, m or m/s, the best first."""
    kept = np.empty(BEAM, np.int64)
    n = 0
    for i in np.argsort(generation[:, COST], kind="mergesort"):
        if generation[i, ENDED] > 0.0:
            continue
        differs = True
        for q in range(n):
            k = kept[q]
            differs = not (
                (generation[i, X] - generation[k, X]) ** 2 + (generation[i, Y] - generation[k, Y]) ** 2
                < same_place * same_place
                and abs(wrapped_angle(generation[i, YAW] - generation[k, YAW])) < SAME_HEADING
                and abs(generation[i, V] - generation[k, V]) < same_speed
            )
            if not differs:
                break
        if differs:
            kept[n] = i
            n += 1
            if n == BEAM:
                break
    return kept[:n]
