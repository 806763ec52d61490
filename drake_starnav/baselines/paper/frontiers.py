"""The paper's frontier points: between clusters of hits."""

import math

import numpy as np

from drake_starnav.baselines.paper import constants
from drake_starnav.lidar.laser_scan import LaserScan
from drake_starnav.surroundings.star_region import StarRegion

INSET = 0.05
"""A frontier point lies at least this far inside the boundary of its region, m."""
WIDE_OPENING, WIDE_SHARE = 0.9 * math.pi, 0.6
"""Across a wider opening, rad, the midpoint is at or behind the robot; a point on the bisector at this share of the
range replaces it."""


def frontier_points(region: StarRegion, scan: LaserScan, pose: np.ndarray) -> np.ndarray:
    """Midpoints of the side points of neighbouring clusters, shape (n, 2), W, m.

    Hits are clustered by DBSCAN, which also removes outliers. Side points are the ends of a cluster in bearing.
    Corrections: a cluster that surrounds the robot, or another cluster, has no ends; hence a cluster also ends where
    the next hit of it in bearing is farther away than eps. None ends at the +-pi seam. Wide openings have no midpoint.
    A midpoint beyond the boundary moves onto it, along its bearing.

    Source: paper, section III-B.2.
    """
    reach = min(constants.RANGE, scan.range_max)
    hit = scan.hits & (scan.distances < reach)
    if hit.sum() < constants.MIN_SAMPLES:
        return np.zeros((0, 2))
    from sklearn.cluster import DBSCAN  # imported here because it loads slowly and starts threads

    bearing = scan.bearings[hit]
    points = scan.distances[hit][:, None] * np.column_stack((np.cos(bearing), np.sin(bearing)))
    labels = DBSCAN(eps=constants.EPS, min_samples=int(constants.MIN_SAMPLES)).fit(points).labels_
    bearing, points, labels = bearing[labels >= 0], points[labels >= 0], labels[labels >= 0]
    following = np.roll(points, -1, axis=0)
    ends = (np.hypot(*(following - points).T) > constants.EPS) | (np.roll(labels, -1) != labels)
    if not scan.full_circle:
        ends[-1:] = False
    middle = 0.5 * (points + following)[ends]
    opening = ((np.roll(bearing, -1) - bearing) % (2.0 * math.pi))[ends]
    theta = np.where(opening > WIDE_OPENING, bearing[ends] + 0.5 * opening, np.arctan2(middle[:, 1], middle[:, 0]))
    theta = theta + pose[2]
    radius = np.where(opening > WIDE_OPENING, WIDE_SHARE * reach, np.hypot(*middle.T))
    radius = np.minimum(radius, region.phi(theta) - INSET)
    found = region.center + radius[:, None] * np.column_stack((np.cos(theta), np.sin(theta)))
    return found[radius > constants.ARRIVAL]
