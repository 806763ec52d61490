"""The braking certificate: a twist is sent only if the robot can still stop within observed free space.

Guarantee. If a command is accepted, and the robot keeps its last twist for a declared delay, follows the command for
one control period and then brakes as hard as its limits allow in both speed and turning rate, then no point of that
motion brings a static obstacle that the scans have hit nearer to the robot's centre than its radius, provided that
 (1) the world is static,
 (2) the sensing and localisation error, plus half the distance between two samples of the simulated motion (at most
     SAMPLE_SPACING / 2), is at most the safety margin,
 (3) the robot keeps the simulated accelerations, and starts from the twist that was last commanded,
 (4) a command takes effect after the declared delay, which is at most one control period.
To keep (3), a motion in which the wheels would slide is not accepted; see `slides`.
If nothing can be certified, the command is to brake: the robot then follows the remainder of the last certified motion,
so by induction it never touches anything. Turning in place is always allowed at a speed from which the robot stops
within STOPPED_DISTANCE, since a disc that turns about its centre covers no new ground.
"""

import math

import numpy as np
from numba import njit

from drake_starnav.control.heading_controller import limited, ramped, slides
from drake_starnav.regions.star_region import covers
from drake_starnav.robot import Limits
from drake_starnav.utils.snapshot import snapshot

SAMPLE_SPACING = 0.008
"""Largest distance between two samples of the simulated motion, m."""
LONGEST_STEP = 0.04
"""Longest time step of the simulated motion, s."""
STOPPED_DISTANCE = 0.001
"""A robot that stops within this distance counts as standing, m."""
AT_REST = 1e-9
"""A simulated speed below this is zero, m/s or rad/s."""
DELAYED, HOLDING, BRAKING = range(3)
"""Phases of the simulated motion."""


@snapshot
class Certificate:
    """What the controller guarantees about the robot's motion. Immutable.

    Attributes:
        certified: whether the last command passed the braking certificate; if not, it brakes.
        path: shape (n, 3), (x, y, yaw) in W of the robot braking fully from now on, m and rad.
    """

    certified: bool
    path: np.ndarray

    @staticmethod
    def none() -> "Certificate":
        """Before the first command, and of controllers that guarantee nothing."""
        return Certificate(False, np.zeros((1, 3)))


def braking_path(pose: np.ndarray, twist: np.ndarray, desired: np.ndarray, hold: float, limits: Limits) -> np.ndarray:
    """The motion that the certificate checks: shape (n, 3), (x, y, yaw) in W from now until the robot stops.

    Args:
        pose: (x, y, yaw) of the robot in W, m and rad.
        twist: (v, omega) commanded now, m/s and rad/s.
        desired: (v, omega) to follow; what exceeds the robot's speeds is cut off.
        hold: how long it is followed before the robot brakes, s.
        limits: of the robot.
    """
    return _braking_path(*pose, *twist, *desired, hold, limits)


@njit(cache=True)
def simulated_step(x, y, yaw, v, omega, want_v, want_omega, left, limits):
    """One step of the simulated motion: towards the wanted twist while time is `left`, then full braking.

    A step moves the robot by at most SAMPLE_SPACING, and ends no later than the hold.
    """
    fastest = abs(v)
    if left > 0.0:
        fastest = max(fastest, abs(want_v))
    h = min(LONGEST_STEP, SAMPLE_SPACING / max(fastest, 1e-9))
    if left > 0.0:
        h = min(h, left)
        left -= h
        if left < 1e-9:
            left = 0.0
    else:
        want_v = want_omega = 0.0
    before = v
    v = ramped(v, want_v, limits.max_acceleration * h)
    omega = ramped(omega, want_omega, limits.max_yaw_acceleration * h)
    # use the faster end of the step, so that distances are never underestimated
    travelled = (before if abs(before) > abs(v) else v) * h
    middle = yaw + 0.5 * omega * h
    return x + travelled * math.cos(middle), y + travelled * math.sin(middle), yaw + omega * h, v, omega, left


@njit  # Numba cannot load a generator from its cache; the functions that use it are cached
def braking_motion(x, y, yaw, v, omega, want_v, want_omega, hold, delay, limits):
    """Yield the samples of the simulated motion after the start: delay, hold, and braking until the robot has stopped.

    Each is (x, y, yaw, v, omega, step, phase): pose and twist, the time since the last sample, and whether the robot is
    DELAYED, HOLDING its twist, or BRAKING from this sample on. While it brakes, `step` is how long the speed changes.
    """
    want_v, want_omega = limited(want_v, limits.max_speed), limited(want_omega, limits.max_yaw_rate)
    while delay > 0.0:
        left = delay
        x, y, yaw, v, omega, delay = simulated_step(x, y, yaw, v, omega, v, omega, left, limits)
        yield x, y, yaw, v, omega, left - delay, DELAYED
    while True:
        left, before = hold, v
        x, y, yaw, v, omega, hold = simulated_step(x, y, yaw, v, omega, want_v, want_omega, left, limits)
        step = left - hold if left > 0.0 else abs(before - v) / limits.max_acceleration
        yield x, y, yaw, v, omega, step, HOLDING if hold > 0.0 else BRAKING
        if hold <= 0.0 and abs(v) < AT_REST and abs(omega) < AT_REST:
            return


@njit(cache=True)
def stops_inside(x, y, yaw, v, omega, want_v, want_omega, hold, delay, limits, center, bearing_0, values):
    """Whether a twist, held for `hold` seconds after the delay and followed by full braking, stays inside the star."""
    motion = braking_motion(x, y, yaw, v, omega, want_v, want_omega, hold, delay, limits)
    for px, py, _, now_v, now_omega, _, phase in motion:
        if phase != DELAYED and slides(now_v, now_omega, limits):
            return False
        if not covers(center, bearing_0, values, px, py):
            return False
        if phase == BRAKING and abs(now_v) < AT_REST:
            return True
    return True


@njit(cache=True)
def _braking_path(x, y, yaw, v, omega, want_v, want_omega, hold, limits):
    points = [(x, y, yaw)]
    for px, py, heading, now_v, _, _, phase in braking_motion(
        x, y, yaw, v, omega, want_v, want_omega, hold, 0.0, limits
    ):
        points.append((px, py, heading))
        if phase == BRAKING and abs(now_v) < AT_REST:
            break
    return np.array(points)
