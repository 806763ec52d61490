"""From guidance to a twist of any base, by dynamical system modulation."""

import math

import numpy as np

from drake_starnav.control.free_heading import find_free_heading
from drake_starnav.control.inputs import ControllerInputs, Proposal
from drake_starnav.control.modulation import modulate_direction
from drake_starnav.geometry.compiled import kernel, leaf
from drake_starnav.manoeuvres.following import follow_manoeuvre
from drake_starnav.planning.guidance import PASSED_DISTANCE
from drake_starnav.robot import Limits, RobotParameters
from drake_starnav.robot.base import convert_to_twist
from drake_starnav.robot.limits import STOPPING_GAIN, cap_speed, find_velocity_towards, wrap_angle
from drake_starnav.surroundings.region_union import RegionUnion

GOAL_BRAKING = 0.96
"""On arrival a robot brakes with up to this share of its largest deceleration."""
CREEP = 10.0
"""On arrival a robot slows down to its largest speed divided by this, so that it does arrive."""
GOAL_REACHED = 0.08
"""A robot this near to its final goal stops, in its radii."""
MODULATION_DISTANCE = 1.0
"""Nearer to the way point than this, in radii, the guiding vector is used as it is: the robot would circle about it."""


def follow_guidance(inputs: ControllerInputs, robot: RobotParameters) -> Proposal:
    """The twist with which a robot of some size and limits follows the guiding vector."""
    guidance, star, proposal = inputs.guidance, inputs.surroundings.certified_star, np.zeros(5)
    if len(guidance.poses):
        return Proposal(*follow_manoeuvre(inputs.pose, guidance.poses, robot))
    # plain tuples are handed over faster than named ones
    _follow_guidance(
        inputs.pose,
        guidance.path,
        guidance.arrives,
        tuple(guidance.regions),
        star.boundary.points,
        star.radius,
        robot.shape.cover_radius,
        tuple(robot.limits),
        proposal,
    )
    return Proposal(convert_to_twist(proposal[2:], robot.drive), proposal[:2])


@leaf
def compute_goal_slowdown(limits):
    """Return the speed per distance to the goal on arrival, 1/s."""
    return min(GOAL_BRAKING * limits.max_deceleration / limits.max_speed, STOPPING_GAIN)


@kernel
def _follow_guidance(pose, path, arrives, regions, hits, hit_distance, radius, limits, proposal):
    """Write guiding vector (2,) and `Velocity` into `proposal` (5,), where the robot shall not stand.

    The certificate keeps a distance (m) from the hits (n, 2), W, m.
    """
    x, y, yaw = pose
    regions, limits = RegionUnion(*regions), Limits(*limits)
    point_count = len(path)
    if point_count == 0 or (arrives and math.hypot(path[-1, 0] - x, path[-1, 1] - y) <= GOAL_REACHED * radius):
        return
    ux, uy, distance = guiding_vector(x, y, path, regions, radius)
    if ux == 0.0 and uy == 0.0:
        return
    ux, uy = find_free_heading(x, y, ux, uy, hits, radius, hit_distance)
    velocity = find_velocity_towards(wrap_angle(math.atan2(uy, ux) - yaw), limits.max_speed, limits)
    speed_limit = (
        compute_goal_slowdown(limits) * distance + limits.max_speed / CREEP if arrives and point_count == 1 else np.inf
    )
    velocity = cap_speed(velocity, speed_limit)
    proposal[0], proposal[1] = ux, uy
    proposal[2], proposal[3], proposal[4] = velocity.v_x, velocity.v_y, velocity.turning


@kernel
def guiding_vector(x, y, path, regions, radius):
    """Unit vector (x, y) for a robot at (x, y) to follow, and the distance to its way point, m; zero at the last one.

    Args:
        x, y: of the robot, W, m.
        path: shape (k, 2), way points ahead, W, m.
        regions: union of those around the robot.
        radius: of the robot, m.
    """
    ux, uy, distance = find_way_point(x, y, path, radius)
    if distance > MODULATION_DISTANCE * radius:
        ux, uy = modulate_direction(x, y, ux, uy, regions, radius)
    return ux, uy, distance


@kernel
def find_way_point(x, y, path, radius):
    """Unit vector to the first way point of a path (k, 2) that a robot has not passed, and its distance, m.

    Both are zero at the last way point.
    """
    dx = dy = distance = 0.0
    for k in range(len(path)):
        dx, dy = path[k, 0] - x, path[k, 1] - y
        distance = math.hypot(dx, dy)
        if distance > PASSED_DISTANCE * radius:
            break
    if distance < 1e-6:
        return 0.0, 0.0, 0.0
    return dx / distance, dy / distance, distance
