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
from numba import njit

from drake_starnav.baselines.baseline_step import Situation
from drake_starnav.baselines.checks import positive, rows, vector
from drake_starnav.baselines.directional_mean import directional_mean
from drake_starnav.control.inputs import Proposal
from drake_starnav.parameters import check_parameters, parameter

MIN_DISTANCE = 1e-3
"""If a hit is nearer to the hull than this, all distances are shifted until it is this far, m."""
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
class FoaParameters:
    """Modulation away from the hits of the current scan."""

    clusters: bool = parameter(False, "modulate around clusters of hits instead of around all hits at once")
    margin: float = parameter(0.1, "clearance that is kept beyond the robot's radius", unit="m", low=0.0, high=1.0)
    max_speed: float = parameter(
        0.4, "of the nominal velocity and of the modulated one", unit="m/s", above=0.0, high=10.0
    )

    def __post_init__(self) -> None:
        check_parameters(self, "foa")

    known = False
    """It has its scan alone."""

    def propose(self, situation: Situation) -> Proposal:
        """The twist that follows `foa_velocity`, or `foa_cluster_velocity`, and its direction."""
        robot = situation.robot
        nominal = situation.nominal_velocity(min(self.max_speed, robot.max_speed))
        modulated = foa_cluster_velocity if self.clusters else foa_velocity
        velocity = modulated(situation.pose[:2], nominal, situation.points, control_radius=robot.radius + self.margin)
        return situation.followed(velocity, self.max_speed)


def foa_velocity(
    position: np.ndarray, nominal_velocity: np.ndarray, points: np.ndarray, *, control_radius: float
) -> np.ndarray:
    """The nominal velocity, modulated away from all hits at once.

    A velocity that leads away (rho . v >= 0) is returned unchanged. Exactly head-on there is no part across rho, and
    the result keeps heading into the obstacle: the method's own limitation. Hits in the robot's very centre have no
    direction and are left out. Finite arguments give a finite result.

    Args:
        position: shape (2,), W, m.
        nominal_velocity: shape (2,), W, m/s.
        points: the hits, shape (n, 2), W, m; in any order.
        control_radius: radius of the disc that is kept clear, m.

    Returns:
        shape (2,), W, m/s; never faster than the nominal velocity.

    Raises:
        StarnavError: wrong shape, a value that is not finite, or a radius that is not positive.
    """
    position, velocity, points, radius = _checked("foa_velocity: ", position, nominal_velocity, points, control_radius)
    return np.array(_foa(*position, *velocity, points, radius))


def foa_cluster_velocity(
    position: np.ndarray, nominal_velocity: np.ndarray, points: np.ndarray, *, control_radius: float
) -> np.ndarray:
    """The nominal velocity, modulated around each cluster of hits and combined by the clusters' weights.

    Clusters are found by DBSCAN (radius 2 `control_radius`, 3 samples); hits in no cluster count, as one more, where
    they are nearer than every cluster. Near an obstacle the result is slowed down by (1 + 0.8 n . v)^power; above an
    approach speed of 1.25 m/s that base is negative and the published code returns NaN. Here the base ends at 0: the
    robot stops. Clusters that surround the robot so evenly that rho vanishes have no direction and are left out, as are
    hits in its very centre. Finite arguments give a finite result.

    scikit-learn is imported on the first call. It starts OpenMP threads that cost more than they save on one scan:
    set OMP_NUM_THREADS=1 in processes that run trials side by side.

    Args:
        position: shape (2,), W, m.
        nominal_velocity: shape (2,), W, m/s.
        points: the hits, shape (n, 2), W, m; their order names the clusters.
        control_radius: radius of the disc that is kept clear, m.

    Returns:
        shape (2,), W, m/s.

    Raises:
        StarnavError: wrong shape, a value that is not finite, or a radius that is not positive.
    """
    position, velocity, points, radius = _checked(
        "foa_cluster_velocity: ", position, nominal_velocity, points, control_radius
    )
    if len(points) == 0 or not velocity.any():
        return velocity.copy()
    from sklearn.cluster import DBSCAN  # takes a second to import, and only this function needs it

    labels = DBSCAN(eps=2.0 * radius, min_samples=3).fit(points).labels_
    return np.array(_foa_cluster(*position, *velocity, points, labels.astype(np.int64), radius))


def _checked(place, position, velocity, points, radius):
    return (
        vector(position, 2, place + "position"),
        vector(velocity, 2, place + "nominal_velocity"),
        rows(points, 2, place + "points"),
        positive(radius, place + "control_radius"),
    )


@njit(cache=True)
def _foa(x, y, vx, vy, points, radius):
    """The modulated velocity (x, y) of a robot at (x, y) with a nominal one (vx, vy); see `foa_velocity`."""
    speed = math.hypot(vx, vy)
    directions, distances = _hits(x, y, points, radius)
    weights = _weights(distances, 1.0, math.inf)
    rx, ry = _away(directions, weights)
    m = math.hypot(rx, ry)
    if speed == 0.0 or m == 0.0 or rx * vx + ry * vy >= 0.0:
        return vx, vy
    rx, ry = rx / m, ry / m
    along, across = _stretching(m, 0.0)
    radial = along * (rx * vx + ry * vy)
    tangential = across * (rx * vy - ry * vx)
    length = math.hypot(radial, tangential)
    scale = speed / length if length > speed or length > CREEP_SPEED else 1.0
    return scale * (radial * rx - tangential * ry), scale * (radial * ry + tangential * rx)


@njit(cache=True)
def _foa_cluster(x, y, vx, vy, points, labels, radius):
    """The same by clusters: `labels` (n,) number those of the points, -1 for none; see `foa_cluster_velocity`."""
    speed = math.hypot(vx, vy)
    ux, uy = vx / speed, vy / speed
    directions, distances = _hits(x, y, points, radius)
    known = np.hypot(directions[:, 0], directions[:, 1]) > 0.0
    if not known.any():
        return vx, vy
    shares = _weights(distances, CLUSTER_LENGTH, CLUSTER_WEIGHT_LIMIT)

    clusters = labels.max() + 1
    modulated = np.zeros((clusters + 1, 2))
    normals = np.zeros((clusters + 1, 2))
    weights = np.zeros(clusters + 1)
    nearest_clustered = math.inf
    for k in range(clusters):
        members = (labels == k) & known
        if not members.any():
            continue
        nearest_clustered = min(nearest_clustered, distances[members].min())
        nx, ny = _away(directions[members], shares[members])
        m = math.hypot(nx, ny)
        if m == 0.0:
            continue
        nx, ny = nx / m, ny / m
        of_cluster = points[labels == k]
        rx, ry = _reference(nx, ny, x - of_cluster[:, 0].mean(), y - of_cluster[:, 1].mean(), radius)
        modulated[k, 0], modulated[k, 1] = _modulated(ux, uy, nx, ny, rx, ry, m)
        normals[k, 0], normals[k, 1] = nx, ny
        weights[k] = m

    near = (labels == -1) & known & (distances < nearest_clustered)
    if near.any():
        nx, ny = _away(directions[near], _weights(distances[near], CLUSTER_LENGTH, CLUSTER_WEIGHT_LIMIT))
        m = math.hypot(nx, ny)
        if m > 0.0:
            nx, ny = nx / m, ny / m
            modulated[clusters, 0], modulated[clusters, 1] = _modulated(ux, uy, nx, ny, nx, ny, m)
            # The published code slows down for these hits along the last cluster's normal; so does this.
            if clusters > 0:
                nx, ny = normals[clusters - 1, 0], normals[clusters - 1, 1]
            normals[clusters, 0], normals[clusters, 1] = nx, ny
            weights[clusters] = m

    if weights.sum() == 0.0:
        return vx, vy
    weights /= weights.sum()
    dx, dy = directional_mean(ux, uy, modulated, weights)
    nx, ny = (weights * normals[:, 0]).sum(), (weights * normals[:, 1]).sum()
    scale = speed * _slowdown(vx, vy, nx, ny, distances[known].min(), 2.0 * radius + 1.0)
    return scale * dx, scale * dy


@njit(cache=True)
def _hits(x, y, points, radius):
    """Unit vectors to the hits, and distances of the hits from the hull; a hit at (x, y) gets 0 and +inf."""
    directions = np.zeros((len(points), 2))
    distances = np.full(len(points), math.inf)
    for k in range(len(points)):
        dx, dy = points[k, 0] - x, points[k, 1] - y
        distance = math.hypot(dx, dy)
        if distance > 0.0:
            directions[k, 0], directions[k, 1] = dx / distance, dy / distance
            distances[k] = distance - radius
    return directions, distances


@njit(cache=True)
def _weights(distances, length, limit):
    """Weights (n,) of hits at distances (n,) from the hull, divided by their sum or the limit if above 1."""
    shift = 0.0
    if len(distances) > 0 and distances.min() < MIN_DISTANCE:
        shift = MIN_DISTANCE - distances.min()
    weights = (length / (distances + shift)) ** 2
    total = min(weights.sum(), limit)
    return weights / total if total > 1.0 else weights


@njit(cache=True)
def _away(directions, weights):
    """rho, the weighted sum of the directions away from the hits."""
    return -(weights * directions[:, 0]).sum(), -(weights * directions[:, 1]).sum()


@njit(cache=True)
def _stretching(m, leaving):
    """Scales along and across the reference direction; `leaving` is the cosine of v to the normal, if positive."""
    root = math.sqrt(m)
    across = 1.0 + math.sin(0.5 * math.pi * root) if root < 1.0 else 2.0 * math.sin(0.5 * math.pi / root)
    along = math.cos(0.5 * math.pi * root) if root < 2.0 else -1.0
    if leaving <= 0.0:
        return along, across
    # Behind an obstacle both scales become one: the direction is kept.
    closeness = min(1.0, 1.0 / m)
    free = closeness * leaving + (1.0 - closeness * leaving) * across
    both = closeness * free + (1.0 - closeness) * along
    return both, both


@njit(cache=True)
def _reference(nx, ny, rx, ry, radius):
    """The direction from a cluster's centre, turned towards the normal near the centre and at a large angle."""
    distance = math.hypot(rx, ry)
    angle = math.atan2(nx * ry - ny * rx, nx * rx + ny * ry)
    if abs(angle) > MAX_REFERENCE_ANGLE:
        folded = (math.pi - abs(angle)) / (math.pi - MAX_REFERENCE_ANGLE) * MAX_REFERENCE_ANGLE
        angle = math.copysign(folded, angle)
    angle *= min(distance / radius, 1.0)
    cosine, sine = math.cos(angle), math.sin(angle)
    return cosine * nx - sine * ny, sine * nx + cosine * ny


@njit(cache=True)
def _modulated(ux, uy, nx, ny, rx, ry, m):
    """E D E^-1 u, with E = [reference direction  tangent]; the tangent is the normal turned left."""
    along, across = _stretching(m, nx * ux + ny * uy)
    det = rx * nx + ry * ny  # cosine between reference and normal, at least cos(MAX_REFERENCE_ANGLE)
    radial = along * (nx * ux + ny * uy) / det
    tangential = across * (rx * uy - ry * ux) / det
    return radial * rx - tangential * ny, radial * ry + tangential * nx


@njit(cache=True)
def _slowdown(vx, vy, nx, ny, distance, far):
    """The share of the speed that is kept near an obstacle with the mean normal n."""
    approach = vx * nx + vy * ny
    length = math.hypot(nx, ny)
    if approach > 0.0 or length < 1e-8 or distance >= far:
        return 1.0
    if distance <= 0.0:
        return 0.0 if approach < -1e-3 else 1.0
    power = ((far - distance) / distance * length) ** (1.0 / 3.0)
    return max(0.0, 1.0 + APPROACH_SLOWDOWN * approach) ** power
