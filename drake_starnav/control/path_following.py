"""From guidance to a twist of the differential drive: the controller as a pure step."""

import math

import numpy as np

from drake_starnav.control.braking_certificate import certified_twist
from drake_starnav.control.free_heading import free_heading
from drake_starnav.control.heading_controller import CREEP_SPEED, limited_twist, turning_law, wrapped_angle
from drake_starnav.control.law import Command, ControlInput
from drake_starnav.control.modulation import (
    limited_turn,
    modulated_direction,
    near_wall_direction,
    nearest_point_direction,
)
from drake_starnav.control.parameters import ControllerParameters
from drake_starnav.planning.guidance import PASSED_DISTANCE
from drake_starnav.regions.star_region import LINE_STEP, RegionStack, segment_covered
from drake_starnav.robot import RobotParameters

GOAL_REACHED = 0.02
"""A robot this near to its final goal stops, m."""
LOOK_AHEAD_SPARE = 0.004
"""A look-ahead line keeps this much more clearance than the certificate requires of a standing robot, m."""
LEAST_SHARE = 0.8
"""At the certificate's boundary the near-wall term has at least this share: every guiding vector leads off the wall."""
TURNING_TIMES = 2.0
"""The push off a wall leads no farther aside than across the near-wall zone in so many times 1 / heading_gain, in which
the robot turns back; otherwise it would oscillate between the walls of a narrow passage."""
PID = {"kp_v": 0.5, "kd_v": 0.05, "kp_w": 2.0, "kd_w": 0.05}
"""The paper's gains."""


def guiding_vector(
    position: np.ndarray,
    path: np.ndarray,
    regions: RegionStack,
    hits: np.ndarray,
    parameters: ControllerParameters,
    robot_radius: float,
    speed: float = 0.0,
) -> tuple[np.ndarray, float]:
    """Unit vector to follow, shape (2,), W, and the distance to the short-term goal, m.

    Args:
        position: of the robot, shape (2,), W, m.
        path: shape (k, 2), way points ahead, W, m.
        regions: around the robot.
        hits: close to the robot, shape (n, 2), W, m.
        parameters: modulation, near-wall and nearest-point terms.
        robot_radius: m.
        speed: of the robot, m/s.
    """
    ahead = path[0]
    for ahead in path:
        offset = ahead - position
        distance = math.hypot(offset[0], offset[1])
        if distance > PASSED_DISTANCE:
            break
    if distance < 1e-6:
        return np.zeros(2), 0.0
    guide = offset / distance
    direction = guide
    if parameters.modulation and distance > parameters.modulation_distance:
        direction = modulated_direction(position, guide, regions, parameters)
        limited = limited_turn(guide, direction, parameters.max_bend)
        if limited is not direction and segment_covered(*regions.arrays, *position, *ahead, LINE_STEP):
            direction = limited
    if parameters.nearest_point_term != "none":
        rho, away = parameters.nearest_point_distance, parameters.nearest_point_term == "away"
        direction = nearest_point_direction(position, direction, guide, hits, robot_radius, rho, away)
    if parameters.near_wall_term:
        zone = parameters.near_wall_zone
        push = zone / max(TURNING_TIMES / parameters.heading_gain * abs(speed), zone)
        radius = near_wall_radius(parameters, robot_radius)
        direction = near_wall_direction(position, direction, hits, radius, zone, push)
    return direction, distance


def near_wall_radius(parameters: ControllerParameters, robot_radius: float) -> float:
    """The radius that clearance in the near-wall zone is measured from, m.

    Without the excess, a safety margin as wide as the zone would stop the robot before the term leads it away.
    """
    return robot_radius + max(parameters.safety_margin - (1.0 - LEAST_SHARE) * parameters.near_wall_zone, 0.0)


def control_step(now: ControlInput, parameters: ControllerParameters, robot: RobotParameters) -> Command:
    """One period of the controller: guiding vector, twist, certificate, ramp.

    Args:
        now: what it is given.
        parameters: of the controller.
        robot: its size and limits.
    """
    pose, twist, _, _, star = now
    direction, desired, errors = desired_twist(now, parameters, robot)
    period = 1.0 / parameters.rate
    accepted = True
    if parameters.certificate:
        v, omega, accepted = certified_twist(pose, twist, desired, period, robot.limits, star, parameters.delay)
        desired = np.array((v, omega))
    return Command(limited_twist(twist, desired, robot, period), direction, accepted, errors)


def desired_twist(
    now: ControlInput, parameters: ControllerParameters, robot: RobotParameters
) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Guiding vector, the twist that follows it before anything is certified, and the errors for the next period.

    Arguments as for `control_step`.
    """
    pose, twist, errors, guidance, star = now
    direction, distance = np.zeros(2), 0.0
    desired = np.zeros(2)
    path = guidance.path if guidance.distance_to_goal(pose[:2]) > GOAL_REACHED else guidance.path[:0]
    last = len(path) == 1
    if len(path):
        direction, distance = guiding_vector(
            pose[:2], path, guidance.regions, star.near_hits, parameters, robot.radius, robot.max_speed
        )
    if direction.any():
        if parameters.certificate:
            direction = free_heading(pose[:2], direction, star, parameters.free_heading_range)
        heading = wrapped_angle(math.atan2(direction[1], direction[0]) - pose[2])
        stop_at = distance if guidance.arrives and last else math.inf
        if parameters.tracking == "law":
            desired = turning_law(heading, robot.max_speed, parameters, robot)
            slowest = parameters.goal_slowdown * stop_at + CREEP_SPEED
            desired[0] = min(desired[0], robot.max_speed, slowest)
        else:
            desired, errors = _pid(heading, twist, errors, 1.0 / parameters.rate)
    return direction, desired, errors


def _pid(heading: float, twist: np.ndarray, errors: np.ndarray, period: float) -> tuple[np.ndarray, np.ndarray]:
    """The paper's low-level controller, u = kp e + kd de/dt, with v_ref = min(1, 0.5 / |heading error|).

    Without an integral term the speed settles at v_ref kp / (1 + kp), a third of v_ref.

    Source: paper, section IV; gains of its authors.
    """
    reference = min(1.0, 0.5 / max(abs(heading), 1e-6))
    error = np.array((reference - twist[0], heading))
    rate = (error - errors) / period
    v = PID["kp_v"] * error[0] + PID["kd_v"] * rate[0]
    omega = PID["kp_w"] * error[1] + PID["kd_w"] * rate[1]
    return np.array((v, omega)), error
