"""The dynamic window approach: the best of the circular arcs that the robot can reach within a control period.

A twist (v, omega) in the window [v +- a T] x [omega +- alpha T] moves the robot on an arc. It is admissible if after
one period T on that arc the robot can still stop on it before its hull meets a hit:

    v (T + t/2) <= clearance(v, omega),   t = max(v/a, |omega|/alpha)

Among the admissible twists the largest weighted sum of heading, clearance and speed wins, each from 0 to 1.
Clearances are exact: where the disc meets a point on a circle or a line has a closed form, so nothing is sampled along
the arc.
Source: Fox, Burgard and Thrun, "The dynamic window approach to collision avoidance", IEEE Robotics & Automation
Magazine 1997. The period T in the admissibility is added for a controller that runs at a fixed rate; so is the speed
limit from which the robot can stop at the goal.
"""

import math
from dataclasses import dataclass

import numpy as np

from drake_starnav.baselines.baseline_step import BaselineInput, make_unit_vector
from drake_starnav.control.inputs import Proposal
from drake_starnav.geometry.compiled import kernel, leaf
from drake_starnav.geometry.se2 import invert_pose, transform_points
from drake_starnav.robot import RobotParameters
from drake_starnav.robot.limits import limit_value

PERIOD = 0.25
"""Time that a command is held, s: the size of the window, and part of every stopping distance; the paper's."""
SAMPLES = (11, 21)
"""Speeds and turning rates across the window; an odd number keeps the present one."""
CLEARANCE_WEIGHT, SPEED_WEIGHT = 0.5, 0.5
"""Weights of the way to the first hit along the arc and of speed; facing the goal after it has 1."""
CLEARANCE_LIMIT = 2.0
"""Clearance from which on more is no better, m."""
STRAIGHT = 1e-6
"""An arc with a smaller curvature than this is a line, 1/m."""


@dataclass(frozen=True)
class DwaBaseline:
    """The dynamic window; `margin` is the clearance kept beyond the robot's radius, m."""

    margin: float = 0.02
    knows_obstacles = False
    follows_roadmap = False

    def propose(self, inputs: BaselineInput) -> Proposal:
        """`choose_dwa_twist`, and where it turns to."""
        pose = inputs.pose
        v, omega = choose_dwa_twist(pose, inputs.twist, inputs.target, inputs.points, inputs.robot, self.margin)
        return Proposal(np.array((v, omega)), make_unit_vector(pose[2] + omega * PERIOD))


def choose_dwa_twist(
    pose: np.ndarray, twist: np.ndarray, goal: np.ndarray, points: np.ndarray, robot: RobotParameters, margin: float
) -> tuple[float, float]:
    """The twist (v, omega) of the best admissible arc in the dynamic window, m/s and rad/s.

    If no arc is admissible the robot brakes along the arc it is on, which the period before had found free. The result
    never asks for more than the robot's accelerations allow within a period, and never drives backwards.

    Args:
        pose, twist: (x, y, yaw) of the robot, W, m and rad, and its (v, omega) now.
        goal, points: shape (2,), and the hits, shape (n, 2), W, m.
        robot: its radius and limits.
        margin: clearance kept beyond the radius, m.
    """
    hits, goal = transform_points(invert_pose(pose), points), transform_points(invert_pose(pose), goal[None])[0]
    v, omega = _choose_best_twist(twist, goal, hits, robot.limits, robot.radius + margin)
    return float(v), float(omega)


@kernel
def _choose_best_twist(twist, goal, points, limits, radius):
    """The best admissible twist (v, omega); goal and points in the robot's frame, m, limits are `Limits`."""
    (v_now, omega_now), braking, alpha_max = twist, limits.max_deceleration, limits.max_yaw_acceleration
    v_low, v_high, omega_low, omega_high = _find_window(v_now, omega_now, math.hypot(goal[0], goal[1]), limits)

    # No twist of this window goes farther before it stops, or cares for clearance beyond its limit.
    longest = max(CLEARANCE_LIMIT, v_high * (PERIOD + 0.5 * max(v_high / braking, limits.max_yaw_rate / alpha_max)))
    near_hits = points[points[:, 0] ** 2 + points[:, 1] ** 2 <= (longest + radius) ** 2]

    best, best_v, best_omega = -math.inf, 0.0, 0.0
    for i in range(SAMPLES[0]):
        v = v_low + (v_high - v_low) * i / (SAMPLES[0] - 1)
        for j in range(SAMPLES[1]):
            omega = omega_low + (omega_high - omega_low) * j / (SAMPLES[1] - 1)
            braking_time = PERIOD + 0.5 * max(v / braking, abs(omega) / alpha_max)
            clearance = math.inf  # a disc that turns on the spot covers no new ground
            if v > 0.0:
                clearance = _compute_arc_clearance(near_hits, omega / v, radius, v * braking_time)
                if v * braking_time > clearance:
                    continue
            error = _find_heading_error(goal[0], goal[1], omega * braking_time, v * braking_time)
            free = min(clearance, CLEARANCE_LIMIT) / CLEARANCE_LIMIT
            score = 1.0 - error / math.pi + CLEARANCE_WEIGHT * free + SPEED_WEIGHT * v / limits.max_speed
            if score > best:
                best, best_v, best_omega = score, v, omega
    if best > -math.inf:
        return best_v, best_omega
    stop_time = max(abs(v_now) / braking, abs(omega_now) / alpha_max)
    kept_share = max(0.0, 1.0 - PERIOD / stop_time) if stop_time > 0.0 else 0.0
    return max(kept_share * v_now, 0.0), kept_share * omega_now


@leaf
def _find_window(v, omega, goal_distance, limits):
    """Return the least and largest v, and omega, of twists within reach from which the robot can stop at the goal."""
    v_low = min(max(v - limits.max_deceleration * PERIOD, 0.0), limits.max_speed)
    stopping = math.sqrt(2.0 * limits.max_deceleration * goal_distance)
    v_high = max(min(v + limits.max_acceleration * PERIOD, limits.max_speed, stopping), v_low)
    change, omega_max = limits.max_yaw_acceleration * PERIOD, limits.max_yaw_rate
    return v_low, v_high, limit_value(omega - change, omega_max), limit_value(omega + change, omega_max)


@leaf
def _find_heading_error(goal_ahead, goal_left, turn, length):
    """Return the angle to the goal, rad, at the end of an arc along x with a turn, rad, and a length, m."""
    cosine, sine = math.cos(turn), math.sin(turn)
    x_goal, y_goal = goal_ahead - length, goal_left
    if abs(turn) >= 1e-9:
        x_goal, y_goal = goal_ahead - length * sine / turn, goal_left - length * (1.0 - cosine) / turn
    return abs(math.atan2(cosine * y_goal - sine * x_goal, cosine * x_goal + sine * y_goal))


@kernel
def _compute_arc_clearance(points, curvature, radius, limit):
    """The way until a disc at the origin, on an arc along x, touches a point; less than `limit` ends the search."""
    clearance = math.inf
    if abs(curvature) < STRAIGHT:
        for k in range(len(points)):
            x_point, y_point = points[k, 0], points[k, 1]
            if abs(y_point) < radius and x_point >= 0.0:
                clearance = min(clearance, max(x_point - math.sqrt(radius * radius - y_point * y_point), 0.0))
        return clearance
    turning = 1.0 / abs(curvature)
    side = math.copysign(1.0, curvature)
    for k in range(len(points)):
        # From the centre of the arc, mirrored so that it turns left; the robot starts at (0, -turning).
        px, py = points[k, 0], side * points[k, 1] - turning
        distance_squared = px * px + py * py
        if distance_squared >= (turning + radius) ** 2:
            continue
        if turning > radius and distance_squared <= (turning - radius) ** 2:
            continue
        if distance_squared <= (radius - turning) ** 2:
            return 0.0  # the disc covers this point all the way round
        distance = math.sqrt(distance_squared)
        # Cosine rule in the triangle arc centre, robot, point, at the moment of contact.
        cosine = (distance_squared + turning * turning - radius * radius) / (2.0 * distance * turning)
        half = math.acos(min(max(cosine, -1.0), 1.0))
        bearing = math.atan2(px, -py)  # how far the robot turns until it is nearest to the point, (-pi, pi]
        if 0.0 <= bearing <= half:
            return 0.0
        angle = bearing - half
        if angle < 0.0:
            angle += 2.0 * math.pi
        clearance = min(clearance, angle * turning)
        if clearance < limit:
            return clearance
    return clearance
