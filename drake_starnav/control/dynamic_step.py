"""The controller among obstacles that move: any law, the certificate in time behind it, and evasion before it."""

from collections.abc import Callable

import numpy as np

from drake_starnav.control.avoidance import encounter
from drake_starnav.control.braking_certificate import SPEED_SHARES, TURN_SHARES
from drake_starnav.control.certificates import first_accepted, standards
from drake_starnav.control.heading_controller import limited_twist
from drake_starnav.control.moving_certificate import STANDING_SPEED, near, stays_clear, threats
from drake_starnav.control.parameters import ControllerParameters
from drake_starnav.control.path_following import Command
from drake_starnav.planning.guidance import Guidance
from drake_starnav.regions.safe_region import SafetyStar
from drake_starnav.robot import RobotParameters
from drake_starnav.tracking.kalman_tracks import Tracks
from drake_starnav.tracking.parameters import MoverParameters

SLOWER = np.array(
    [(share, 1.0) for share in SPEED_SHARES[1:]] + [(share, turn) for turn in TURN_SHARES for share in (0.5, 0.0)]
)
"""Shares of a twist's speed and turning rate that are tried in this order where it is refused."""


def wary_step(
    step: Callable[..., Command],
    pose: np.ndarray,
    twist: np.ndarray,
    errors: np.ndarray,
    guidance: Guidance,
    star: SafetyStar,
    parameters: ControllerParameters,
    robot: RobotParameters,
    *,
    tracks: Tracks,
    age: float,
    movers: MoverParameters,
) -> Command:
    """One period of the controller that `step` is, among obstacles that move.

    Its command is sent if no encounter is foreseen on the way along the path and the certificate in time holds. If an
    encounter is foreseen, the way on that costs least and can be certified is taken; else its command is slowed down.

    Args:
        step: `path_following.control_step` or another one with its arguments, which are the next ones here.
        tracks: of the last scan.
        age: time since then, s.
        movers: what is declared.
    """
    command = step(pose, twist, errors, guidance, star, parameters, robot)
    rows = threats(tracks, movers)
    if not len(rows) and not tracks.counted.any():
        return command
    limits, period = robot.limits, 1.0 / parameters.rate
    longest = age + parameters.delay + period + robot.max_speed / robot.max_acceleration
    reach = robot.radius + movers.margin + (robot.max_speed + movers.max_speed) * longest
    rows = near(rows, pose[:2], reach)

    if tracks.counted.any() or len(tracks.standing):
        met = encounter(pose, twist, guidance, star, tracks, rows, age, parameters, robot, movers)
        if met.twist is not None:
            return Command(limited_twist(twist, met.twist, robot, period), command.guiding_vector, True, command.errors)
    distance = robot.radius + movers.margin
    if stays_clear(pose, twist, command.twist, period, limits, rows, distance, age, parameters.delay):
        return command
    slower = SLOWER * command.twist
    k = first_accepted(*pose, *twist, slower, limits, standards(star, parameters, robot, movers), rows, age)
    if k >= 0:
        return Command(limited_twist(twist, slower[k], robot, period), command.guiding_vector, True, command.errors)
    standing = abs(twist[0]) < STANDING_SPEED
    braking = limited_twist(twist, np.array((0.0, command.twist[1] if standing else 0.0)), robot, period)
    return Command(braking, command.guiding_vector, standing, command.errors)
