"""Sampling-based model predictive control: among many certified twists, the one with the best predicted motion.

The candidates are a lattice over the robot's speeds and turning rates, the twist of the law in `path_following.py`, the
present twist, and the present turning rate alone. Each is rolled out: held for a while, then the robot heads for the
next way point by the law, v = v_max cos^3(error), omega = HEADING_GAIN error; a step that would leave known free space
is not taken, and the robot only turns. In seconds,

    cost = min over t of [ t + T(t) + (w_c / v_max) int_0^t (1 - c/ZONE)_+^2 ds ]
           + w_s |v' - v|/v_max + w_s |omega' - omega|/omega_max,   HORIZON/2 <= t <= HORIZON

T, the time to go: the remaining path at full speed, and the time lost until the robot drives along it at full speed,
for the present heading and at each corner (`heading_loss`). c is the clearance, (v', omega') the candidate, (v, omega)
the present twist. Three properties keep the robot from waiting forever in narrow places:
 (1) distance near walls costs, not time: with w_c < 1 passing is always cheaper than standing;
 (2) T does not jump where a corner is passed, and includes the time to accelerate;
 (3) a motion is judged by its best moment in the second half of the horizon, so that a setback of the prediction near
     the horizon is no reason to start later.
The candidates are certified in the order of their cost, and the first that passes is proposed; if none does, the law's
twist is, as it would be without prediction.
"""

import dataclasses
import math
from typing import NamedTuple

import numpy as np
from numba import njit

from drake_starnav.control.certificates import Certificate, accepted
from drake_starnav.control.inputs import ControllerInputs, Proposal
from drake_starnav.control.motion import Actuation, Pose, Velocity, advanced, gripped, roll_out
from drake_starnav.control.path_following import followed
from drake_starnav.control.rollout import (
    ARRIVED,
    CREEP_SPEED,
    GOAL_SLOWDOWN,
    FreeSpace,
    clearance_within,
    next_way_point,
    region_around,
    time_to_go,
    times_left,
)
from drake_starnav.regions.margins import Margins
from drake_starnav.regions.region_union import RegionUnion, covers, excess, first_gap
from drake_starnav.robot import RobotParameters
from drake_starnav.robot.limits import turning_twist, wrapped_angle

HORIZON = 1.5
"""How far ahead the law looks, s."""
STEP = 0.1
"""Step of the simulated motion, s."""
HOLD = 0.3
"""How long a sampled twist is held before the path is followed, s."""
SPEED_SAMPLES = 5
"""Sampled speeds from 0 to the largest."""
TURN_SAMPLES = 11
"""Sampled turning rates, denser near 0."""
ZONE = 0.1
"""Clearance below which a metre counts as longer, m."""
CLEARANCE_WEIGHT = 0.9
"""w_c, how much longer a metre right at an obstacle counts: below 1, or standing may seem better than passing."""
CHANGE_WEIGHT = 0.15
"""w_s, what a change of speed or turning rate by its whole range costs, s."""
TURN_EXPONENT = 1.5
"""The sampled turning rates are max_yaw_rate * share ** TURN_EXPONENT for equally spaced shares."""
SIGHT_HALVINGS = 6
"""Bisections of a segment in search of the last point in sight."""


class _Settings(NamedTuple):
    """What the cost depends on besides its constants; SI units.

    Attributes:
        slowdown: speed per distance to the goal; infinite where the path ends at a frontier.
        radius: of the robot.
        margin: safety margin.
    """

    slowdown: float
    radius: float
    margin: float


def predictive_twist(
    inputs: ControllerInputs,
    certificates: tuple[Certificate, ...],
    actuation: Actuation,
    margins: Margins,
    robot: RobotParameters,
) -> Proposal:
    """The certified candidate with the least cost; where there is none, or no way point is in sight, the law's twist.

    The actuation says what commands do; of the margins only the safety margin counts.
    """
    law = followed(inputs, margins, robot)
    pose, twist, guidance, _ = inputs
    if not len(guidance.path) or guidance.distance_to_goal(pose[:2]) < ARRIVED:
        return law
    seen = path_in_sight(pose[:2], guidance.path, guidance.regions)
    if seen is None:
        return law
    twists = candidates(twist, law.twist, robot)
    in_sight = inputs._replace(guidance=dataclasses.replace(guidance, path=seen))
    twists = twists[np.argsort(rollout_costs(twists, in_sight, margins, robot), kind="stable")]
    for target in twists:
        if accepted(roll_out(pose, twist, target, actuation), certificates):
            return law._replace(twist=target)
    return law


def candidates(twist: np.ndarray, reactive: np.ndarray, robot: RobotParameters) -> np.ndarray:
    """The sampled twists, shape (n, 2), (v, omega): at equal cost the earlier one is taken, the law's first."""
    speeds = np.linspace(0.0, robot.max_speed, SPEED_SAMPLES)
    share = np.linspace(-1.0, 1.0, TURN_SAMPLES)
    turns = robot.max_yaw_rate * np.sign(share) * np.abs(share) ** TURN_EXPONENT
    lattice = np.column_stack((np.repeat(speeds, len(turns)), np.tile(turns, len(speeds))))
    fastest = gripped(robot.max_acceleration) / np.maximum(lattice[:, 0], 1e-9)
    lattice[:, 1] = np.clip(lattice[:, 1], -fastest, fastest)
    return np.vstack((reactive, twist, (0.0, twist[1]), lattice))


def path_in_sight(position: np.ndarray, path: np.ndarray, regions: RegionUnion) -> np.ndarray | None:
    """The path, preceded by a way point that the robot sees inside the union of regions, shape (k, 2).

    The robot may have left the line on which it saw the next way point. If a region contains both, its centre sees
    both, and the path through the centre is pulled taut; if none does, the result is None.
    """
    ahead = path[0]
    if _sees(position, ahead, regions):
        return path
    centers = regions.center[(excess(regions, *position) <= 0.0) & (excess(regions, *ahead) <= 0.0)]
    if not len(centers):
        return None
    over = np.hypot(*(centers - position).T) + np.hypot(*(centers - ahead).T)
    corner = _farthest_seen(position, centers[np.argmin(over)], ahead, regions)
    return np.vstack((_farthest_seen(ahead, corner, position, regions), path))


def _sees(place: np.ndarray, other: np.ndarray, regions: RegionUnion) -> bool:
    """Whether the line between two places (2,) stays inside the union."""
    return bool(first_gap(regions, tuple(place.tolist()), tuple(other.tolist()), 0.0) < 0.0)


def _farthest_seen(place: np.ndarray, a: np.ndarray, b: np.ndarray, regions: RegionUnion) -> np.ndarray:
    """The farthest point (2,) that a place sees on the way from a, which it sees, to b, which it does not."""
    low, high = 0.0, 1.0
    for _ in range(SIGHT_HALVINGS):
        share = 0.5 * (low + high)
        if _sees(place, a + share * (b - a), regions):
            low = share
        else:
            high = share
    return a + low * (b - a)


def rollout_costs(twists: np.ndarray, inputs: ControllerInputs, margins: Margins, robot: RobotParameters) -> np.ndarray:
    """The cost of each of the candidates `twists` (n, 2), shape (n,), s; other arguments as for `predictive_twist`."""
    pose, twist, guidance, star = inputs
    limits = robot.limits
    line = np.vstack((pose[:2], guidance.path))
    slowdown = GOAL_SLOWDOWN if guidance.arrives else np.inf
    settings = _Settings(slowdown, float(robot.radius), float(margins.safety))
    known = FreeSpace.of(guidance.regions, star)
    return _rollout_costs(twists, pose, twist, line, times_left(line, limits), known, limits, settings)


@njit(cache=True)
def _rollout_costs(twists, pose, twist, line, left, known, limits, settings):
    """The cost (n,) of each of the twists (n, 2), by the line to follow and what is left of it from each corner."""
    hits, star = known.hits, known.star
    center, bearing_0, values = star.center, star.bearing_0, star.values
    radius = settings.radius
    v_max, omega_max, last = limits.max_speed, limits.max_yaw_rate, len(line) - 1
    steps = int(math.ceil(HORIZON / STEP - 1e-9))
    cost = np.empty(len(twists))
    clearance_now = clearance_within(pose[0], pose[1], hits, radius, ZONE)
    for c in range(len(twists)):
        x, y, yaw, v, omega = pose[0], pose[1], pose[2], twist[0], twist[1]
        k, region = 1, -1
        clearance, near_walls, best = clearance_now, 0.0, np.inf
        for i in range(steps):
            dx, dy = line[k, 0] - x, line[k, 1] - y
            if i * STEP < HOLD - 1e-9:
                want_v, want_omega = twists[c, 0], twists[c, 1]
            else:
                error = wrapped_angle(math.atan2(dy, dx) - yaw)
                want_v, want_omega = turning_twist(error, v_max, limits)
            if k == last:
                want_v = min(want_v, settings.slowdown * math.hypot(dx, dy) + CREEP_SPEED)
            now, moves = Pose(x, y, yaw), Velocity(v, 0.0, omega)
            now, moves, travelled = advanced(now, moves, Velocity(want_v, 0.0, want_omega), STEP, limits)
            next_x, next_y, yaw, v, omega = now.x, now.y, now.yaw, moves.ahead, moves.turning
            free = covers(center, bearing_0, values, 0, next_x, next_y, 0.0)
            if not free:
                region = region_around(known, region, next_x, next_y)
                free = region >= 0
            next_clearance = clearance_within(next_x, next_y, hits, radius, ZONE)
            if free and (next_clearance >= settings.margin or next_clearance >= clearance):
                x, y, clearance = next_x, next_y, next_clearance
                near_walls += abs(travelled) * (1.0 - clearance / ZONE) ** 2
                k = next_way_point(line, k, x, y)
            else:
                v = 0.0
            spent = (i + 1) * STEP - HORIZON + CLEARANCE_WEIGHT * near_walls / v_max
            if k == last and (line[k, 0] - x) ** 2 + (line[k, 1] - y) ** 2 < ARRIVED * ARRIVED:
                best = min(best, spent)
                break
            if 2 * (i + 1) >= steps:
                now, moves = Pose(x, y, yaw), Velocity(v, 0.0, omega)
                best = min(best, spent + time_to_go(line, left, k, now, moves, limits))
        change = abs(twists[c, 0] - twist[0]) / v_max + abs(twists[c, 1] - twist[1]) / omega_max
        cost[c] = best + CHANGE_WEIGHT * change
    return cost
