"""From guidance to a twist of any base, by dynamical system modulation."""

import math
from typing import NamedTuple

import numpy as np
from numba import njit

from drake_starnav.control.free_heading import free_heading
from drake_starnav.control.inputs import ControllerInputs, Proposal
from drake_starnav.control.manoeuvre_following import followed_manoeuvre
from drake_starnav.control.modulation import modulated_direction, near_wall_direction
from drake_starnav.control.rollout import CREEP, GOAL_SLOWDOWN
from drake_starnav.planning.guidance import PASSED_DISTANCE
from drake_starnav.robot import Limits, RobotParameters
from drake_starnav.robot.base import twist_of
from drake_starnav.robot.limits import HEADING_GAIN, aimed, slowed, wrapped_angle
from drake_starnav.surroundings.margins import Margins
from drake_starnav.surroundings.region_union import RegionUnion

GOAL_REACHED = 0.08
"""A robot this near to its final goal stops, in its radii."""
LEAST_SHARE = 0.8
"""At the certificate's boundary the near-wall term has at least this share: every guiding vector leads off the wall."""
TURNING_TIMES = 2.0
"""Limits the push off a wall to one near-wall zone per TURNING_TIMES / HEADING_GAIN, s, in which the robot turns back;
otherwise it would oscillate between the walls of a narrow passage."""
MODULATION_DISTANCE = 1.0
"""Nearer to the way point than this, in radii, the guiding vector is used as it is: the robot would circle about it."""
NEAR_WALL_ZONE = 0.2
"""Clearance at which the push off a wall begins, in radii. With twice as much the robot is slower in narrow places."""


class Clearances(NamedTuple):
    """What the guiding vector's lengths are measured by, m.

    Attributes:
        radius: the robot's narrow radius.
        near_wall: from which on clearance in the near-wall zone is measured.
    """

    radius: float
    near_wall: float

    @staticmethod
    def of(radius: float, safety_margin: float) -> "Clearances":
        """Of a robot with this narrow radius and safety margin, m.

        Without the excess, a safety margin as wide as the zone would stop the robot before the near-wall term leads it
        away.
        """
        zone = NEAR_WALL_ZONE * radius
        return Clearances(radius, radius + max(safety_margin - (1.0 - LEAST_SHARE) * zone, 0.0))


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
    ahead = guidance.path, guidance.arrives, tuple(guidance.regions), star.near_hits
    sizes, found = Clearances.of(robot.shape.narrow, margins.safety), np.zeros(5)
    _followed(pose, ahead, star.alone[:3], tuple(sizes), tuple(limits), found)
    return Proposal(twist_of(found[2:], robot.drive), found[:2])


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
    ux, uy, distance = guided(*position, path, regions, hits, Clearances.of(robot_radius, margins.safety), speed)
    return np.array((ux, uy)), distance


@njit(cache=True)
def _followed(pose, ahead, star, sizes, limits, found):
    """Write guiding vector (2,) and `Velocity` into `found` (5,), where the robot shall not stand."""
    x, y, yaw = pose
    path, arrives, regions, hits = ahead
    regions, limits = RegionUnion(*regions), Limits(*limits)  # plain tuples are handed over faster than named ones
    sizes = Clearances(*sizes)
    count = len(path)
    if count == 0 or (arrives and math.hypot(path[-1, 0] - x, path[-1, 1] - y) <= GOAL_REACHED * sizes.radius):
        return
    ux, uy, distance = guided(x, y, path, regions, hits, sizes, limits.max_speed)
    if ux == 0.0 and uy == 0.0:
        return
    ux, uy = free_heading(x, y, ux, uy, star, sizes.radius)
    velocity = aimed(wrapped_angle(math.atan2(uy, ux) - yaw), limits.max_speed, limits)
    most = GOAL_SLOWDOWN * distance + limits.max_speed / CREEP if arrives and count == 1 else np.inf
    velocity = slowed(velocity, most)
    found[0], found[1] = ux, uy
    found[2], found[3], found[4] = velocity.ahead, velocity.aside, velocity.turning


@njit(cache=True)
def guided(x, y, path, regions, hits, sizes, speed):
    """`guiding_vector` as numbers: (x, y), and the distance to the way point; zero at the last one.

    `sizes` are `Clearances`.
    """
    ahead_x, ahead_y, gx, gy, distance = way_point(x, y, path, sizes.radius)
    if distance == 0.0:
        return 0.0, 0.0, 0.0
    ux, uy = gx, gy
    if distance > MODULATION_DISTANCE * sizes.radius:
        ux, uy = modulated_direction(x, y, gx, gy, regions, sizes.radius)
    zone = NEAR_WALL_ZONE * sizes.radius
    push = zone / max(TURNING_TIMES / HEADING_GAIN * abs(speed), zone)
    ux, uy = near_wall_direction(x, y, ux, uy, hits, sizes.near_wall, zone, push)
    return ux, uy, distance


@njit(cache=True)
def way_point(x, y, path, radius):
    """The first way point of a path (k, 2) that a robot has not passed: (x, y), unit vector to it, distance.

    In m. Vector and distance are zero at the last way point.
    """
    ahead_x = ahead_y = dx = dy = distance = 0.0
    for k in range(len(path)):
        ahead_x, ahead_y = path[k, 0], path[k, 1]
        dx, dy = ahead_x - x, ahead_y - y
        distance = math.hypot(dx, dy)
        if distance > PASSED_DISTANCE * radius:
            break
    if distance < 1e-6:
        return ahead_x, ahead_y, 0.0, 0.0, 0.0
    return ahead_x, ahead_y, dx / distance, dy / distance, distance
