"""Whether a robot drives as it is told; if not, the likely cause."""

import numpy as np

from drake_starnav.errors import StarnavError
from drake_starnav.station.navigation_station import NavigationStation, Station
from drake_starnav.station.planar_localization import planar_states
from drake_starnav.station.robot_interface import RobotInterface
from drake_starnav.station.robot_model import drive_geometry, wheel_rates

SPAN = 2.0
"""Motion is compared with its command over two spans of this length, one after the other, s."""
SHARE = 0.3
"""A robot that neither drives nor turns by this much of what it was told, in both, does not follow its commands."""
LEAST = np.array((0.005, 0.01))
"""Slower commands are not judged, m/s and rad/s."""


def check_drive(
    station: NavigationStation | Station | RobotInterface,
    states: np.ndarray,
    commands: np.ndarray,
    *,
    log_period: float,
    slip: float = 0.0,
) -> None:
    """Raise a `StarnavError` with the likely cause if the robot has not driven as it was told lately.

    Nothing is known before two spans have passed. Commands start from the speed that the robot has, so it is not
    reported for being slow, but for not moving.

    Args:
        station: with the robot.
        states: of the robot's model, shape (n, m), in steps of `log_period`.
        commands: (v, omega) at the same times, shape (n, 2), m/s and rad/s.
        log_period: s.
        slip: share of the speed that the wheels are declared to lose.
    """
    plant, model, count = station.plant, station.robot_model, round(SPAN / log_period)
    if len(states) < 2 * count:
        return
    states, commands = states[-2 * count :], commands[-2 * count :]
    twists = planar_states(states, plant.num_positions(model))[:, 3:]
    told, done = (each.reshape(2, count, 2).mean(axis=1) for each in (commands, twists))
    judged = np.abs(told) > LEAST
    follows = judged & (done * np.sign(told) >= SHARE * (1.0 - slip) * np.abs(told))
    if follows.any() or not judged.any(axis=1).all():
        return
    drive = drive_geometry(plant, station.scene_graph, model)
    asked = np.abs(commands @ np.array(((1.0, 1.0), (-0.5 * drive["track"], 0.5 * drive["track"])))).mean()
    rolled = drive["wheel_radius"] * np.abs(states @ wheel_rates(plant, model).T).mean()
    cause = (
        "its wheels turn, but do not move it; allowed: wheels that stand on the floor with their weight and grip it"
        if rolled > 0.5 * asked
        else "its wheels do not turn; allowed: motors strong enough (limit effort of the joints), and nothing but "
        "wheels and casters on the floor"
    )
    (v, omega), (real_v, real_omega) = told.mean(axis=0), done.mean(axis=0)
    raise StarnavError(
        f"the robot does not follow its commands: over {2 * SPAN:g} s it was told to drive at {v:.3f} m/s and "
        f"{omega:.3f} rad/s and did so at {real_v:.3f} m/s and {real_omega:.3f} rad/s; {cause}"
    )
