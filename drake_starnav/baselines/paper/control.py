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

from drake_starnav.baselines.paper import constants
from drake_starnav.control.inputs import ControllerInputs, Proposal
from drake_starnav.control.modulation import boundary_at
from drake_starnav.robot import RobotParameters
from drake_starnav.robot.base import twist_of
from drake_starnav.robot.limits import aimed, wrapped_angle
from drake_starnav.surroundings.region_union import RegionUnion

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
    speed = min(length, constants.SPEED, robot.max_speed)
    return Proposal(twist_of(aimed(heading, speed, robot.limits), robot.drive), vector / length)


def modulated_vector(position: np.ndarray, vector: np.ndarray, regions: RegionUnion, sigma: float) -> np.ndarray:
    """The guiding vector p~ (2,) at p (2,), W, m, modulated by each region that contains p, weighted by max(Gamma, 1).

    Without such a region, the guiding vector itself; `sigma` is the exponent of Gamma.

    Source: paper, eq. (modulate) to (sum_weighted).
    """
    total, weights = np.zeros(2), 0.0
    offset = position - regions.center
    distance = np.hypot(*offset.T)
    for k in np.flatnonzero(distance < regions.values.max(axis=1, initial=0.0)).tolist():
        bearing = math.atan2(offset[k, 1], offset[k, 0])
        phi, slope = boundary_at(regions.values[k], regions.slopes[k], regions.bearing_0[k], bearing)
        gamma = min((phi / max(distance[k], 1e-9)) ** sigma, LARGEST_GAMMA)
        if gamma <= 1.0:
            continue
        modulated = vector
        if distance[k] > 1e-9:
            rx, ry = outward = offset[k] / distance[k]
            tangent = slope * outward + phi * np.array((-ry, rx))
            radial = (1.0 - 1.0 / gamma) * (vector[0] * tangent[1] - vector[1] * tangent[0]) / phi  # phi = det [r t]
            tangential = (1.0 + 1.0 / gamma) * (rx * vector[1] - ry * vector[0]) / phi
            modulated = radial * outward + tangential * tangent
        total, weights = total + gamma * modulated, weights + gamma
    return total / weights if weights > 0.0 else vector


def blended_vector(position: np.ndarray, vector: np.ndarray, hits: np.ndarray, radius: float) -> np.ndarray:
    """The modulated vector p~* (2,) at p (2,) blended with the one away from the nearest of the hits (n, 2); W, m.

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
