"""Dynamical system modulation around circles that are all known (DSM).

    v_i = E_i D_i E_i^-1 v,   E_i = [r_hat_i  t_i],   D_i = diag(1 - 1/Gamma_i, 1 + 1/Gamma_i)

r_hat_i points from the reference point of circle i, its centre unless given, to the position, and t_i is its tangent
there. Gamma_i is 1 on the circle inflated by the robot's radius, 1 + (distance in metres) outside, and the share of the
radius inside. The result has the
directional mean of the v_i about v, weights ~ 1/(Gamma_i - 1), and the weighted mean of their lengths.
Source: Huber, Slotine and Billard, "Avoiding dense and dynamic obstacles in enclosed spaces: application to moving in
crowds", T-RO 2022; the conventions (Gamma in metres, weights) are those of the authors' package
dynamic_obstacle_avoidance, commit aa747671, without its tail effect: what leads away from a circle is not bent.
"""

import math
from dataclasses import dataclass

import numpy as np
from numba import njit

from drake_starnav.baselines.baseline_step import Situation
from drake_starnav.baselines.checks import rows, vector
from drake_starnav.baselines.directional_mean import directional_mean
from drake_starnav.control.inputs import Proposal
from drake_starnav.errors import StarnavError
from drake_starnav.parameters import check_parameters, parameter

LEAST_COSINE = 1e-3
"""Where the directions from reference point and centre are nearly at right angles or worse, the centre's is taken."""


@dataclass(frozen=True)
class DsmParameters:
    """Modulation around circles that are all known."""

    margin: float = parameter(
        0.06, "clearance that is modulated for beyond the robot's radius", unit="m", low=0.0, high=1.0
    )
    max_speed: float = parameter(
        0.4, "of the nominal velocity and of the modulated one", unit="m/s", above=0.0, high=10.0
    )

    def __post_init__(self) -> None:
        check_parameters(self, "dsm")

    known = True
    """The circles are given."""

    def propose(self, situation: Situation) -> Proposal:
        """The twist that follows `dsm_velocity`, and its direction."""
        robot, obstacles = situation.robot, situation.obstacles
        velocity = dsm_velocity(
            situation.pose[:2],
            situation.nominal_velocity(min(self.max_speed, robot.max_speed)),
            obstacles.circles,
            robot_radius=robot.radius + self.margin,
            reference_points=obstacles.reference_points,
        )
        return situation.followed(velocity, self.max_speed)


def dsm_velocity(
    position: np.ndarray,
    nominal_velocity: np.ndarray,
    circles: np.ndarray,
    *,
    robot_radius: float,
    reference_points: np.ndarray | None = None,
) -> np.ndarray:
    """The nominal velocity, modulated around known circles.

    On an inflated circle the part of the velocity into it vanishes. Inside one, where the method guarantees nothing,
    the same holds; exactly at the centre, where no direction is preferred, the result is zero. Finite arguments
    give a finite result. Overlapping circles can hold the robot in a local minimum, unless they share a reference
    point; see `known_obstacles`.

    Args:
        position: shape (2,), W, m.
        nominal_velocity: shape (2,), W, m/s.
        circles: shape (n, 3): x, y, radius; W, m.
        robot_radius: m, by which every circle is inflated.
        reference_points: shape (n, 2), W, m, a point in each inflated circle; None for the centres.

    Returns:
        shape (2,), W, m/s.

    Raises:
        StarnavError: wrong shape, a value that is not finite, or a negative radius.
    """
    place = "dsm_velocity: "
    position = vector(position, 2, place + "position")
    nominal_velocity = vector(nominal_velocity, 2, place + "nominal_velocity")
    circles = rows(circles, 3, place + "circles")
    if not (math.isfinite(robot_radius) and robot_radius >= 0.0):
        raise StarnavError(f"{place}robot_radius is {robot_radius}; allowed: a finite number, at least 0")
    if len(circles) == 0:
        return nominal_velocity.copy()
    if circles[:, 2].min() < 0.0:
        bad = int(np.argmin(circles[:, 2]))
        raise StarnavError(f"{place}circles[{bad}, 2] (radius) is {circles[bad, 2]:g}; allowed: at least 0")
    references = circles[:, :2] if reference_points is None else reference_points
    references = rows(references, 2, place + "reference_points", len(circles))
    return np.array(_dsm(position, nominal_velocity, circles, references, float(robot_radius)))


@njit(cache=True)
def _dsm(position, velocity, circles, references, robot_radius):
    """The modulated velocity (x, y); arguments as of `dsm_velocity`, with references of all circles."""
    (x, y), (vx, vy) = position, velocity
    count = len(circles)
    normal = np.empty((count, 2))
    gamma = np.empty(count)
    for i in range(count):
        dx, dy = x - circles[i, 0], y - circles[i, 1]
        distance = math.hypot(dx, dy)
        if distance == 0.0:
            return 0.0, 0.0
        radius = circles[i, 2] + robot_radius
        normal[i, 0], normal[i, 1] = dx / distance, dy / distance
        gamma[i] = 1.0 + distance - radius if distance > radius else distance / radius
    speed = math.hypot(vx, vy)
    if speed == 0.0:
        return 0.0, 0.0
    weights = _weights(gamma)
    modulated = np.empty((count, 2))
    mean_speed = 0.0
    for i in range(count):
        nx, ny = normal[i, 0], normal[i, 1]
        rx, ry = _reference_direction(x - references[i, 0], y - references[i, 1], nx, ny)
        cosine = rx * nx + ry * ny
        influence = 1.0 / max(gamma[i], 1.0)
        radial = (nx * vx + ny * vy) / cosine
        tangential = (rx * vy - ry * vx) / cosine * (1.0 + influence)
        if radial <= 0.0:
            radial *= 1.0 - influence
        modulated[i, 0] = radial * rx - tangential * ny
        modulated[i, 1] = radial * ry + tangential * nx
        mean_speed += weights[i] * math.hypot(modulated[i, 0], modulated[i, 1])
    ux, uy = directional_mean(vx / speed, vy / speed, modulated, weights)
    return mean_speed * ux, mean_speed * uy


@njit(cache=True)
def _reference_direction(dx, dy, nx, ny):
    """The unit vector from the reference point; the normal where, deep inside the circle, the two do not agree."""
    distance = math.hypot(dx, dy)
    if dx * nx + dy * ny <= LEAST_COSINE * distance:
        return nx, ny
    return dx / distance, dy / distance


@njit(cache=True)
def _weights(gamma):
    """Shares ~ 1/(Gamma - 1); circles that are touched share everything equally."""
    touched = gamma <= 1.0
    if touched.any():
        return touched / touched.sum()
    weights = 1.0 / (gamma - 1.0)
    return weights / weights.sum()
