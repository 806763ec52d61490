"""Where tracked obstacles will be, straight on and reflected off static ones, and from where others may come.

An obstacle keeps its velocity; where it would run into a static obstacle, it is assumed to bounce off like a ball.
Neither needs to be true: it is the best guess for planning, and the certificate does not rely on it. Using
a measured turning rate makes the guess worse, even for obstacles that wind: the rate is too uncertain. Lengths are
of persons: nature.
"""

import math

import numpy as np

from drake_starnav.geometry.compiled import kernel
from drake_starnav.lidar.laser_scan import LaserScan

HORIZON = 3.0
"""How far ahead trajectories are predicted, s."""
PREDICTION_LEAD = 0.3
"""Trajectories extend this far beyond the horizon, so that they last until the next scan, s."""
PREDICTION_STEP = 0.1
"""Time between two predicted positions, s."""
PREDICTION_STEPS = math.ceil((HORIZON + PREDICTION_LEAD) / PREDICTION_STEP - 1e-9) + 1
PREDICTED_TIME = PREDICTION_STEP * PREDICTION_STEPS
"""Number of predicted positions after the present one, and how far they reach, s."""
OCCLUSION_SPACING = 0.15
"""Where the ranges of neighbouring beams differ by more than this, m, something may hide behind the nearer hit. The
places on the ray between the two have this spacing."""


@kernel
def predict_trajectories(position, velocity, radius, walls):
    """Return predicted positions of discs, (n, k, 2), W, m: now and then every PREDICTION_STEP, beyond the horizon.

    Args:
        position, velocity, radius: shape (n, 2), (n, 2) and (n,), of the discs now, W, m and m/s.
        walls: shape (m, 2), points on static obstacles, which discs bounce off, W, m.
    """
    steps = PREDICTION_STEPS
    n = len(radius)
    trajectories = np.empty((n, steps + 1, 2))
    for k in range(n):
        x, y, vx, vy = position[k, 0], position[k, 1], velocity[k, 0], velocity[k, 1]
        farthest_distance = radius[k] + math.hypot(vx, vy) * PREDICTION_STEP * steps
        near_walls = np.empty((len(walls), 2))
        m = 0
        for q in range(len(walls)):
            if (walls[q, 0] - x) ** 2 + (walls[q, 1] - y) ** 2 < farthest_distance * farthest_distance:
                near_walls[m] = walls[q]
                m += 1
        trajectories[k, 0, 0], trajectories[k, 0, 1] = x, y
        for i in range(1, steps + 1):
            x += vx * PREDICTION_STEP
            y += vy * PREDICTION_STEP
            closest, nx, ny = radius[k], 0.0, 0.0
            for q in range(m):
                dx, dy = x - near_walls[q, 0], y - near_walls[q, 1]
                distance = math.hypot(dx, dy)
                if distance < closest and vx * dx + vy * dy < 0.0:
                    closest, nx, ny = distance, dx / max(distance, 1e-9), dy / max(distance, 1e-9)
            if closest < radius[k]:
                normal_speed = vx * nx + vy * ny
                vx, vy = vx - 2.0 * normal_speed * nx, vy - 2.0 * normal_speed * ny
            trajectories[k, i, 0], trajectories[k, i, 1] = x, y
    return trajectories


def add_radius(places: np.ndarray, radius: float) -> np.ndarray:
    """Places with their radius: x, y and radius, shape (n, 3), of points, shape (n, 2), or with more radius, m."""
    radii = places[:, 2:] + radius if places.shape[1] == 3 else np.full((len(places), 1), radius)
    return np.hstack((places[:, :2], radii))


def find_occlusion_points(scan: LaserScan, pose: np.ndarray) -> np.ndarray:
    """Places along the rays past the edges of occluding surfaces, with their radius, shape (n, 3), W, m.

    An obstacle that comes out crosses such a ray, no farther than OCCLUSION_SPACING / 2 from a place.
    The scan was taken at a pose of S in W.
    """
    bearing_0 = float(pose[2]) + scan.angle_min
    places = _find_occlusion_points(scan.distances, scan.angle_increment, scan.full_circle, *pose[:2], bearing_0)
    return add_radius(places, 0.5 * OCCLUSION_SPACING)


def find_view_edges(scan: LaserScan, pose: np.ndarray) -> np.ndarray:
    """As `find_occlusion_points`, along the first and the last ray of a view; none if it is all around."""
    if scan.full_circle:
        return np.zeros((0, 3))
    rays = []
    for k, bearing in ((0, scan.angle_min), (-1, scan.angle_max)):
        distances_along, bearing = np.arange(0.0, scan.distances[k], OCCLUSION_SPACING), bearing + float(pose[2])
        rays.append(pose[:2] + distances_along[:, None] * (math.cos(bearing), math.sin(bearing)))
    return add_radius(np.vstack(rays), 0.5 * OCCLUSION_SPACING)


def is_seen_free(
    scan: LaserScan, pose: np.ndarray, places: np.ndarray, added_radius: float
) -> tuple[np.ndarray, np.ndarray]:
    """Whether a scan at a pose of S in W shows places with their radius, (n, 3), to be free; shape (n,) each, bool.

    First: all of the disc, with this much more radius, m, is seen free. Second: as far as the lidar looks there; also
    where it does not look at the middle.
    """
    distance, middle_beam = scan.polar(places[:, :2], pose)
    return _is_seen_free(scan.beams, distance, middle_beam, places[:, 2] + added_radius)


@kernel
def _is_seen_free(beams, distance, middle_beam, radius):
    """The loop of `is_seen_free` over discs (n,): their distance, m, the beam to each, a real index, and radius, m."""
    n, is_full_circle = len(beams.distances), beams.seam < np.inf
    disc_is_free, looked_part_is_free = np.zeros(len(radius), np.bool_), np.zeros(len(radius), np.bool_)
    for i in range(len(radius)):
        if distance[i] <= radius[i]:
            continue
        half = math.asin(radius[i] / distance[i]) / beams.increment
        if not is_full_circle and middle_beam[i] > n - 1:
            looked_part_is_free[i] = True
            continue
        disc_is_free[i], looked_part_is_free[i] = True, True
        for m in range(math.floor(middle_beam[i] - half), math.ceil(middle_beam[i] + half) + 1):
            if is_full_circle or 0 <= m < n:
                looked_part_is_free[i] &= beams.distances[m % n] >= distance[i] + radius[i]
            else:
                disc_is_free[i] = False
        disc_is_free[i] &= looked_part_is_free[i]
    return disc_is_free, looked_part_is_free


@kernel
def _find_occlusion_points(distance, increment, is_full_circle, x, y, bearing_0):
    """Points (k, 2) behind the edges between beams of distances (n,), of a sensor at (x, y)."""
    n = len(distance)
    places = []
    for k in range(n if is_full_circle else n - 1):
        a, b = distance[k], distance[(k + 1) % n]
        if abs(a - b) < OCCLUSION_SPACING:
            continue
        theta = bearing_0 + (k + 0.5) * increment
        r, end_range = min(a, b) + 0.5 * OCCLUSION_SPACING, max(a, b)
        while r < end_range + 0.5 * OCCLUSION_SPACING:
            places.append((x + r * math.cos(theta), y + r * math.sin(theta)))
            r += OCCLUSION_SPACING
    occlusion_points = np.empty((len(places), 2))
    for k in range(len(places)):
        occlusion_points[k, 0], occlusion_points[k, 1] = places[k]
    return occlusion_points
