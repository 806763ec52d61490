"""What a baseline controller is: from the robot's state and surroundings to a desired twist.

DSM and FOA give velocities of a robot that moves in any direction; a differential drive follows
them by the turning law of the star controller, at their speed. The dynamic window gives a twist at once.
"""

import math
from dataclasses import dataclass
from typing import Protocol

import numpy as np

from drake_starnav.baselines.known_obstacles import KnownObstacles
from drake_starnav.control.inputs import Proposal
from drake_starnav.control.path_following import CREEP, compute_goal_slowdown
from drake_starnav.robot import RobotParameters
from drake_starnav.robot.base import convert_to_twist
from drake_starnav.robot.limits import find_velocity_towards, wrap_angle

AT_REST = 0.12
"""A robot this near to its goal stops, m: nearby obstacles may keep a baseline from coming nearer."""
STANDING = 1e-9
"""A slower velocity has no direction to turn towards, m/s."""
MIN_DISTANCE = 1e-3
"""Hits count as at least this far from the hull, so that their weights are finite, m."""
STOP = Proposal(np.zeros(2), np.zeros(2))


@dataclass(frozen=True)
class BaselineInput:
    """The information that a baseline may use.

    Attributes:
        pose: (x, y, yaw) of the robot in W, m and rad.
        twist: (v, omega) commanded last, m/s and rad/s.
        target: where to head for, shape (2,), W, m.
        goal: where to slow down, shape (2,), W, m.
        points: hits of the current scan, shape (n, 2), W, m; none for a baseline that knows its obstacles.
        obstacles: known obstacles; none for a baseline that has only its scan.
        robot: its radius and limits.
    """

    pose: np.ndarray
    twist: np.ndarray
    target: np.ndarray
    goal: np.ndarray
    points: np.ndarray
    obstacles: KnownObstacles
    robot: RobotParameters

    def compute_nominal_velocity(self, speed: float) -> np.ndarray:
        """Straight to the target at a speed, at most the robot's, slower towards the goal only; shape (2,), W, m/s."""
        offset = self.target - self.pose[:2]
        distance = math.hypot(offset[0], offset[1])
        if distance < STANDING:
            return np.zeros(2)
        goal_distance = math.hypot(self.goal[0] - self.pose[0], self.goal[1] - self.pose[1])
        max_speed, slowdown = self.robot.max_speed, compute_goal_slowdown(self.robot.limits)
        return min(speed, max_speed, slowdown * goal_distance + max_speed / CREEP) / distance * offset

    def follow(self, velocity: np.ndarray, max_speed: float) -> Proposal:
        """The twist that turns towards a velocity (2,), W, and drives as fast, up to a speed, m/s."""
        speed = math.hypot(velocity[0], velocity[1])
        if speed < STANDING:
            return STOP
        bearing = math.atan2(velocity[1], velocity[0])
        speed = min(speed, max_speed, self.robot.max_speed)
        error = wrap_angle(bearing - self.pose[2])
        return Proposal(
            convert_to_twist(find_velocity_towards(error, speed, self.robot.limits), self.robot.drive),
            make_unit_vector(bearing),
        )


class Baseline(Protocol):
    """A baseline: its constants, with what it does by them.

    Attributes:
        margin: clearance kept beyond the robot's radius, m.
        knows_obstacles: whether it is told its obstacles; it has no scan then.
        follows_roadmap: whether it heads for the planner's short-term goals instead of the goal.
    """

    @property
    def margin(self) -> float: ...

    @property
    def knows_obstacles(self) -> bool: ...

    @property
    def follows_roadmap(self) -> bool: ...

    def propose(self, inputs: BaselineInput) -> Proposal:
        """The twist that it desires, and the direction that it follows."""


def step_baseline(inputs: BaselineInput, baseline: Baseline) -> Proposal:
    """What a baseline proposes; at its goal it stops."""
    x, y, _ = inputs.pose
    if math.hypot(inputs.goal[0] - x, inputs.goal[1] - y) < AT_REST:
        return STOP
    return baseline.propose(inputs)


def make_unit_vector(bearing: float) -> np.ndarray:
    """Towards a bearing, shape (2,)."""
    return np.array((math.cos(bearing), math.sin(bearing)))
