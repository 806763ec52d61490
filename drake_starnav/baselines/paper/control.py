"""The paper's controller: the vector to the short-term goal, modulated by the regions and blended near obstacles.

    p~* = sum_k w_k M_k p~,  p~ = p_sg - p,  M = E D E^-1,  w_k ~ Gamma_k
    p*  = (1 - a) p~* + a p~_n*,  a = min(rho / (|p - p_n| - r), 1)

It certifies nothing. Corrections, without which the equations have no meaning: E has r and e as columns, e is the
boundary's tangent (the printed theta-bar is a slope with its ratio inverted), theta is an atan2, a is 1 inside the
radius, where the printed one is negative, and p~_n*, which is not defined, leads away from p_n and is as long as p~*.

Source: paper, section III-C.
"""

import math

import numpy as np
from numba import njit

from drake_starnav.baselines.paper import constants
from drake_starnav.control.heading_controller import turning_law
from drake_starnav.control.inputs import ControllerInputs, Proposal
from drake_starnav.control.modulation import boundary_at
from drake_starnav.regions.region_union import RegionUnion
from drake_starnav.robot import RobotParameters
from drake_starnav.robot.limits import wrapped_angle

LARGEST_GAMMA = 1e6
"""Gamma at a reference point, where it has no bound."""


def proposal(inputs: ControllerInputs, robot: RobotParameters) -> Proposal:
    """The twist that follows the blended vector, and its direction; arguments as for `control.followed`."""
    pose, _, guidance, star = inputs
    if not len(guidance.path):
        return Proposal(np.zeros(2), np.zeros(2))
    vector = modulated_vector(pose[:2], guidance.path[0] - pose[:2], guidance.regions, constants.SIGMA)
    vector = blended_vector(pose[:2], vector, star.near_hits, robot.radius + constants.MARGIN)
    length = float(np.hypot(*vector))
    if length == 0.0:
        return Proposal(np.zeros(2), np.zeros(2))
    heading = wrapped_angle(math.atan2(vector[1], vector[0]) - pose[2])
    return Proposal(turning_law(heading, min(length, constants.SPEED, robot.max_speed), robot), vector / length)


def modulated_vector(position: np.ndarray, vector: np.ndarray, regions: RegionUnion, sigma: float) -> np.ndarray:
    """The guiding vector modulated by each region that contains the position, weighted by max(Gamma, 1).

    Without such a region, the guiding vector itself.

    Args:
        position: p, shape (2,), W, m.
        vector: p~, shape (2,), W, m.
        regions: around it.
        sigma: exponent of Gamma.

    Source: paper, eq. (modulate) to (sum_weighted).
    """
    return np.array(_modulated(*position, *vector, regions, sigma))


def blended_vector(position: np.ndarray, vector: np.ndarray, hits: np.ndarray, radius: float) -> np.ndarray:
    """The modulated vector blended with the one away from the nearest hit, shape (2,), W, m.

    Args:
        position: p, shape (2,), W, m.
        vector: p~*, shape (2,), W, m.
        hits: of the latest scan, shape (n, 2), W, m.
        radius: r, m.

    Source: paper, eq. (combine).
    """
    if not len(hits):
        return vector
    away = position - hits
    distance = np.hypot(away[:, 0], away[:, 1])
    nearest = int(np.argmin(distance))
    share = blend_share(distance[nearest] - radius)
    outward = away[nearest] / max(distance[nearest], 1e-9)
    return (1.0 - share) * vector + share * float(np.hypot(*vector)) * outward


def blend_share(clearance: float) -> float:
    """a at a distance |p - p_n| - r, m; 1 inside the radius, where the printed form is negative."""
    return 1.0 if clearance <= constants.RHO else constants.RHO / clearance


@njit(cache=True)
def _modulated(x, y, ux, uy, regions, sigma):
    """`modulated_vector` as numbers."""
    center, bearing_0, values, slopes = regions.center, regions.bearing_0, regions.values, regions.slopes
    sum_x = sum_y = total = 0.0
    for k in range(len(center)):
        dx, dy = x - center[k, 0], y - center[k, 1]
        distance = math.sqrt(dx * dx + dy * dy)
        phi, slope = boundary_at(values[k], slopes[k], bearing_0[k], math.atan2(dy, dx))
        gamma = min((phi / max(distance, 1e-9)) ** sigma, LARGEST_GAMMA)
        if gamma <= 1.0:
            continue
        vx, vy = ux, uy
        if distance > 1e-9:
            rx, ry = dx / distance, dy / distance
            tx, ty = slope * rx - phi * ry, slope * ry + phi * rx
            radial = (1.0 - 1.0 / gamma) * (ux * ty - uy * tx) / phi  # phi is the determinant of [r t]
            tangential = (1.0 + 1.0 / gamma) * (rx * uy - ry * ux) / phi
            vx, vy = radial * rx + tangential * tx, radial * ry + tangential * ty
        sum_x += gamma * vx
        sum_y += gamma * vy
        total += gamma
    if total == 0.0:
        return ux, uy
    return sum_x / total, sum_y / total
