"""The paper's frontiers: between clusters of hits."""

import math

import numpy as np

from drake_starnav.lidar.laser_scan import LaserScan
from drake_starnav.planning.frontiers import PROBE_DISTANCE, Frontiers
from drake_starnav.regions.star_region import StarRegion

CLUSTER_RADIUS, CLUSTER_POINTS = 0.2, 2
"""DBSCAN's eps, m, and min_samples, of which the paper gives none."""


def cluster_frontiers(region: StarRegion, scan: LaserScan, pose: np.ndarray, owner: int) -> Frontiers:
    """The paper's frontiers: midway between the ends of neighbouring clusters of hits.

    Hits are clustered by DBSCAN; the two outermost points of a cluster are its side points. A cluster that crosses
    the +-pi seam is one cluster. A midpoint outside the region is pulled back inside. Across an opening of more than
    0.9 pi the midpoint is meaningless; a point on the bisector at 0.6 of the range replaces it. The probe lies
    PROBE_DISTANCE farther out than the stand.

    Source: paper, section III-C.
    """
    hit = scan.hits
    if hit.sum() < 3:
        return Frontiers.none()
    from sklearn.cluster import DBSCAN  # imported here because it loads slowly and starts threads

    bearing, distance = scan.bearings[hit], scan.distances[hit]
    points = distance[:, None] * np.column_stack((np.cos(bearing), np.sin(bearing)))
    labels = DBSCAN(eps=CLUSTER_RADIUS, min_samples=CLUSTER_POINTS).fit(points).labels_
    sides = _cluster_sides(bearing, distance, labels)
    found = []
    for k, (_, _, angle_1, distance_1) in enumerate(sides):
        angle_2, distance_2, _, _ = sides[(k + 1) % len(sides)]
        opening = (angle_2 - angle_1) % (2.0 * math.pi)
        if opening < 1.5 * scan.angle_increment or (opening > 1.5 * math.pi and len(sides) > 1):
            continue  # no beam in between: one closed cluster, or clusters that overlap in bearing
        side_1 = distance_1 * np.array([math.cos(angle_1), math.sin(angle_1)])
        side_2 = distance_2 * np.array([math.cos(angle_2), math.sin(angle_2)])
        middle = 0.5 * (side_1 + side_2)
        if opening > 0.9 * math.pi:
            middle = 0.6 * scan.range_max * np.array([math.cos(angle_1 + opening / 2), math.sin(angle_1 + opening / 2)])
        theta = math.atan2(middle[1], middle[0]) + pose[2]
        radius = min(float(np.hypot(*middle)), float(region.phi(theta)) - PROBE_DISTANCE)
        if radius > 0.3:
            found.append((radius, theta))
    if not found:
        return Frontiers.none()
    radius, theta = np.array(found).T
    ray = np.column_stack((np.cos(theta), np.sin(theta)))
    stand = region.center + radius[:, None] * ray
    return Frontiers(stand, stand + PROBE_DISTANCE * ray, np.full(len(found), owner))


def _cluster_sides(bearing: np.ndarray, distance: np.ndarray, labels: np.ndarray) -> list[tuple]:
    """Per cluster, ordered by bearing: first bearing and distance, last bearing and distance, counter-clockwise."""
    sides = []
    for label in range(labels.max() + 1):
        angle, length = bearing[labels == label], distance[labels == label]
        gap = np.diff(np.append(angle, angle[0] + 2.0 * math.pi))
        last = int(np.argmax(gap))  # the widest gap is where the cluster is open, across the seam or not
        first = (last + 1) % len(angle)
        sides.append((angle[first], length[first], angle[last], length[last]))
    return sorted(sides)
