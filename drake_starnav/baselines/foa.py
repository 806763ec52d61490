"""Fast obstacle avoidance from the current scan alone (FOA), over all hits at once or by clusters.

Hit k at distance D_k from the robot's hull, in direction u_k, weighs w_k = (c/D_k)^2. The sum rho = -sum w_k u_k points
away from what is near, and m = |rho| says how near. The velocity is split along rho and across it, and scaled:

    lambda_r = cos(pi sqrt(m)/2),   lambda_t = 1 + sin(pi sqrt(m)/2)

Source: Huber, Slotine and Billard, "Fast obstacle avoidance based on real-time sensing", RA-L 2022; the conventions
are those of the authors' package fast_obstacle_avoidance, commit 4c4f84ec, `SampledAvoider` and `SampledClusterAvoider`
with their default parameters.
"""

import math
from dataclasses import dataclass

import numpy as np

from drake_starnav.baselines.baseline_step import MIN_DISTANCE, BaselineInput
from drake_starnav.baselines.dsm_circles import compute_directional_mean
from drake_starnav.control.inputs import Proposal
from drake_starnav.geometry.se2 import transform_points

CREEP_SPEED = 0.1
"""A modulated velocity slower than this is not brought back to the nominal speed, m/s."""
CLUSTER_LENGTH = 2.0 * math.pi / 10.0
"""The length c in the weights of the clustered form, m; 1 in the sampled form."""
CLUSTER_WEIGHT_LIMIT = 1e5
"""Weights of the clustered form are divided by their sum, but at most by this."""
MAX_REFERENCE_ANGLE = 0.45 * math.pi
"""Largest angle between a cluster's normal and the direction from its centre, rad."""
APPROACH_SLOWDOWN = 0.8
"""How much the clustered form slows down per m/s of approach."""


@dataclass(frozen=True)
class FoaBaseline:
    """Modulation away from the hits of the current scan.

    Attributes:
        clusters: whether it modulates around clusters of hits instead of around all hits at once.
        follows_roadmap: whether it heads for the short-term goals of the planner instead of the goal.
        margin: clearance that is kept beyond the robot's radius, m.
        max_speed: of the nominal velocity and of the modulated one, m/s.
    """

    clusters: bool = False
    follows_roadmap: bool = False
    margin: float = 0.1
    max_speed: float = 0.4
    knows_obstacles = False

    def propose(self, inputs: BaselineInput) -> Proposal:
        """The twist that follows `compute_foa_velocity`, or `compute_foa_cluster_velocity`, and its direction."""
        nominal, radius = inputs.compute_nominal_velocity(self.max_speed), inputs.robot.radius + self.margin
        modulate = compute_foa_cluster_velocity if self.clusters else compute_foa_velocity
        velocity = modulate(inputs.pose[:2], nominal, inputs.points, control_radius=radius)
        return inputs.follow(velocity, self.max_speed)


def compute_foa_velocity(
    position: np.ndarray, nominal_velocity: np.ndarray, points: np.ndarray, *, control_radius: float
) -> np.ndarray:
    """The nominal velocity (2,), modulated away from all hits at once; never faster, W, m/s.

    A velocity that leads away (rho . v >= 0) is returned unchanged. Exactly head-on there is no part across rho, and
    the result keeps heading into the obstacle: the method's own limitation. Hits in the robot's very centre have no
    direction and are left out. Finite arguments give a finite result.

    Args:
        position, nominal_velocity: shape (2,), W, m and m/s.
        points: the hits, shape (n, 2), W, m; in any order.
        control_radius: radius of the disc that is kept clear, m.
    """
    velocity, radius = nominal_velocity, control_radius
    speed = math.hypot(*velocity)
    directions, distances = _select_hits(position, points, radius)
    vector_away = -_compute_weights(distances, 1.0, math.inf) @ directions
    nearness = math.hypot(*vector_away)
    if speed == 0.0 or nearness == 0.0 or vector_away @ velocity >= 0.0:
        return velocity.copy()
    modulated_vector = _modulate_vector(velocity, vector_away / nearness, vector_away / nearness, nearness)
    length = math.hypot(*modulated_vector)
    return modulated_vector * (speed / length) if length > min(speed, CREEP_SPEED) else modulated_vector


def compute_foa_cluster_velocity(
    position: np.ndarray, nominal_velocity: np.ndarray, points: np.ndarray, *, control_radius: float
) -> np.ndarray:
    """The nominal velocity, modulated around each cluster of hits and combined by the clusters' weights; as
    `compute_foa_velocity`.

    Clusters are found by DBSCAN (radius 2 `control_radius`, 3 samples); hits in no cluster count, as one more, where
    they are nearer than every cluster. Near an obstacle the result is slowed down by (1 + 0.8 n . v)^power; above an
    approach speed of 1.25 m/s that base is negative and the published code returns NaN. Here the base ends at 0: the
    robot stops. Clusters that surround the robot so evenly that rho vanishes have no direction and are left out, too.
    The order of the points names the clusters.

    scikit-learn is imported on the first call. It starts OpenMP threads that cost more than they save on one scan:
    set OMP_NUM_THREADS=1 in processes that run trials side by side.
    """
    velocity, radius = nominal_velocity, control_radius
    if len(points) == 0 or not velocity.any():
        return velocity.copy()
    from sklearn.cluster import DBSCAN  # takes a second to import, and only this function needs it

    labels = DBSCAN(eps=2.0 * radius, min_samples=3).fit(points).labels_
    return _around_clusters(position, velocity, points, labels, radius)


def _around_clusters(
    position: np.ndarray, velocity: np.ndarray, points: np.ndarray, labels: np.ndarray, radius: float
) -> np.ndarray:
    """The modulated velocity; `labels` (n,) number the clusters of the points, -1 for none."""
    speed = math.hypot(*velocity)
    directions, distances = _select_hits(position, points, radius)
    has_direction = directions.any(axis=1)
    if not has_direction.any():
        return velocity.copy()
    hit_weights = _compute_weights(distances, CLUSTER_LENGTH, CLUSTER_WEIGHT_LIMIT)

    clusters = int(labels.max()) + 1
    vectors, normals, weights = np.zeros((clusters + 1, 2)), np.zeros((clusters + 1, 2)), np.zeros(clusters + 1)
    nearest_clustered = distances[has_direction & (labels >= 0)].min(initial=math.inf)
    is_near = (labels == -1) & has_direction & (distances < nearest_clustered)
    for k in range(clusters + 1):  # the last one is what is in no cluster, but nearer
        is_member = is_near if k == clusters else (labels == k) & has_direction
        if k == clusters:
            hit_weights[is_member] = _compute_weights(distances[is_member], CLUSTER_LENGTH, CLUSTER_WEIGHT_LIMIT)
        vector_away = -hit_weights[is_member] @ directions[is_member]
        m = math.hypot(*vector_away)
        if m == 0.0:
            continue
        normal = vector_away / m
        reference = (
            normal
            if k == clusters
            else _compute_reference_direction(normal, position - points[labels == k].mean(axis=0), radius)
        )
        vectors[k], normals[k], weights[k] = _modulate_vector(velocity / speed, normal, reference, m), normal, m
    if weights[clusters] > 0.0 and clusters > 0:
        normals[clusters] = normals[clusters - 1]  # as in the published code

    if weights.sum() == 0.0:
        return velocity.copy()
    weights /= weights.sum()
    scale = speed * _compute_slowdown(velocity, weights @ normals, distances[has_direction].min(), 2.0 * radius + 1.0)
    return scale * compute_directional_mean(velocity / speed, vectors, weights)


def _select_hits(position: np.ndarray, points: np.ndarray, radius: float) -> tuple[np.ndarray, np.ndarray]:
    """Unit vectors to the hits, and distances of the hits from the hull; a hit at the position gets 0 and +inf."""
    offset = points - position
    distance = np.hypot(*offset.T)
    is_apart = distance > 0.0
    directions = np.divide(offset, distance[:, None], out=np.zeros_like(offset), where=is_apart[:, None])
    return directions, np.where(is_apart, distance - radius, math.inf)


def _compute_weights(distances: np.ndarray, length: float, limit: float) -> np.ndarray:
    """Weights (n,) of hits at distances (n,) from the hull, shifted until the nearest is MIN_DISTANCE away.

    They are divided by their sum or the limit if above 1.
    """
    shift = max(MIN_DISTANCE - distances.min(initial=math.inf), 0.0)
    weights = (length / (distances + shift)) ** 2
    return weights / max(min(weights.sum(), limit), 1.0)


def _compute_stretching(m: float, leaving: float) -> tuple[float, float]:
    """Scales along and across the reference direction; `leaving` is the cosine of v to the normal, if positive."""
    root = math.sqrt(m)
    scale_across = 1.0 + math.sin(0.5 * math.pi * root) if root < 1.0 else 2.0 * math.sin(0.5 * math.pi / root)
    scale_along = math.cos(0.5 * math.pi * root) if root < 2.0 else -1.0
    if leaving <= 0.0:
        return scale_along, scale_across
    # Behind an obstacle both scales become one: the direction is kept.
    closeness = min(1.0, 1.0 / m)
    free = closeness * leaving + (1.0 - closeness * leaving) * scale_across
    common_scale = closeness * free + (1.0 - closeness) * scale_along
    return common_scale, common_scale


def _compute_reference_direction(normal: np.ndarray, offset: np.ndarray, radius: float) -> np.ndarray:
    """The direction from a cluster's centre, turned towards the normal near the centre and at a large angle."""
    angle = math.atan2(normal[0] * offset[1] - normal[1] * offset[0], normal @ offset)
    if abs(angle) > MAX_REFERENCE_ANGLE:
        folded_angle = (math.pi - abs(angle)) / (math.pi - MAX_REFERENCE_ANGLE) * MAX_REFERENCE_ANGLE
        angle = math.copysign(folded_angle, angle)
    angle *= min(math.hypot(*offset) / radius, 1.0)
    return transform_points(np.array((0.0, 0.0, angle)), normal[None])[0]


def _modulate_vector(vector: np.ndarray, normal: np.ndarray, reference: np.ndarray, m: float) -> np.ndarray:
    """E D E^-1 v, with E = [reference direction  tangent]; the tangent is the normal turned left."""
    scale_along, scale_across = _compute_stretching(m, normal @ vector)
    det = reference @ normal  # cosine between reference and normal, at least cos(MAX_REFERENCE_ANGLE)
    tangential = scale_across * (reference[0] * vector[1] - reference[1] * vector[0]) / det
    return scale_along * (normal @ vector) / det * reference + tangential * np.array((-normal[1], normal[0]))


def _compute_slowdown(velocity: np.ndarray, normal: np.ndarray, distance: float, far_distance: float) -> float:
    """The share of the speed that is kept near an obstacle with the mean normal n."""
    approach_speed, length = float(velocity @ normal), math.hypot(*normal)
    if approach_speed > 0.0 or length < 1e-8 or distance >= far_distance:
        return 1.0
    if distance <= 0.0:
        return 0.0 if approach_speed < -1e-3 else 1.0
    power = ((far_distance - distance) / distance * length) ** (1.0 / 3.0)
    return max(0.0, 1.0 + APPROACH_SLOWDOWN * approach_speed) ** power
