"""Both certificates at once: against static obstacles and dynamic ones."""

from typing import NamedTuple

import numpy as np
from numba import njit

from drake_starnav.control.braking_certificate import stops_inside
from drake_starnav.control.moving_certificate import stays_clear_of
from drake_starnav.control.parameters import ControllerParameters
from drake_starnav.control.point_certificate import (
    ESCAPE_CLEARANCE,
    KnownHits,
    clearance_at,
    keeps_clear,
    needed_distances,
)
from drake_starnav.regions.safe_region import SafetyStar
from drake_starnav.robot import RobotParameters
from drake_starnav.tracking.parameters import DynamicObstacleParameters


class Constraints(NamedTuple):
    """The constraints that the certificates check a command against.

    Attributes:
        seen: whether anything was seen; without, nothing is accepted.
        hold, delay: how long a command is followed, and after what time, s.
        margin: to static obstacles, m.
        distance: to dynamic obstacles, from the robot's centre, m.
        center, bearing_0, values: of the safety star.
        hits: on static obstacles.
    """

    seen: bool
    hold: float
    delay: float
    margin: float
    distance: float
    center: np.ndarray
    bearing_0: float
    values: np.ndarray
    hits: KnownHits


def constraints_of(
    star: SafetyStar, controller: ControllerParameters, robot: RobotParameters, obstacles: DynamicObstacleParameters
) -> Constraints:
    """The constraints that the parameters ask for, with what the last scans certify."""
    needed = needed_distances(star.half_gaps, robot.radius)
    return Constraints(
        seen=bool(star.seen),
        hold=1.0 / controller.rate,
        delay=float(controller.delay),
        margin=float(controller.safety_margin),
        distance=float(robot.radius + obstacles.margin),
        center=star.center,
        bearing_0=star.bearing_0,
        values=star.values,
        hits=KnownHits(star.hits, needed, star.center, float(star.reach - robot.radius)),
    )


@njit(cache=True)
def accepted(x, y, yaw, v, omega, want_v, want_omega, limits, constraints, rows, age):
    """Whether both certificates accept a twist; `rows` as from `reachable_discs`, `age` of the scan that they are of,
    s."""
    hold, delay, distance = constraints.hold, constraints.delay, constraints.distance
    return stays_clear_of(
        x, y, yaw, v, omega, want_v, want_omega, hold, delay, limits, rows, distance, age
    ) and stops_clear(x, y, yaw, v, omega, want_v, want_omega, limits, constraints)


@njit(cache=True)
def first_accepted(x, y, yaw, v, omega, twists, limits, constraints, rows, age):
    """Index of the first of some twists (n, 2) that both certificates accept, or -1; else as for `accepted`."""
    for k in range(len(twists)):
        if accepted(x, y, yaw, v, omega, twists[k, 0], twists[k, 1], limits, constraints, rows, age):
            return k
    return -1


@njit(cache=True)
def stops_clear(x, y, yaw, v, omega, want_v, want_omega, limits, constraints):
    """Whether a twist passes the certificate against static obstacles.

    A robot outside the safety star, next to a wall, must not come nearer to any hit than it is now.
    """
    if not constraints.seen:
        return False
    _, hold, delay, margin, _, center, bearing_0, values, known = constraints
    if stops_inside(x, y, yaw, v, omega, want_v, want_omega, hold, delay, limits, center, bearing_0, values):
        return True
    enough = max(min(margin, clearance_at(x, y, known.hits, known.needed)), ESCAPE_CLEARANCE)
    return keeps_clear(x, y, yaw, v, omega, want_v, want_omega, hold, delay, limits, known, enough)
