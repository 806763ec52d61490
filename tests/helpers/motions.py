"""The simulated motion of the certificates, written plainly, and what they decide about one command."""

import numpy as np

from drake_starnav.control.braking_certificate import simulated_step, stops_inside
from drake_starnav.regions.safe_region import SafetyStar
from drake_starnav.robot import Limits


def motion(
    pose: np.ndarray, twist: np.ndarray, desired: np.ndarray, hold: float, limits: Limits, delay: float = 0.0
) -> np.ndarray:
    """Poses (x, y, yaw) until the robot stands, shape (n, 3): `twist` for the delay, then `desired`, then braking."""
    state, speeds = (*pose, *twist), np.array(limits[:2])
    poses = [state[:3]]
    while delay > 0.0:
        *state, delay = simulated_step(*state, *twist, delay, limits)
        poses.append(state[:3])
    while hold > 0.0 or abs(state[3]) > 1e-9:
        *state, hold = simulated_step(*state, *np.clip(desired, -speeds, speeds), hold, limits)
        poses.append(state[:3])
    return np.array(poses)


def certified(
    pose: np.ndarray,
    twist: np.ndarray,
    desired: np.ndarray,
    hold: float,
    limits: Limits,
    star: SafetyStar,
    delay: float = 0.0,
) -> bool:
    """Whether that motion stays inside the safety star, as the package decides it."""
    return bool(stops_inside(*pose, *twist, *desired, hold, delay, limits, star.center, star.bearing_0, star.values))


def least_clearance(poses: np.ndarray, hits: np.ndarray, needed: np.ndarray) -> float:
    """Least distance of the poses (n, 3) to the hits (m, 2), less what each needs (m,), m."""
    return float((np.hypot(*np.moveaxis(poses[:, None, :2] - hits, -1, 0)) - needed).min())
