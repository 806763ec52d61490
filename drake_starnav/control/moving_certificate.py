"""The braking certificate in time: a twist is sent only if the robot can stop before a dynamic obstacle can reach it.

Guarantee. With caution 1: if a command is accepted, and the robot keeps its last twist for a declared delay, follows
the command for one control period and then brakes as hard as its limits allow, then until it stops no dynamic
obstacle comes nearer to its centre than its radius, provided that
 (1) it is a disc no larger than `max_radius` and no faster than `max_speed`, whatever it did before,
 (2) it is visible, or occluded by something visible: nothing comes from outside the lidar's view or from nowhere, and
 (3) as for static obstacles, the robot follows its commands and the errors are at most the margin.
A place q at the time of the scan is taken to be anywhere within

    | p - q - (1 - c) u t | <= c g t        u its track's velocity, g = max_speed

a time t later, with the caution c. With c = 1 that is all directions. The places are

    hits of tracks                                trusted by 1 - c to continue with u
    hits neither tracked nor static               always with c = 1: there is no motion to trust
    hits on static objects that are small enough  with c = 1 only: they may start to move
    the edges of occluded areas                   with c = 1 only: something may come out

Convex surfaces wider than 2 max_radius are static (`surfaces`). No certificate prevents an obstacle from hitting the
robot while it stands.
"""

import math
from typing import NamedTuple

import numpy as np
from numba import njit

from drake_starnav.control.braking_certificate import BRAKING, braking_motion
from drake_starnav.robot import Limits
from drake_starnav.tracking.kalman_tracks import Tracks
from drake_starnav.tracking.occlusions import OCCLUSION_SPACING
from drake_starnav.tracking.parameters import DynamicObstacleParameters

MOVING_MARGIN = 0.03
"""Clearance kept from obstacles that move, m."""
STANDING_SPEED = 0.005
"""A commanded speed below this counts as standing, m/s. The body does not follow exactly, so this is well below
`trajectory_metrics.STANDING`, which is about the body."""
X, Y, VX, VY, GROWTH, RADIUS = range(6)
"""Columns of the reachable discs."""


class Threats(NamedTuple):
    """What a braking robot must keep clear of, and by how much.

    Attributes:
        rows: shape (n, 6), as from `reachable_discs`.
        distance: radius of the robot and margin, m.
        age: time since the scan that they are of, s.
    """

    rows: np.ndarray
    distance: float
    age: float


def reachable_discs(tracks: Tracks, parameters: DynamicObstacleParameters) -> np.ndarray:
    """The places that a braking robot must keep clear of, shape (n, 6), at the time of the tracks.

    Columns: position, m, velocity, m/s, growth of its radius, m/s, and radius, m. Hits have no radius. A track that
    counts but is not in view is a disc at its predicted position; what may come out of its occlusion is listed as well.

    Args:
        tracks: of the last scan.
        parameters: what is declared.
    """
    trusted = tracks.confirmed & tracks.settled
    known = (tracks.owner >= 0) & trusted[tracks.owner] if len(tracks) else np.zeros(len(tracks.owner), bool)
    lost = np.flatnonzero(trusted & (tracks.seen < tracks.time))
    cautious = parameters.caution * parameters.max_speed
    moving = (1.0 - parameters.caution) * tracks.velocity
    still = np.zeros(2)
    rows = [
        _rows(tracks.hits[~known], still, parameters.max_speed, 0.0),
        _rows(tracks.standing, still, parameters.max_speed, 0.0),
        _rows(tracks.occlusions, still, parameters.max_speed, 0.5 * OCCLUSION_SPACING),
        _rows(tracks.hits[known], moving[tracks.owner[known]], cautious, 0.0),
        _rows(tracks.position[lost], moving[lost], cautious, tracks.radius[lost]),
    ]
    return np.vstack(rows)


def _rows(places: np.ndarray, velocity: np.ndarray, growth: float, radius: np.ndarray | float) -> np.ndarray:
    rows = np.empty((len(places), 6))
    rows[:, :VX], rows[:, VX:GROWTH] = places, velocity
    rows[:, GROWTH], rows[:, RADIUS] = growth, radius
    return rows


def near(rows: np.ndarray, position: np.ndarray, reach: float) -> np.ndarray:
    """The reachable discs whose edge is within `reach` (m) of a place (2,)."""
    away = np.hypot(rows[:, X] - position[0], rows[:, Y] - position[1]) - rows[:, RADIUS]
    return rows[away < reach]


def stays_clear(
    pose: np.ndarray,
    twist: np.ndarray,
    desired: np.ndarray,
    hold: float,
    limits: Limits,
    reachable_discs: Threats,
    delay: float = 0.0,
) -> bool:
    """Whether no dynamic obstacle can touch the robot while it follows `desired` for `hold` seconds and then brakes.

    Args:
        pose: (x, y, yaw) of the robot in W, m and rad.
        twist: (v, omega) commanded now, m/s and rad/s.
        desired: (v, omega) to certify; what exceeds the robot's speeds is cut off.
        hold: how long it is followed, s.
        limits: of the robot.
        reachable_discs: which it must keep clear of.
        delay: how long the robot keeps `twist` before it follows `desired`, s.
    """
    return bool(stays_clear_of(*pose, *twist, *desired, hold, delay, limits, *reachable_discs))


@njit(cache=True)
def _clearance(x, y, rows, distance, time):
    """Least distance to the places that reachable discs may have reached at a time, less what the robot needs, m."""
    least = np.inf
    for k in range(len(rows)):
        dx, dy = x - rows[k, X] - rows[k, VX] * time, y - rows[k, Y] - rows[k, VY] * time
        least = min(least, math.sqrt(dx * dx + dy * dy) - rows[k, RADIUS] - rows[k, GROWTH] * time)
    return least - distance


@njit(cache=True)
def _fastest(rows):
    most = 0.0
    for k in range(len(rows)):
        most = max(most, math.hypot(rows[k, VX], rows[k, VY]) + rows[k, GROWTH])
    return most


@njit(cache=True)
def stays_clear_of(x, y, yaw, v, omega, want_v, want_omega, hold, delay, limits, rows, distance, age):
    """`stays_clear` compiled; samples are skipped while the last clearance cannot have been used up."""
    if len(rows) == 0:
        return True
    fastest = _fastest(rows)
    spare, time = 0.0, age
    motion = braking_motion(x, y, yaw, v, omega, want_v, want_omega, hold, delay, limits)
    for next_x, next_y, _, now_v, _, step, phase in motion:
        time += step
        spare -= math.hypot(next_x - x, next_y - y) + fastest * step
        stopped = phase == BRAKING and abs(now_v) < STANDING_SPEED
        if spare <= 0.0 or stopped:
            spare = _clearance(next_x, next_y, rows, distance, time)
            if spare < 0.0 and max(abs(now_v), abs(v)) >= STANDING_SPEED:
                return False
        if stopped:
            return True
        x, y, v = next_x, next_y, now_v
    return True
