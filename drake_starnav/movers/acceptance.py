"""Both certificates at once: against what stays, as the controller's parameters choose it, and against what moves."""

import numpy as np
from numba import njit

from drake_starnav.control.braking import stops_inside
from drake_starnav.control.parameters import ControllerParameters
from drake_starnav.control.point_certificate import (
    ESCAPE_CLEARANCE,
    KnownHits,
    clearance_at,
    keeps_clear,
    needed_distances,
)
from drake_starnav.movers.certificate import stays_clear_of
from drake_starnav.movers.parameters import MoverParameters
from drake_starnav.robot import RobotParameters
from drake_starnav.stars.safety import SafetyStar

NONE, BY_STAR, BY_POINTS, UNSEEN = range(4)
"""Which certificate holds against what stays; none accepts anything while nothing was seen."""


def standards(
    star: SafetyStar, controller: ControllerParameters, robot: RobotParameters, movers: MoverParameters
) -> tuple:
    """What the certificates hold a command against, as `accepted` takes it.

    Args:
        star: what the last scans certify.
        controller, robot, movers: parameters.
    """
    if not controller.certificate:
        kind = NONE
    elif not star.seen:
        kind = UNSEEN
    else:
        kind = BY_STAR if controller.certified_by == "star" else BY_POINTS
    numbers = np.array(
        (
            1.0 / controller.rate,
            controller.delay,
            controller.safety_margin,
            controller.margin_per_speed,
            robot.radius + movers.margin,
            star.reach - robot.radius,
        )
    )
    needed = needed_distances(star.half_gaps, robot.radius)
    return kind, numbers, star.center, star.bearing_0, star.values, star.hits, needed


@njit(cache=True)
def accepted(x, y, yaw, v, omega, want_v, want_omega, limits, standard, rows, age):
    """Whether both certificates accept a twist; `rows` as from `threats`, `age` of the scan that they are of, s."""
    hold, delay, distance = standard[1][0], standard[1][1], standard[1][4]
    return stays_clear_of(
        x, y, yaw, v, omega, want_v, want_omega, hold, delay, limits, rows, distance, age
    ) and stops_clear(x, y, yaw, v, omega, want_v, want_omega, limits, standard)


@njit(cache=True)
def stops_clear(x, y, yaw, v, omega, want_v, want_omega, limits, standard):
    """Whether a twist passes the certificate against what stays.

    A robot that is outside of the safety star, next to a wall, must not come nearer to any hit than it is now.
    """
    kind, numbers, center, bearing_0, values, hits, needed = standard
    hold, delay, margin, per_speed, room = numbers[0], numbers[1], numbers[2], numbers[3], numbers[5]
    if kind in (NONE, UNSEEN):
        return kind == NONE
    if kind == BY_STAR and stops_inside(
        x, y, yaw, v, omega, want_v, want_omega, hold, delay, limits, center, bearing_0, values
    ):
        return True
    enough = margin + per_speed * abs(want_v)
    if kind == BY_STAR:
        enough = min(enough, clearance_at(x, y, hits, needed))
    enough = max(enough, ESCAPE_CLEARANCE)
    known = KnownHits(hits, needed, center, room)
    return keeps_clear(x, y, yaw, v, omega, want_v, want_omega, hold, delay, limits, known, enough)
