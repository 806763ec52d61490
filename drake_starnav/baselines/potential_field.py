"""An artificial potential field: the goal attracts, every hit near the robot repels.

Attraction and repulsion are the negative gradients of Khatib's potentials, read as velocities:

    goal - p, per s, at most max_speed,    eta (1/rho - 1/rho_0)/rho^2 away from an obstacle at distance rho < rho_0

Khatib sums over obstacles, but a scan holds hits, and a sum over hits would grow with the number of beams. So the
repulsion has the strength of the nearest hit, and the mean direction of all hits within rho_0, each weighted by its own
strength. It is Khatib's for one obstacle, independent of the resolution, and cancels between two walls as the sum does.
Source: Khatib, "Real-time obstacle avoidance for manipulators and mobile robots", IJRR 1986.
"""

import math
from dataclasses import dataclass

import numpy as np

from drake_starnav.baselines.baseline_step import MIN_DISTANCE, Situation
from drake_starnav.control.inputs import Proposal
from drake_starnav.parameters import Checked, parameter

INFLUENCE_DISTANCE = 1.0
"""Khatib's rho_0: distance from the hull beyond which a hit does not repel, m; see docs/baselines.md."""


@dataclass(frozen=True)
class PotentialFieldParameters(Checked, place="apf"):
    """How strongly hits repel, and how fast the robot drives."""

    max_speed: float = parameter(
        0.6, "largest speed, of the attraction alone and of the sum", unit="m/s", above=0.0, high=10.0
    )
    repulsive_gain: float = parameter(
        0.0003, "Khatib's eta: larger turns away sooner", unit="m^4/s", low=0.0, high=100.0
    )

    known = False
    """It has its scan alone."""

    def propose(self, situation: Situation) -> Proposal:
        """The twist that follows `potential_field_velocity`, and its direction."""
        velocity = potential_field_velocity(
            situation.pose[:2],
            situation.target,
            situation.points,
            robot_radius=situation.robot.radius,
            parameters=self,
        )
        return situation.followed(velocity, self.max_speed)


def potential_field_velocity(
    position: np.ndarray,
    goal: np.ndarray,
    points: np.ndarray,
    *,
    robot_radius: float,
    parameters: PotentialFieldParameters,
) -> np.ndarray:
    """The velocity (2,) down the potential, at most `max_speed` long; W, m/s.

    Local minima are part of the method. A hit in the robot's very centre has no direction and is left out. Finite
    arguments give a finite result.

    Args:
        position, goal: shape (2,), W, m.
        points: the hits, shape (n, 2), W, m.
        robot_radius: m.
        parameters: gain of the repulsion, and largest speed.
    """
    attraction = _limited(goal - position, parameters.max_speed)
    repulsion = parameters.repulsive_gain * _repulsion(position, points, robot_radius)
    return _limited(attraction + repulsion, parameters.max_speed)


def _limited(velocity: np.ndarray, speed: float) -> np.ndarray:
    length = math.hypot(*velocity)
    return velocity * (speed / length) if length > speed else velocity


def _repulsion(position: np.ndarray, points: np.ndarray, robot_radius: float) -> np.ndarray:
    """The repulsion (2,) at a position of points (n, 2) nearer to the hull than INFLUENCE_DISTANCE, without gain."""
    offset = position - points
    distance = np.hypot(*offset.T)
    rho = np.maximum(distance - robot_radius, MIN_DISTANCE)
    repels = (distance > 0.0) & (rho < INFLUENCE_DISTANCE)
    if not repels.any():
        return np.zeros(2)
    strength = (1.0 / rho[repels] - 1.0 / INFLUENCE_DISTANCE) / rho[repels] ** 2
    return strength.max() * (strength / distance[repels]) @ offset[repels] / strength.sum()
