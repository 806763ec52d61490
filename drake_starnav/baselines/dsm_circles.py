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

from drake_starnav.baselines.baseline_step import BaselineInput
from drake_starnav.control.inputs import Proposal
from drake_starnav.geometry.se2 import transform_points

PARALLEL = 1e-5
"""A direction whose cosine to the reference is nearer than this to 1 or -1 counts as parallel or opposite to it."""
LEAST_COSINE = 1e-3
"""Where the directions from reference point and centre are nearly at right angles or worse, the centre's is taken."""


def compute_directional_mean(reference: np.ndarray, vectors: np.ndarray, weights: np.ndarray) -> np.ndarray:
    """The weighted mean of directions as angles about a reference, a unit vector of shape (2,).

    A mean of vectors vanishes where two of them oppose each other; this one does not.

    Args:
        reference: unit vector from which angles are counted, shape (2,).
        vectors: shape (n, 2), of any length; those of length 0 add no angle, so their weight goes to the reference.
        weights: shape (n,), not negative, of sum 1.

    Source: Huber, Billard and Slotine, RA-L 2019, as for `make_known_obstacles`.
    """
    length = np.hypot(*vectors.T)
    is_counted = (weights > 0.0) & (length > 0.0)
    unit_vectors, weight_shares = vectors[is_counted] / length[is_counted, None], weights[is_counted]
    if len(weight_shares) == 1 and weight_shares[0] >= 1.0:
        return unit_vectors[0]
    cosine, sine = unit_vectors @ reference, reference[0] * unit_vectors[:, 1] - reference[1] * unit_vectors[:, 0]
    vector_angles = np.where(cosine < 1.0 - PARALLEL, np.arctan2(sine, cosine), 0.0)
    vector_angles[cosine <= PARALLEL - 1.0] = math.pi  # the left turn, whatever rounding says about the side
    return transform_points(np.array((0.0, 0.0, weight_shares @ vector_angles)), reference[None])[0]


@dataclass(frozen=True)
class DsmBaseline:
    """Modulation around circles that are all known.

    Attributes:
        margin: clearance that is modulated for beyond the robot's radius, m.
        max_speed: of the nominal velocity and of the modulated one, m/s.
    """

    margin: float = 0.06
    max_speed: float = 0.4
    knows_obstacles = True
    follows_roadmap = False

    def propose(self, inputs: BaselineInput) -> Proposal:
        """The twist that follows `compute_dsm_velocity`, and its direction."""
        robot, obstacles = inputs.robot, inputs.obstacles
        velocity = compute_dsm_velocity(
            inputs.pose[:2],
            inputs.compute_nominal_velocity(self.max_speed),
            obstacles.circles,
            robot_radius=robot.radius + self.margin,
            reference_points=obstacles.reference_points,
        )
        return inputs.follow(velocity, self.max_speed)


def compute_dsm_velocity(
    position: np.ndarray,
    nominal_velocity: np.ndarray,
    circles: np.ndarray,
    *,
    robot_radius: float,
    reference_points: np.ndarray | None = None,
) -> np.ndarray:
    """The nominal velocity (2,), modulated around known circles; W, m/s.

    On an inflated circle the part of the velocity into it vanishes. Inside one, where the method guarantees nothing,
    the same holds; exactly at the centre, where no direction is preferred, the result is zero. Finite arguments
    give a finite result. Overlapping circles can hold the robot in a local minimum, unless they share a reference
    point; see `make_known_obstacles`.

    Args:
        position, nominal_velocity: shape (2,), W, m and m/s.
        circles: shape (n, 3): x, y, radius; W, m.
        robot_radius: m, by which every circle is inflated.
        reference_points: shape (n, 2), W, m, a point in each inflated circle; None for the centres.
    """
    if len(circles) == 0:
        return nominal_velocity.copy()
    reference_places = circles[:, :2] if reference_points is None else reference_points
    offset, speed = position - circles[:, :2], math.hypot(*nominal_velocity)
    distance, radius = np.hypot(*offset.T), circles[:, 2] + robot_radius
    if speed == 0.0 or not distance.all():
        return np.zeros(2)
    normals = offset / distance[:, None]
    gamma = np.where(distance > radius, 1.0 + distance - radius, distance / np.maximum(radius, 1e-300))
    directions = _compute_reference_directions(position - reference_places, normals)
    cosine, influence = (directions * normals).sum(axis=1), 1.0 / np.maximum(gamma, 1.0)
    radial = normals @ nominal_velocity / cosine
    radial[radial <= 0.0] *= 1.0 - influence[radial <= 0.0]
    cross_speeds = directions[:, 0] * nominal_velocity[1] - directions[:, 1] * nominal_velocity[0]
    tangential, tangents = cross_speeds / cosine * (1.0 + influence), np.column_stack((-normals[:, 1], normals[:, 0]))
    modulated_vectors, weights = radial[:, None] * directions + tangential[:, None] * tangents, _compute_weights(gamma)
    return (
        weights
        @ np.hypot(*modulated_vectors.T)
        * compute_directional_mean(nominal_velocity / speed, modulated_vectors, weights)
    )


def _compute_reference_directions(offset: np.ndarray, normal: np.ndarray) -> np.ndarray:
    """Unit vectors (n, 2) from reference points; the normal where, deep inside a circle, the two do not agree."""
    distance = np.hypot(*offset.T)
    agree = (offset * normal).sum(axis=1) > LEAST_COSINE * distance
    return np.where(agree[:, None], offset / np.maximum(distance, 1e-300)[:, None], normal)


def _compute_weights(gamma: np.ndarray) -> np.ndarray:
    """Shares ~ 1/(Gamma - 1); circles that are touched share everything equally."""
    is_touched = gamma <= 1.0
    weights = is_touched.astype(float) if is_touched.any() else 1.0 / (gamma - 1.0)
    return weights / weights.sum()
