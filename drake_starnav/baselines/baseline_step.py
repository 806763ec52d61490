"""One period of a baseline controller: the robot's state and surroundings -> (v, omega).

DSM, FOA and the potential field give velocities of a robot that moves in any direction; a differential drive follows
them by the turning law of the star controller, at their speed. The dynamic window gives a twist at once.
"""

import math
from dataclasses import dataclass

import numpy as np

from drake_starnav.baselines.dsm_circles import DsmParameters, dsm_velocity
from drake_starnav.baselines.dwa import PERIOD, DwaParameters, dwa_twist
from drake_starnav.baselines.foa import FoaParameters, foa_cluster_velocity, foa_velocity
from drake_starnav.baselines.known_obstacles import KnownObstacles
from drake_starnav.baselines.potential_field import PotentialFieldParameters, potential_field_velocity
from drake_starnav.control.heading_controller import (
    CREEP_SPEED,
    GOAL_SLOWDOWN,
    limited_twist,
    turning_law,
    wrapped_angle,
)
from drake_starnav.control.parameters import ControllerParameters
from drake_starnav.robot import RobotParameters

BaselineParameters = DsmParameters | FoaParameters | DwaParameters | PotentialFieldParameters
AT_REST = 0.12
"""A robot this near to its goal stops, m: nearby obstacles may keep a baseline from coming nearer."""
STANDING = 1e-9
"""A slower velocity has no direction to turn towards, m/s."""


@dataclass(frozen=True)
class Situation:
    """The information that a baseline may use.

    Attributes:
        pose: (x, y, yaw) of the robot in W, m and rad.
        twist: (v, omega) commanded last, m/s and rad/s.
        target: where to head for, shape (2,), W, m.
        goal: where to slow down, shape (2,), W, m.
        points: hits of the current scan, shape (n, 2), W, m; none for a baseline that knows its obstacles.
        obstacles: known obstacles; none for a baseline that has only its scan.
    """

    pose: np.ndarray
    twist: np.ndarray
    target: np.ndarray
    goal: np.ndarray
    points: np.ndarray
    obstacles: KnownObstacles


def baseline_step(
    situation: Situation, settings: BaselineParameters, controller: ControllerParameters, robot: RobotParameters
) -> tuple[np.ndarray, np.ndarray]:
    """The twist for the next period, and the direction that it follows.

    Args:
        situation: state and surroundings.
        settings: of the baseline; their type selects it.
        controller: its rate.
        robot: its radius and limits.

    Returns:
        twist: (v, omega) at the end of the period, within the limits, m/s and rad/s.
        direction: unit vector, shape (2,), W; zero when there is nowhere to go.
    """
    x, y, yaw = situation.pose
    period = 1.0 / controller.rate
    if math.hypot(situation.goal[0] - x, situation.goal[1] - y) < AT_REST:
        return limited_twist(situation.twist, np.zeros(2), robot, period), np.zeros(2)
    if isinstance(settings, DwaParameters):
        v, omega = dwa_twist(situation.pose, situation.twist, situation.target, situation.points, robot, settings)
        heading = yaw + omega * PERIOD
        return limited_twist(situation.twist, np.array((v, omega)), robot, period), _unit(heading)
    velocity = _velocity(situation, settings, robot)
    speed = math.hypot(velocity[0], velocity[1])
    if speed < STANDING:
        return limited_twist(situation.twist, np.zeros(2), robot, period), np.zeros(2)
    bearing = math.atan2(velocity[1], velocity[0])
    speed = min(speed, settings.max_speed, robot.max_speed)
    desired = turning_law(wrapped_angle(bearing - yaw), speed, robot)
    return limited_twist(situation.twist, desired, robot, period), _unit(bearing)


def _velocity(
    situation: Situation,
    settings: DsmParameters | FoaParameters | PotentialFieldParameters,
    robot: RobotParameters,
) -> np.ndarray:
    position = situation.pose[:2]
    if isinstance(settings, PotentialFieldParameters):
        return potential_field_velocity(
            position, situation.target, situation.points, robot_radius=robot.radius, parameters=settings
        )
    speed = min(settings.max_speed, robot.max_speed)
    nominal = _nominal_velocity(position, situation.target, situation.goal, speed)
    radius = robot.radius + settings.margin
    if isinstance(settings, DsmParameters):
        known = situation.obstacles
        return dsm_velocity(
            position, nominal, known.circles, robot_radius=radius, reference_points=known.reference_points
        )
    velocity = foa_cluster_velocity if settings.clusters else foa_velocity
    return velocity(position, nominal, situation.points, control_radius=radius)


def _nominal_velocity(position: np.ndarray, target: np.ndarray, goal: np.ndarray, speed: float) -> np.ndarray:
    """Straight to the target, slower towards the goal only."""
    offset = target - position
    distance = math.hypot(offset[0], offset[1])
    if distance < STANDING:
        return np.zeros(2)
    left = math.hypot(goal[0] - position[0], goal[1] - position[1])
    return min(speed, GOAL_SLOWDOWN * left + CREEP_SPEED) / distance * offset


def _unit(bearing: float) -> np.ndarray:
    return np.array((math.cos(bearing), math.sin(bearing)))
