"""The paper's controller: modulation by every region, a blend near obstacles, and PID. It certifies nothing.

Source: paper, section III-C and IV, as printed; see `control.modulation` for what this project changes.
"""

import math

import numpy as np
from numba import njit

from drake_starnav.control.heading_controller import limited_twist, wrapped_angle
from drake_starnav.control.law import Command, ControlInput
from drake_starnav.control.modulation import SIGMA, boundary_frame
from drake_starnav.control.parameters import ControllerParameters
from drake_starnav.control.path_following import GOAL_REACHED, way_point
from drake_starnav.regions.star_region import RegionStack
from drake_starnav.robot import RobotParameters

RHO = 0.1
"""Clearance at which the blend near an obstacle is complete, m."""
CENTER_WEIGHT = 8.0
"""Gamma at a reference point, where it has no bound."""
KP_V, KD_V, KP_W, KD_W = 0.5, 0.05, 2.0, 0.05
"""Gains of the paper's authors."""


def control_step(now: ControlInput, parameters: ControllerParameters, robot: RobotParameters) -> Command:
    """One period of the controller; arguments as for `control.control_step`, of the parameters only `rate`."""
    pose, twist, errors, guidance, star = now
    period, direction, desired = 1.0 / parameters.rate, np.zeros(2), np.zeros(2)
    if len(guidance.path) and guidance.distance_to_goal(pose[:2]) > GOAL_REACHED:
        direction = guiding_vector(pose[:2], guidance.path, guidance.regions, star.near_hits, robot.radius)
    if direction.any():
        heading = wrapped_angle(math.atan2(direction[1], direction[0]) - pose[2])
        desired, errors = tracked(heading, twist, errors, period, robot)
    return Command(limited_twist(twist, desired, robot, period), direction, False, errors)


def guiding_vector(
    position: np.ndarray, path: np.ndarray, regions: RegionStack, hits: np.ndarray, robot_radius: float
) -> np.ndarray:
    """Unit vector to follow, shape (2,), W; zero at the last way point.

    Arguments as for `control.guiding_vector`.
    """
    *_, ux, uy, distance = way_point(*position, path)
    if distance == 0.0:
        return np.zeros(2)
    direction = np.array(modulated_direction(*position, ux, uy, regions.with_slopes))
    return nearest_point_direction(position, direction, hits, robot_radius)


def nearest_point_direction(
    position: np.ndarray, direction: np.ndarray, hits: np.ndarray, robot_radius: float
) -> np.ndarray:
    """The blend p* = (1 - a) p~* + a p~_n* near an obstacle.

    For p~_n*, which the paper leaves undefined, the unit vector away from the nearest hit p_n.
    a = min(rho/(|p - p_n| - r), 1), and 1 where |p - p_n| <= r + rho: the printed form is negative inside the robot's
    radius.

    Args:
        position: shape (2,), W, m.
        direction: p~*, unit vector, shape (2,), W.
        hits: shape (n, 2), W, m.
        robot_radius: r, m.

    Source: paper, eq. (combine).
    """
    if not len(hits):
        return direction
    offset = hits - position
    distance = np.hypot(offset[:, 0], offset[:, 1])
    nearest = int(np.argmin(distance))
    outward = offset[nearest] / max(distance[nearest], 1e-9)
    clearance = distance[nearest] - robot_radius
    share = 1.0 if clearance <= RHO else RHO / clearance
    blend = (1.0 - share) * direction - share * outward
    length = float(np.hypot(*blend))
    return blend / length if length > 1e-9 else direction


def tracked(
    heading: float, twist: np.ndarray, errors: np.ndarray, period: float, robot: RobotParameters
) -> tuple[np.ndarray, np.ndarray]:
    """The twist that turns towards a heading, u = kp e + kd de/dt with v_ref = min(1, 0.5 / |e|), and its errors.

    Without an integral term the speed settles at v_ref kp / (1 + kp), a third of v_ref, whatever the robot's limits.

    Args:
        heading: error of the robot's heading, rad.
        twist: (v, omega) now, m/s and rad/s.
        errors: (v, heading) errors of the last period, m/s and rad.
        period: s.
        robot: its limits.

    Source: paper, section IV.
    """
    reference = min(1.0, 0.5 / max(abs(heading), 1e-6))
    error = np.array((reference - twist[0], heading))
    rate = (error - errors) / period
    v = KP_V * error[0] + KD_V * rate[0]
    omega = KP_W * error[1] + KD_W * rate[1]
    return np.array((v, omega)), error


@njit(cache=True)
def modulated_direction(x, y, ux, uy, regions):
    """The sum of the vectors modulated by each region, as long as they are, weighted by Gamma; normalised.

    Inward motion is damped as well as outward. Arguments as for `control.modulation.modulated_direction`.
    """
    center, bearing_0, values, slopes, reach = regions
    sum_x = sum_y = total = 0.0
    for k in range(len(bearing_0)):
        gamma, cosine, sine, tx, ty = boundary_frame(
            x, y, center[k], bearing_0[k], values[k], slopes[k], reach[k], SIGMA
        )
        if gamma == np.inf:
            sum_x += CENTER_WEIGHT * ux
            sum_y += CENTER_WEIGHT * uy
            total += CENTER_WEIGHT
        elif gamma > 0.0:
            det = cosine * ty - sine * tx
            radial = (ux * ty - uy * tx) / det * (1.0 - 1.0 / gamma)
            tangential = (cosine * uy - sine * ux) / det * (1.0 + 1.0 / gamma)
            vx, vy = radial * cosine + tangential * tx, radial * sine + tangential * ty
            if math.sqrt(vx * vx + vy * vy) > 1e-9:
                sum_x += gamma * vx
                sum_y += gamma * vy
                total += gamma
    length = math.sqrt(sum_x * sum_x + sum_y * sum_y)
    if length < 1e-9 or total <= 0.0:
        return ux, uy
    return sum_x / length, sum_y / length
