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

Obstacles that are declared to brake are left the room for it as well: the radius of each place is greater by their
stopping distance, so that whoever begins to brake in time never meets the robot, be it driving or standing
(passive-friendly safety).

Near to what creeps the robot may make way: a motion that comes no nearer to the places than standing would is accepted
with ESCAPE less of the margin.

Convex surfaces wider than 2 max_radius are static (`surfaces`). No certificate prevents an obstacle from hitting the
robot while it stands.
"""

import math
from typing import NamedTuple

import numpy as np
from numba import njit

from drake_starnav.control.inputs import TrackedObstacles
from drake_starnav.control.motion import Actuation, Motion
from drake_starnav.tracking.kalman_tracks import Tracks
from drake_starnav.tracking.parameters import DynamicObstacleParameters
from drake_starnav.tracking.prediction import OCCLUSION_SPACING

MOVING_MARGIN = 0.03
"""Clearance kept from obstacles that move, m."""
ESCAPE = 0.02
"""As far into that clearance may come what moves the robot no nearer to them than standing would, m: it makes way."""
STANDING_SPEED = 0.005
"""A commanded speed below this counts as standing, m/s. The body does not follow exactly, so this is well below
`trajectory.STANDING`, which is about the body."""
X, Y, VX, VY, GROWTH, RADIUS = range(6)
"""Columns of the reachable discs."""


class MovingCertificate(NamedTuple):
    """Accepts motions during which no moving obstacle can touch the robot while it drives.

    Attributes:
        discs: shape (n, 6), as from `reachable_discs`.
        distance: radius of the robot and margin, m.
        age: time since the scan that they are of, s.
        escape: how much less than that distance is enough where standing would keep no more, m.
    """

    discs: np.ndarray
    distance: float
    age: float
    escape: float = 0.0

    @staticmethod
    def near(tracked: TrackedObstacles, position: np.ndarray, actuation: Actuation) -> "MovingCertificate":
        """Of what may come near a robot at a place, shape (2,), W, m, before it has stopped."""
        tracks, age, obstacles = tracked
        limits, distance = actuation.limits, actuation.footprint.radius + MOVING_MARGIN
        longest = age + actuation.delay + actuation.hold + limits.max_speed / limits.max_acceleration
        reach = distance + (limits.max_speed + obstacles.max_speed) * longest
        return MovingCertificate(within(reachable_discs(tracks, obstacles), position, reach), distance, age, ESCAPE)

    def accepts(self, motion: Motion) -> bool:
        """Whether the robot stands, or keeps its distance, wherever the discs go until it has stopped."""
        return _stays_clear(motion.position, motion.twist[:, 0], motion.time, motion.braking, *self)


def reachable_discs(tracks: Tracks, parameters: DynamicObstacleParameters) -> np.ndarray:
    """The places that a braking robot must keep clear of, shape (n, 6), at the time of the tracks.

    Columns: position, m, velocity, m/s, growth of its radius, m/s, and radius, m, with the room to brake. Hits have no
    radius of their own. A track that counts but is not in view is a disc at its predicted position; what may come out
    of its occlusion is listed as well.

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
    discs = np.vstack(rows)
    discs[:, RADIUS] += parameters.stopping_distance
    return discs


def _rows(places: np.ndarray, velocity: np.ndarray, growth: float, radius: np.ndarray | float) -> np.ndarray:
    rows = np.empty((len(places), 6))
    rows[:, :VX], rows[:, VX:GROWTH] = places, velocity
    rows[:, GROWTH], rows[:, RADIUS] = growth, radius
    return rows


def within(discs: np.ndarray, position: np.ndarray, reach: float) -> np.ndarray:
    """The reachable discs whose edge is within `reach` (m) of a place (2,)."""
    away = np.hypot(discs[:, X] - position[0], discs[:, Y] - position[1]) - discs[:, RADIUS]
    return discs[away < reach]


@njit(cache=True)
def _clearance(x, y, discs, distance, time):
    """Least distance to the places that reachable discs may have reached at a time, less what the robot needs, m."""
    least = np.inf
    for k in range(len(discs)):
        dx, dy = x - discs[k, X] - discs[k, VX] * time, y - discs[k, Y] - discs[k, VY] * time
        least = min(least, math.sqrt(dx * dx + dy * dy) - discs[k, RADIUS] - discs[k, GROWTH] * time)
    return least - distance


@njit(cache=True)
def _stays_clear(position, speed, time, braking, discs, distance, age, escape):
    """Whether places (n, 2) of a robot with these speeds (n,) at these times (n,) stay clear of the discs.

    By `distance`; by up to `escape` less where they are no nearer to them than the first place is by then. Places are
    skipped while the last clearance cannot have been used up.
    """
    fastest = spare = 0.0
    for k in range(len(discs)):
        fastest = max(fastest, math.hypot(discs[k, VX], discs[k, VY]) + discs[k, GROWTH])
    for k in range(1, len(position)):
        x, y = position[k]
        spare -= math.hypot(x - position[k - 1, 0], y - position[k - 1, 1]) + fastest * (time[k] - time[k - 1])
        stopped = k >= braking and abs(speed[k]) < STANDING_SPEED
        if spare <= 0.0:
            spare = _clearance(x, y, discs, distance, age + time[k])
            if spare < 0.0 and max(abs(speed[k]), abs(speed[k - 1])) >= STANDING_SPEED:
                stood = _clearance(position[0, 0], position[0, 1], discs, distance, age + time[k])
                if spare < max(stood, -escape):
                    return False
        if stopped:
            return True
    return True
