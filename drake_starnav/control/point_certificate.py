"""The braking certificate against points: as `braking_certificate`, but with every hit at every sample of the motion.

The safety star requires that the robot's centre stays in line of sight of where the last scan was taken; a motion along
a curved gap between obstacles may be safe without it. Here a motion passes if the robot's disc keeps a margin to each
hit of the last scans along the whole motion. The area that the disc sweeps must therefore have been visible in one of
those scans, which adds to the assumptions of `braking_certificate`
 (5) every obstacle in the way of the motion (at most one period of driving and one braking distance long) was hit by
     one of the remembered scans.
The range within which the last scan's hits are known is no assumption: everything beyond it counts as an obstacle.
The margin grows with the speed, which leaves room for the tracking error of a fast robot's wheels. Between two samples,
s apart, the clearance of a disc of radius R dips by less than s^2/(8 R): 0.04 mm for the smallest robots of interest.
"""

import math
from typing import NamedTuple

import numpy as np
from numba import njit

from drake_starnav.control.braking_certificate import AT_REST, BRAKING, DELAYED, SPEED_SHARES, braking_motion
from drake_starnav.control.heading_controller import slides, wrapped_angle
from drake_starnav.control.parameters import ControllerParameters
from drake_starnav.regions.safe_region import SafetyStar
from drake_starnav.robot import RobotParameters

LATTICE_SPEEDS = np.array([0.3, 0.15, 0.0])
"""Speeds that are tried if no share of the desired one passes, as shares of the largest."""
LATTICE_TURNS = np.array([-1.0, -0.5, -0.25, 0.0, 0.25, 0.5, 1.0])
"""Turning rates that are tried with each of them, as shares of the largest."""
LATTICE_TIME = 0.15
"""A twist of the lattice is judged by where it leads when held this long, s."""
TURN_WORTH = 0.3
"""A radian of heading error counts as much as this distance, m."""
SLOW_ENOUGH = 0.05
"""A robot faster than this, m/s, neither turns without a certificate nor tries an escape."""
STOPS_AT_ONCE = 0.00125
"""Nor does one that needs a longer distance than this to stop, m."""
ESCAPE_SPEED = 0.1
"""Speed of the moves out of a place where only standing still is certified, as a share of the largest."""
ESCAPE_TURNS = np.array([0.0, 0.25, -0.25, 0.125, -0.125])
"""Turning rates of such moves, as shares of the largest."""
ESCAPE_TIME = 0.1
"""How long such a move is held, s."""
ESCAPE_SLACK = 0.003
"""During such a move the robot may come this much nearer to a hit, m."""
ESCAPE_CLEARANCE = 0.002
"""A move that begins within the margin may come no nearer than this, m."""
ESCAPE_GAIN = 0.001
"""At its end such a move must have gained this much clearance, m."""


class KnownHits(NamedTuple):
    """The obstacles that a motion must stay clear of, as compiled functions take them.

    Attributes:
        hits: shape (n, 2), W, m.
        needed: shape (n,), how far the robot's centre must stay from each, m; see `needed_distances`.
        center: shape (2,), W, m.
        room: within this distance of `center` the robot is clear of everything beyond the known hits, m.
    """

    hits: np.ndarray
    needed: np.ndarray
    center: np.ndarray
    room: float


def needed_distances(half_gaps: np.ndarray, radius: float) -> np.ndarray:
    """How far the centre of a disc must stay from each hit to stay off the surface between hits, shape (n,), m.

    Args:
        half_gaps: shape (n,), half the chord to the neighbouring hit on the same surface, m.
        radius: of the disc, m.
    """
    return np.sqrt(radius * radius + half_gaps * half_gaps)


def clear_twist(
    pose: np.ndarray,
    twist: np.ndarray,
    desired: np.ndarray,
    direction: np.ndarray,
    star: SafetyStar,
    parameters: ControllerParameters,
    robot: RobotParameters,
) -> tuple[float, float, bool]:
    """A certified twist: the desired one, slower if need be, or else the one that leads farthest along `direction`.

    Tried in this order: the desired turning rate with shares of the desired speed; a lattice of slow twists, by
    progress less heading error; small moves that gain clearance, if the robot stands and is hemmed in.

    Args:
        pose: (x, y, yaw) of the robot in W, m and rad.
        twist: (v, omega) commanded now, m/s and rad/s.
        desired: (v, omega).
        direction: guiding vector, shape (2,), W; zero when there is nowhere to go.
        star: hits of the last scans.
        parameters: rate, delay, safety_margin, margin_per_speed.
        robot: its size and limits.

    Returns:
        v (m/s), omega (rad/s), and whether any motion was certified; if not, the twist brakes.
    """
    if not star.seen:
        return 0.0, 0.0, False
    limits = robot.limits
    hold = 1.0 / parameters.rate
    near = _hits_within_reach(pose, twist, desired, star, parameters, robot)
    return _clear_twist(
        (*pose, *twist),
        *desired,
        *direction,
        hold,
        parameters.delay,
        limits,
        KnownHits(*near, star.center, star.reach - robot.radius),
        parameters.safety_margin,
        parameters.margin_per_speed,
    )


def _hits_within_reach(
    pose: np.ndarray,
    twist: np.ndarray,
    desired: np.ndarray,
    star: SafetyStar,
    parameters: ControllerParameters,
    robot: RobotParameters,
) -> tuple[np.ndarray, np.ndarray]:
    """The hits that any motion tried could touch, and what distance each needs."""
    hold, limits, radius = 1.0 / parameters.rate + parameters.delay, robot.limits, robot.radius
    slow = max(LATTICE_SPEEDS.max(), ESCAPE_SPEED) * limits.max_speed
    fastest = min(max(abs(twist[0]), abs(desired[0]), slow), limits.max_speed)
    longest = max(hold, LATTICE_TIME, ESCAPE_TIME + hold)
    reach = radius + parameters.safety_margin + parameters.margin_per_speed * fastest
    reach += fastest * longest + 0.5 * fastest * fastest / limits.max_acceleration + 0.02
    return _near(star.hits, needed_distances(star.half_gaps, radius), pose[0], pose[1], reach, radius)


@njit(cache=True)
def _near(hits, needed, x, y, reach, radius):
    near = np.empty((len(hits), 2))
    distance = np.empty(len(hits))
    n = 0
    for k in range(len(hits)):
        dx, dy = hits[k, 0] - x, hits[k, 1] - y
        limit = reach + needed[k] - radius
        if dx * dx + dy * dy < limit * limit:
            near[n, 0], near[n, 1] = hits[k, 0], hits[k, 1]
            distance[n] = needed[k]
            n += 1
    return near[:n].copy(), distance[:n].copy()


@njit(cache=True)
def clearance_at(x, y, hits, needed):
    """Least distance to a hit beyond what it needs, m; infinite without hits."""
    least = np.inf
    for k in range(len(hits)):
        dx, dy = hits[k, 0] - x, hits[k, 1] - y
        least = min(least, math.sqrt(dx * dx + dy * dy) - needed[k])
    return least


@njit(cache=True)
def keeps_clear(x, y, yaw, v, omega, want_v, want_omega, hold, delay, limits, known, enough):
    """Whether a twist, held for `hold` seconds after the delay and followed by full braking, keeps a clearance, m.

    Everything beyond the known hits counts as an obstacle. A sample is skipped while the robot cannot have used up the
    clearance beyond `enough` that the last checked sample had.
    """
    spare = _known_clearance(x, y, known) - enough
    if spare < 0.0:
        return False
    motion = braking_motion(x, y, yaw, v, omega, want_v, want_omega, hold, delay, limits)
    for next_x, next_y, _, now_v, now_omega, _, phase in motion:
        if phase != DELAYED and slides(now_v, now_omega, limits):
            return False
        spare -= math.hypot(next_x - x, next_y - y)
        x, y = next_x, next_y
        stopped = phase == BRAKING and abs(now_v) < AT_REST
        if spare <= 0.0 or stopped:
            clearance = _known_clearance(x, y, known)
            if stopped or clearance < enough:
                return clearance >= enough
            spare = clearance - enough
    return True


@njit(cache=True)
def _known_clearance(x, y, known):
    """Clearance to the known hits and to what lies beyond them, m."""
    off_the_unknown = known.room - math.hypot(x - known.center[0], y - known.center[1])
    return min(clearance_at(x, y, known.hits, known.needed), off_the_unknown)


@njit(cache=True)
def _end(x, y, yaw, v, omega, want_v, want_omega, hold, limits):
    """Pose after holding a twist and braking fully."""
    for px, py, heading, _, _, _, _ in braking_motion(x, y, yaw, v, omega, want_v, want_omega, hold, 0.0, limits):
        x, y, yaw = px, py, heading
    return x, y, yaw


@njit(cache=True)
def _clear_twist(state, want_v, want_omega, ux, uy, hold, delay, limits, known, margin, per_speed):
    """`clear_twist` compiled; `state` is (x, y, yaw, v, omega)."""
    v, omega, found = _slower(state, want_v, want_omega, hold, delay, limits, known, margin, per_speed)
    if found:
        return v, omega, True
    standing = abs(state[3]) < min(SLOW_ENOUGH, math.sqrt(2.0 * limits.max_acceleration * STOPS_AT_ONCE))
    if ux * ux + uy * uy > 0.25:
        v, omega, found = _best_of_lattice(state, want_v, ux, uy, hold, delay, limits, known, margin, per_speed)
        if standing and v == 0.0 and omega == 0.0:
            back, turning, escaped = _escape(state, ux, uy, hold, delay, limits, known, margin)
            if escaped:
                return back, turning, True
        if found:
            return v, omega, True
    return 0.0, want_omega if standing else 0.0, False


@njit(cache=True)
def _slower(state, want_v, want_omega, hold, delay, limits, known, margin, per_speed):
    """The largest share of the desired speed that passes with the desired turning rate, and whether there is one."""
    for share in SPEED_SHARES[:-1]:  # the lattice tries zero speed
        v = want_v * share
        if keeps_clear(*state, v, want_omega, hold, delay, limits, known, margin + per_speed * abs(v)):
            return v, want_omega, True
    return 0.0, 0.0, False


@njit(cache=True)
def _best_of_lattice(state, want_v, ux, uy, hold, delay, limits, known, margin, per_speed):
    """The slow twist that leads farthest along (ux, uy), less its heading error, and whether any passes."""
    heading = math.atan2(uy, ux)
    best, best_v, best_omega = -np.inf, 0.0, 0.0
    for speed in LATTICE_SPEEDS:
        for turn in LATTICE_TURNS:
            v, omega = min(speed * limits.max_speed, want_v), turn * limits.max_yaw_rate
            x, y, yaw = _end(*state, v, omega, LATTICE_TIME, limits)
            error = abs(wrapped_angle(heading - yaw))
            worth = (x - state[0]) * ux + (y - state[1]) * uy - TURN_WORTH * error
            if worth > best and keeps_clear(*state, v, omega, hold, delay, limits, known, margin + per_speed * v):
                best, best_v, best_omega = worth, v, omega
    return best_v, best_omega, best > -np.inf


@njit(cache=True)
def _escape(state, ux, uy, hold, delay, limits, known, margin):
    """The small move, forwards or backwards, that gains most clearance and way along (ux, uy), and whether any does."""
    now = clearance_at(state[0], state[1], known.hits, known.needed)
    enough = max(min(now, margin) - ESCAPE_SLACK, ESCAPE_CLEARANCE)
    held = max(hold, ESCAPE_TIME)
    best, best_v, best_omega = -np.inf, 0.0, 0.0
    for sign in (1.0, -1.0):
        for turn in ESCAPE_TURNS:
            v, omega = sign * ESCAPE_SPEED * limits.max_speed, turn * limits.max_yaw_rate
            if not keeps_clear(*state, v, omega, held, delay, limits, known, enough):
                continue
            x, y, _ = _end(*state, v, omega, held, limits)
            then = clearance_at(x, y, known.hits, known.needed)
            worth = (x - state[0]) * ux + (y - state[1]) * uy + then
            if then >= now + ESCAPE_GAIN and worth > best:
                best, best_v, best_omega = worth, v, omega
    return best_v, best_omega, best > -np.inf
