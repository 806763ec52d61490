"""Section IV: "a PID controller is employed to control the robot". Neither gains nor speeds are printed."""

import math

import numpy as np

from drake_starnav.paper import choices
from drake_starnav.robot import Limits
from drake_starnav.robot.limits import Velocity, compute_stopping_speed, find_velocity_towards, limit_value, wrap_angle


def turn_towards(vector: np.ndarray, yaw: float, clearance: float, limits: Limits) -> Velocity:
    """Line 22 of Algorithm 1: u = (v, omega), v = V cos^3(error), omega in proportion to the error.

    Replaced: the turning law of our controllers; the length of the vector does not count. V is `SPEED`, or that from
    which the robot stops within its clearance (m), as the vector turns at once where p_n changes sides, and it cannot.
    """
    error = wrap_angle(math.atan2(vector[1], vector[0]) - yaw)
    near_speed = max(choices.CREEP, compute_stopping_speed(max(clearance, 0.0), limits.max_deceleration))
    return Velocity(*find_velocity_towards(error, min(choices.SPEED, near_speed, limits.max_speed), limits))


def follow_authors_pid(vector: np.ndarray, yaw: float, clearance: float, limits: Limits) -> Velocity:
    """Line 22 by the gains of the authors' code: v = 0.5 (v_ref - v), omega = 2 error, v_ref = min(1, 0.5 / |error|).

    At its fixed point, v = v_ref / 3, without the differential parts, for which a controller would need a state.
    """
    error = wrap_angle(math.atan2(vector[1], vector[0]) - yaw)
    reference = min(1.0, 0.5 / max(abs(error), 1e-9))
    return Velocity(min(reference / 3.0, limits.max_speed), 0.0, limit_value(2.0 * error, limits.max_yaw_rate))


follow_vector = turn_towards
"""The low-level controller that is used; see `choices.FOLLOW_VECTOR`."""
