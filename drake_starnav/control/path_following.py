"""From guidance to a twist of the differential drive: the controller as a pure step."""

import math

import numpy as np

from drake_starnav.control.certificates import certified_twist
from drake_starnav.control.free_heading import free_heading
from drake_starnav.control.heading_controller import (
    CREEP_SPEED,
    GOAL_SLOWDOWN,
    HEADING_GAIN,
    limited_twist,
    turning_law,
    wrapped_angle,
)
from drake_starnav.control.law import Command, ControlInput
from drake_starnav.control.modulation import limited_turn, modulated_direction, near_wall_direction
from drake_starnav.control.parameters import ControllerParameters
from drake_starnav.planning.guidance import PASSED_DISTANCE
from drake_starnav.regions.star_region import LINE_STEP, RegionStack, segment_covered
from drake_starnav.robot import RobotParameters

GOAL_REACHED = 0.02
"""A robot this near to its final goal stops, m."""
LEAST_SHARE = 0.8
"""At the certificate's boundary the near-wall term has at least this share: every guiding vector leads off the wall."""
TURNING_TIMES = 2.0
"""The push off a wall leads no farther aside than across the near-wall zone in so many times 1 / HEADING_GAIN, in which
the robot turns back; otherwise it would oscillate between the walls of a narrow passage."""
MAX_BEND = 0.8
"""Largest turn of the guiding vector by modulation where the robot sees the way point inside the regions, rad."""
MODULATION_DISTANCE = 0.25
"""Nearer than this to the way point the guiding vector is used as it is, m: the robot would circle about it."""
NEAR_WALL_ZONE = 0.05
"""Clearance at which the push off a wall begins, m. With 0.1 m the robot is slower in narrow places."""


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
        parameters: safety margin.
        robot_radius: m.
        speed: of the robot, m/s.
    """
    ahead, guide, distance = way_point(position, path)
    if distance == 0.0:
        return guide, 0.0
    direction = guide
    if distance > MODULATION_DISTANCE:
        direction = modulated_direction(position, guide, regions)
        limited = limited_turn(guide, direction, MAX_BEND)
        if limited is not direction and segment_covered(*regions.arrays, *position, *ahead, LINE_STEP):
            direction = limited
    push = NEAR_WALL_ZONE / max(TURNING_TIMES / HEADING_GAIN * abs(speed), NEAR_WALL_ZONE)
    radius = near_wall_radius(parameters.safety_margin, robot_radius)
    return near_wall_direction(position, direction, hits, radius, NEAR_WALL_ZONE, push), distance


def way_point(position: np.ndarray, path: np.ndarray) -> tuple[np.ndarray, np.ndarray, float]:
    """The first way point not yet passed, shape (2,), the unit vector to it, shape (2,), and its distance, m.

    Vector and distance are zero at the last way point. Arguments as for `guiding_vector`.
    """
    ahead = path[0]
    for ahead in path:
        offset = ahead - position
        distance = math.hypot(offset[0], offset[1])
        if distance > PASSED_DISTANCE:
            break
    return (ahead, offset / distance, distance) if distance >= 1e-6 else (ahead, np.zeros(2), 0.0)


def near_wall_radius(safety_margin: float, robot_radius: float) -> float:
    """The radius that clearance in the near-wall zone is measured from, m.

    Without the excess, a safety margin as wide as the zone would stop the robot before the term leads it away.
    """
    return robot_radius + max(safety_margin - (1.0 - LEAST_SHARE) * NEAR_WALL_ZONE, 0.0)


def control_step(now: ControlInput, parameters: ControllerParameters, robot: RobotParameters) -> Command:
    """One period of the controller: guiding vector, twist, certificate, ramp.

    Args:
        now: what it is given.
        parameters: of the controller.
        robot: its size and limits.
    """
    pose, twist, _, _, star = now
    direction, desired = desired_twist(now, parameters, robot)
    period = 1.0 / parameters.rate
    v, omega, accepted = certified_twist(pose, twist, desired, period, robot.limits, star, parameters.delay)
    return Command(limited_twist(twist, np.array((v, omega)), robot, period), direction, accepted)


def desired_twist(
    now: ControlInput, parameters: ControllerParameters, robot: RobotParameters
) -> tuple[np.ndarray, np.ndarray]:
    """Guiding vector, and the twist that follows it before anything is certified.

    Arguments as for `control_step`.
    """
    pose, _, _, guidance, star = now
    direction, distance = np.zeros(2), 0.0
    desired = np.zeros(2)
    path = guidance.path if guidance.distance_to_goal(pose[:2]) > GOAL_REACHED else guidance.path[:0]
    last = len(path) == 1
    if len(path):
        direction, distance = guiding_vector(
            pose[:2], path, guidance.regions, star.near_hits, parameters, robot.radius, robot.max_speed
        )
    if direction.any():
        direction = free_heading(pose[:2], direction, star)
        heading = wrapped_angle(math.atan2(direction[1], direction[0]) - pose[2])
        stop_at = distance if guidance.arrives and last else math.inf
        desired = turning_law(heading, robot.max_speed, robot)
        slowest = GOAL_SLOWDOWN * stop_at + CREEP_SPEED
        desired[0] = min(desired[0], robot.max_speed, slowest)
    return direction, desired
