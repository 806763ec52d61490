"""From guidance to a twist of the differential drive, by dynamical system modulation."""

import math

import numpy as np
from numba import njit

from drake_starnav.control.free_heading import free_heading
from drake_starnav.control.inputs import ControllerInputs, Proposal
from drake_starnav.control.manoeuvre_following import aligned_direction, followed_manoeuvre
from drake_starnav.control.modulation import modulated_direction, near_wall_direction
from drake_starnav.control.rollout import CREEP_SPEED, GOAL_SLOWDOWN
from drake_starnav.planning.guidance import PASSED_DISTANCE
from drake_starnav.planning.passage import tight_passage
from drake_starnav.regions.margins import Margins
from drake_starnav.regions.region_union import RegionUnion, first_gap
from drake_starnav.robot import Limits, RobotParameters
from drake_starnav.robot.limits import HEADING_GAIN, turning_twist, wrapped_angle

GOAL_REACHED = 0.02
"""A robot this near to its final goal stops, m."""
LEAST_SHARE = 0.8
"""At the certificate's boundary the near-wall term has at least this share: every guiding vector leads off the wall."""
TURNING_TIMES = 2.0
"""Limits the push off a wall to one near-wall zone per TURNING_TIMES / HEADING_GAIN, s, in which the robot turns back;
otherwise it would oscillate between the walls of a narrow passage."""
MAX_BEND = 0.8
"""Largest turn of the guiding vector by modulation where the robot sees the way point inside the regions, rad."""
MODULATION_DISTANCE = 0.25
"""Nearer than this to the way point the guiding vector is used as it is, m: the robot would circle about it."""
NEAR_WALL_ZONE = 0.05
"""Clearance at which the push off a wall begins, m. With 0.1 m the robot is slower in narrow places."""


def followed(inputs: ControllerInputs, margins: Margins, robot: RobotParameters) -> Proposal:
    """The twist that follows the guiding vector.

    Args:
        inputs: what the controller is given.
        margins: of these only the safety margin.
        robot: its size and limits.
    """
    pose, _, guidance, star = inputs
    limits = robot.limits
    if len(guidance.poses):
        return Proposal(*followed_manoeuvre(pose, guidance.poses, robot.drive, limits))
    known = guidance.path, guidance.arrives, tuple(guidance.regions), star.near_hits
    near_wall, found = near_wall_radius(margins.safety, robot.shape.narrow), np.zeros(4)
    most = _followed(pose, known, star.alone[:3], near_wall, tuple(limits), found)
    direction = found[:2]
    if robot.shape.is_disc and robot.base == "differential":
        return Proposal(found[2:], direction)
    if not direction.any():
        return Proposal(np.zeros(len(robot.drive.components)), direction)
    if not robot.shape.is_disc:
        passage = tight_passage(pose, guidance.path, star.hits, robot.shape, margins.safety)
        direction = aligned_direction(pose, direction, passage, float(np.ptp(robot.shape.outline[:, 0])))
    error = wrapped_angle(math.atan2(direction[1], direction[0]) - pose[2])
    return Proposal(robot.drive.towards(error, min(limits.max_speed, most), limits), direction)


def guiding_vector(
    position: np.ndarray,
    path: np.ndarray,
    regions: RegionUnion,
    hits: np.ndarray,
    margins: Margins,
    robot_radius: float,
    speed: float = 0.0,
) -> tuple[np.ndarray, float]:
    """Unit vector to follow, shape (2,), W, and the distance to the short-term goal, m.

    Args:
        position: of the robot, shape (2,), W, m.
        path: shape (k, 2), way points ahead, W, m.
        regions: around the robot.
        hits: close to the robot, shape (n, 2), W, m.
        margins: of these only the safety margin.
        robot_radius: m.
        speed: of the robot, m/s.
    """
    near_wall = near_wall_radius(margins.safety, robot_radius)
    ux, uy, distance = guided(*position, path, regions, hits, near_wall, speed)
    return np.array((ux, uy)), distance


def near_wall_radius(safety_margin: float, robot_radius: float) -> float:
    """The radius that clearance in the near-wall zone is measured from, m.

    Without the excess, a safety margin as wide as the zone would stop the robot before the term leads it away.
    """
    return robot_radius + max(safety_margin - (1.0 - LEAST_SHARE) * NEAR_WALL_ZONE, 0.0)


@njit(cache=True)
def _followed(pose, known, star, near_wall, limits, found):
    """The most speed, m/s; where it shall not stand, guiding vector (x, y) and twist (v, omega) are written (4,)."""
    x, y, yaw = pose
    path, arrives, regions, hits = known
    regions, limits = RegionUnion(*regions), Limits(*limits)  # plain tuples are handed over faster than named ones
    count = len(path)
    if count == 0 or (arrives and math.hypot(path[-1, 0] - x, path[-1, 1] - y) <= GOAL_REACHED):
        return 0.0
    ux, uy, distance = guided(x, y, path, regions, hits, near_wall, limits.max_speed)
    if ux == 0.0 and uy == 0.0:
        return 0.0
    ux, uy = free_heading(x, y, ux, uy, star)
    v, omega = turning_twist(wrapped_angle(math.atan2(uy, ux) - yaw), limits.max_speed, limits)
    most = GOAL_SLOWDOWN * distance + CREEP_SPEED if arrives and count == 1 else np.inf
    found[:] = ux, uy, min(v, most), omega
    return most


@njit(cache=True)
def guided(x, y, path, regions, hits, near_wall, speed):
    """`guiding_vector` as numbers: (x, y), and the distance to the way point; zero at the last one."""
    ahead_x, ahead_y, gx, gy, distance = way_point(x, y, path)
    if distance == 0.0:
        return 0.0, 0.0, 0.0
    ux, uy = gx, gy
    if distance > MODULATION_DISTANCE:
        ux, uy = modulated_direction(x, y, gx, gy, regions)
        # Where a boundary is steep, r_hat and t are nearly parallel, E is nearly singular, and what M makes of a
        # guiding vector may lead to the wrong side of an obstacle.
        turn = math.atan2(gx * uy - gy * ux, gx * ux + gy * uy)
        if abs(turn) > MAX_BEND and first_gap(regions, (x, y), (ahead_x, ahead_y), 0.0) < 0.0:
            cosine, sine = math.cos(MAX_BEND), math.copysign(math.sin(MAX_BEND), turn)
            ux, uy = cosine * gx - sine * gy, sine * gx + cosine * gy
    push = NEAR_WALL_ZONE / max(TURNING_TIMES / HEADING_GAIN * abs(speed), NEAR_WALL_ZONE)
    ux, uy = near_wall_direction(x, y, ux, uy, hits, near_wall, NEAR_WALL_ZONE, push)
    return ux, uy, distance


@njit(cache=True)
def way_point(x, y, path):
    """The first way point of a path (k, 2) not yet passed: (x, y), the unit vector (x, y) to it, and its distance, m.

    Vector and distance are zero at the last way point.
    """
    ahead_x = ahead_y = dx = dy = distance = 0.0
    for k in range(len(path)):
        ahead_x, ahead_y = path[k, 0], path[k, 1]
        dx, dy = ahead_x - x, ahead_y - y
        distance = math.hypot(dx, dy)
        if distance > PASSED_DISTANCE:
            break
    if distance < 1e-6:
        return ahead_x, ahead_y, 0.0, 0.0, 0.0
    return ahead_x, ahead_y, dx / distance, dy / distance, distance
