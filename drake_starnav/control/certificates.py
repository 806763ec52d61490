"""Both certificates at once, against static obstacles and dynamic ones, and the twists that are proposed to them."""

from typing import NamedTuple

import numpy as np
from numba import njit

from drake_starnav.control.braking_certificate import STOPPED_DISTANCE, stops_inside
from drake_starnav.control.moving_certificate import MOVING_MARGIN, stays_clear_of
from drake_starnav.control.parameters import ControllerParameters
from drake_starnav.control.point_certificate import (
    ESCAPE_CLEARANCE,
    KnownHits,
    clearance_at,
    keeps_clear,
    needed_distances,
)
from drake_starnav.regions.safe_region import SafetyStar
from drake_starnav.robot import Limits, RobotParameters

PROPOSALS = np.array(
    [(speed, 1.0) for speed in (1.0, 0.8, 0.6, 0.4, 0.25, 0.1, 0.0)]
    + [(speed, turn) for turn in (0.5, 0.0, -0.5) for speed in (0.5, 0.0)]
)
"""Shares of the desired speed and turning rate that are tried, in this order."""


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


def constraints_of(star: SafetyStar, controller: ControllerParameters, robot: RobotParameters) -> Constraints:
    """The constraints that the parameters ask for, with what the last scans certify."""
    needed = needed_distances(star.half_gaps, robot.radius)
    return Constraints(
        seen=bool(star.seen),
        hold=1.0 / controller.rate,
        delay=float(controller.delay),
        margin=float(controller.safety_margin),
        distance=float(robot.radius + MOVING_MARGIN),
        center=star.center,
        bearing_0=star.bearing_0,
        values=star.values,
        hits=KnownHits(star.hits, needed, star.center, float(star.reach - robot.radius)),
    )


def certified_twist(
    pose: np.ndarray,
    twist: np.ndarray,
    desired: np.ndarray,
    hold: float,
    limits: Limits,
    star: SafetyStar,
    delay: float = 0.0,
) -> tuple[float, float, bool]:
    """The first of PROPOSALS from which the robot stops inside the safety star.

    Args:
        pose: (x, y, yaw) of the robot in W, m and rad.
        twist: (v, omega) commanded now, m/s and rad/s.
        desired: (v, omega) to certify; what exceeds the robot's speeds is cut off.
        hold: how long it is followed before the robot brakes, s.
        limits: of the robot.
        star: what the last scans certify.
        delay: how long the robot keeps `twist` before it follows `desired`, s.

    Returns:
        v (m/s), omega (rad/s), and whether any motion was certified; if not, the twist brakes.
    """
    known = star.center, star.bearing_0, star.values
    return safe_twist(*pose, *twist, *desired, hold, delay, limits, known)


@njit(cache=True)
def safe_twist(x, y, yaw, v, omega, want_v, want_omega, hold, delay, limits, star):
    """`certified_twist`, compiled; `star` is (center, bearing_0, values)."""
    proposed = np.empty(PROPOSALS.shape)
    for k in range(len(PROPOSALS)):
        proposed[k, 0], proposed[k, 1] = PROPOSALS[k, 0] * want_v, PROPOSALS[k, 1] * want_omega
    k = first_inside(x, y, yaw, v, omega, proposed, hold, delay, limits, star)
    if k >= 0:
        return proposed[k, 0], proposed[k, 1], True
    standing = v * v <= 2.0 * limits.max_acceleration * STOPPED_DISTANCE
    return 0.0, want_omega if standing else 0.0, False


@njit(cache=True)
def first_inside(x, y, yaw, v, omega, twists, hold, delay, limits, star):
    """Index of the first of some twists (n, 2) from which the robot stops inside the safety star, or -1."""
    center, bearing_0, values = star
    for k in range(len(twists)):
        if stops_inside(
            x, y, yaw, v, omega, twists[k, 0], twists[k, 1], hold, delay, limits, center, bearing_0, values
        ):
            return k
    return -1


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
