"""III-B.2: frontier points, in the middle between neighbouring clusters of hits."""

import math
from typing import NamedTuple

import numpy as np

from drake_starnav.lidar.laser_scan import LaserScan
from drake_starnav.paper import choices
from drake_starnav.surroundings.star_region import StarRegion


class SidePoints(NamedTuple):
    """The side points of neighbouring clusters, pair by pair in the sensor frame.

    Attributes:
        last: the one of cluster i with the largest bearing, shape (n,): bearings, rad.
        first: the one of cluster i + 1 with the smallest, shape (n,), at least `last`: the seam is passed.
        midpoint: the geometric midpoint of both, shape (n, 2), m.
    """

    last: np.ndarray
    first: np.ndarray
    midpoint: np.ndarray


def identify_frontier_points(region: StarRegion, scan: LaserScan, pose: np.ndarray) -> np.ndarray:
    """Line 3 of Algorithm 1: F <- identify frontier points with L, shape (n, 2), W, m.

    Each lies at the bearing `frontier_bearing`, as far away as the midpoint of its side points, and on the inverse of
    Eq. (2): p_f = p_ref + d (cos theta_f, sin theta_f). Corrected: across a wide opening the midpoint is at or behind
    the robot, and is replaced by a share of the range; one beyond the boundary moves inside.
    """
    used_range = min(choices.RANGE, scan.range_max)
    sides = find_side_points(scan, used_range)
    is_wide = sides.first - sides.last > choices.WIDE_OPENING
    theta = np.where(is_wide, compute_mean_bearing(sides), frontier_bearing(sides)) + pose[2]
    distance = np.where(is_wide, choices.WIDE_SHARE * used_range, np.hypot(*sides.midpoint.T))
    distance = np.minimum(distance, region.phi(theta) - choices.INSET)
    found_points = region.center + distance[:, None] * np.column_stack((np.cos(theta), np.sin(theta)))
    return found_points[distance > choices.ARRIVAL]


def find_side_points(scan: LaserScan, reach: float) -> SidePoints:
    """III-B.2: without the points at maximum range, DBSCAN clusters the rest; the outermost of a cluster are its sides.

    Corrected: a cluster that surrounds the robot, or another cluster, has no outermost points; hence a cluster also
    ends where its next hit by bearing is farther away than eps. None ends at the seam of -pi and pi.
    """
    is_hit = scan.hits & (scan.distances < reach)
    if is_hit.sum() < choices.MIN_SAMPLES:
        return SidePoints(np.zeros(0), np.zeros(0), np.zeros((0, 2)))
    from sklearn.cluster import DBSCAN  # imported here because it loads slowly and starts threads

    bearing = scan.bearings[is_hit]
    points = scan.distances[is_hit][:, None] * np.column_stack((np.cos(bearing), np.sin(bearing)))
    labels = DBSCAN(eps=choices.EPS, min_samples=int(choices.MIN_SAMPLES)).fit(points).labels_
    bearing, points, labels = bearing[labels >= 0], points[labels >= 0], labels[labels >= 0]
    next_points = np.roll(points, -1, axis=0)
    ends_cluster = (np.hypot(*(next_points - points).T) > choices.EPS) | (np.roll(labels, -1) != labels)
    if not scan.full_circle:
        ends_cluster[-1:] = False
    last_bearings = bearing[ends_cluster]
    first_bearings = last_bearings + (np.roll(bearing, -1)[ends_cluster] - last_bearings) % (2.0 * math.pi)
    return SidePoints(last_bearings, first_bearings, 0.5 * (points + next_points)[ends_cluster])


def compute_mean_bearing(sides: SidePoints) -> np.ndarray:
    """Eq. (5): theta_f = (theta_smax^i + theta_smin^(i+1)) / 2, shape (n,), rad.

    As printed, but across the seam, where the printed mean points to the other side.
    """
    return 0.5 * (sides.last + sides.first)


def compute_midpoint_bearing(sides: SidePoints) -> np.ndarray:
    """Return the bearing of the midpoints, shape (n,), rad: the text before Eq. (5), "their geometric midpoint"."""
    return np.arctan2(sides.midpoint[:, 1], sides.midpoint[:, 0])


frontier_bearing = compute_mean_bearing
"""The reading of Eq. (5) and its text that is used; see `choices.FRONTIER_BEARING`."""
