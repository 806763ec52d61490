"""Whether a robot drives as it is told; if not, the likely cause."""

import numpy as np

from drake_starnav.errors import StarnavError
from drake_starnav.station.navigation_station import StationInterface
from drake_starnav.station.planar_localization import read_planar_states
from drake_starnav.station.robot_geometry import RobotModel, compute_wheel_rates, find_drive_geometry

SPAN = 2.0
"""Motion is compared with its command over two spans of this length, one after the other, s."""
EVERY = 10
"""Every tenth moment is looked at, 0.1 to 0.2 s apart: means over a span need no more."""
LEAST = np.array((0.005, 0.01))
"""Slower commands are not judged, m/s and rad/s."""


def check_drive(station: StationInterface, times: np.ndarray, states: np.ndarray, commands: np.ndarray) -> None:
    """Raise a `StarnavError` with the likely cause if the robot has not driven as it was told lately.

    Nothing is known before two spans have passed. Commands start from the speed that the robot has, so it is not
    reported for slowness, only for standing still.

    Times are of shape (n,), s; states (n, m) of the robot's model; commands twists, shape (n, k).
    """
    plant, model, base = station.plant, station.robot_model, station.robot_interface.robot.drive
    if times[-1] - times[0] < 2.0 * SPAN or base.holonomic:  # an ideal one does
        return
    first_index = np.searchsorted(times, times[-1] - 2.0 * SPAN - 1e-9, side="right")
    times, states, commands = (each[first_index::EVERY] for each in (times, states, commands))
    rates = np.array((*base.body_rates(commands.T), *read_planar_states(states, plant.num_positions(model))[:, 3:].T))
    is_later = times > times[-1] - SPAN - 1e-9
    span_means = np.array([rates[:, span].mean(axis=1) for span in (~is_later, is_later)])
    told_velocity, done_velocity = span_means[:, :2], span_means[:, 2:]
    is_judged = np.abs(told_velocity) > LEAST
    # a robot that neither drives nor turns by this much of what it was told, in both spans, does not follow
    least_share = 0.3 * (1.0 - station.scenario.drive.slip)
    follows = is_judged & (done_velocity * np.sign(told_velocity) >= least_share * np.abs(told_velocity))
    if follows.any() or not is_judged.any(axis=1).all():
        return
    (v, omega), (real_v, real_omega) = told_velocity.mean(axis=0), done_velocity.mean(axis=0)
    raise StarnavError(
        f"the robot does not follow its commands: over {2 * SPAN:g} s it was told to drive at {v:.3f} m/s and "
        f"{omega:.3f} rad/s and did so at {real_v:.3f} m/s and {real_omega:.3f} rad/s; "
        f"{_guess_cause(RobotModel(plant, station.scene_graph, model), states, rates[:2])}"
    )


def _guess_cause(robot: RobotModel, states: np.ndarray, commands: np.ndarray) -> str:
    """Why a robot in states (n, m) does not follow what it was told, (2, n), m/s and rad/s, and what is allowed."""
    asked_rate = np.abs(find_drive_geometry(robot).rates(*commands)).mean()
    rolled_rate = np.abs(states @ compute_wheel_rates(robot).T).mean()
    if rolled_rate > 0.5 * asked_rate:
        return (
            "its wheels turn, but do not move it; allowed: wheels that stand on the floor with their weight and grip it"
        )
    return (
        "its wheels do not turn; allowed: motors strong enough (limit effort of the joints), and nothing but "
        "wheels and casters on the floor"
    )
