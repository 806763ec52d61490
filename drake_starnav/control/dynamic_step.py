"""The controller among dynamic obstacles: any law, avoidance before it, and the certificate in time after it."""

import numpy as np

from drake_starnav.control.avoidance import avoid_collision
from drake_starnav.control.certificates import PROPOSALS, constraints_of, first_accepted
from drake_starnav.control.heading_controller import limited_twist
from drake_starnav.control.law import Command, ControlInput, Law, TrackedObstacles
from drake_starnav.control.moving_certificate import (
    MOVING_MARGIN,
    STANDING_SPEED,
    Threats,
    near,
    reachable_discs,
    stays_clear,
)
from drake_starnav.control.parameters import ControllerParameters
from drake_starnav.robot import RobotParameters


def dynamic_step(
    law: Law,
    now: ControlInput,
    parameters: ControllerParameters,
    robot: RobotParameters,
    tracked: TrackedObstacles,
) -> Command:
    """One period of a control law among dynamic obstacles.

    The law's command is sent if no encounter is foreseen along the path and the certificate in time holds. If an
    encounter is foreseen, the cheapest manoeuvre that can be certified is taken; else the command is slowed down.

    Args:
        law: as `path_following.control_step`.
        now: what the law is given.
        parameters: of the controller.
        robot: its size and limits.
        tracked: the dynamic obstacles.
    """
    command = law(now, parameters, robot)
    pose, twist = now.pose, now.twist
    tracks, age, obstacles = tracked
    rows = reachable_discs(tracks, obstacles)
    if not len(rows) and not tracks.confirmed.any():
        return command
    limits, period = robot.limits, 1.0 / parameters.rate
    longest = age + parameters.delay + period + robot.max_speed / robot.max_acceleration
    reach = robot.radius + MOVING_MARGIN + (robot.max_speed + obstacles.max_speed) * longest
    rows = near(rows, pose[:2], reach)

    if tracks.confirmed.any() or len(tracks.standing):
        avoidance = avoid_collision(now, tracked, rows, parameters, robot)
        if avoidance.twist is not None:
            return Command(limited_twist(twist, avoidance.twist, robot, period), command.guiding_vector, True)
    near_by = Threats(rows, robot.radius + MOVING_MARGIN, age)
    if stays_clear(pose, twist, command.twist, period, limits, near_by, parameters.delay):
        return command
    proposed = PROPOSALS * command.twist
    k = first_accepted(*pose, *twist, proposed, limits, constraints_of(now.star, parameters, robot), rows, age)
    if k >= 0:
        return Command(limited_twist(twist, proposed[k], robot, period), command.guiding_vector, True)
    standing = abs(twist[0]) < STANDING_SPEED
    braking = limited_twist(twist, np.array((0.0, command.twist[1] if standing else 0.0)), robot, period)
    return Command(braking, command.guiding_vector, standing)
