"""Map revision: regions are cut back or discarded where later observations contradict them.

An obstacle thinner than the distance between two beams is detected only from nearby, inside regions observed from
afar. If the estimated pose drifts, hits of a new scan fall inside old regions, and old hits fall into free space of the
new scan; the new scan is right about the robot's current surroundings. If the robot stalls inside the regions, they are
wrong about the place ahead of it.
"""

import dataclasses
import math
from collections.abc import Iterable

import numpy as np
from numba import njit

from drake_starnav.lidar.laser_scan import LaserScan
from drake_starnav.planning.parameters import PlannerParameters
from drake_starnav.planning.roadmap import StarRoadmap, with_nodes, without_nodes
from drake_starnav.regions.bearing_hits import half_gaps, point_hits
from drake_starnav.regions.erosion import eroded_range
from drake_starnav.regions.piecewise_cubic import fit_piecewise_cubic
from drake_starnav.regions.star_region import Fit, StarRegion

CONTRADICTION = 0.2
"""A region with hits of a new scan deeper inside than this is contradicted, m. It is twice the distance between two
beams at 5 m: smaller contradictions stem from coarse older scans."""
KEPT_SHARE = 0.7
"""A region is discarded if less than this share of its free range remains, summed over all bearings."""
SEEN_THROUGH_SHARE = 0.1
"""A node is discarded if the new scan observed free space at more than this share of its hits."""
FEWEST_HITS = 5
"""A new scan must observe free space at this many of a node's hits to contradict them."""


def lasting_hits(scan: LaserScan, pose: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Static hits of a scan taken at a pose: points, shape (k, 2), W, and their half gaps, shape (k,), m."""
    hit = scan.lasting_hits
    return scan.points_at(scan.distances, hit, pose), half_gaps(scan, scan.distances)[hit]


def cut_back(region: StarRegion, points: np.ndarray, gaps: np.ndarray, radius: float) -> np.ndarray:
    """The free range of an old region, cut back where a new scan has hits; shape (M,), m.

    Args:
        region: made from an older scan.
        points, gaps: hits of the new scan, as from `lasting_hits`.
        radius: of the robot with the region's margin, m.
    """
    within = float(region.free_range.max()) + radius + 0.1
    hits = point_hits(points, gaps, region.center, region.bearing_0, within, len(region.free_range))
    return eroded_range(hits, radius, region.free_range)


def seen_through(old: LaserScan, old_pose: np.ndarray, scan: LaserScan, pose: np.ndarray, slack: float) -> float:
    """The share of an old scan's hits around which a new scan observed free space, by `slack` (m) on all sides.

    Only hits within the new scan's range count; 0 if fewer than FEWEST_HITS of them were seen through.
    """
    distance, beam = scan.polar(old.points_at(old.distances, old.lasting_hits, old_pose), pose)
    judged = (distance < scan.range_max) & (scan.full_circle | (beam <= len(scan.ranges) - 1))
    free = _free_around(beam, distance, scan.distances, scan.angle_increment, slack, scan.full_circle)
    through = judged & (distance < free - slack)
    return 0.0 if through.sum() < FEWEST_HITS else float(through.sum() / judged.sum())


@njit(cache=True)
def _free_around(beam, distance, ranges, increment, slack, wrap):
    """The shortest range among the beams that pass within `slack` of a place at `beam` and `distance`."""
    n = len(ranges)
    out = np.full(len(beam), np.inf)
    for i in range(len(beam)):
        half = min(slack / max(distance[i], slack) / increment, 0.25 * n)
        for k in range(int(math.floor(beam[i] - half)), int(math.ceil(beam[i] + half)) + 1):
            if wrap or 0 <= k < n:
                out[i] = min(out[i], ranges[k % n])
    return out


def reconcile(
    roadmap: StarRoadmap,
    scan: LaserScan,
    pose: np.ndarray,
    parameters: PlannerParameters,
    robot_radius: float,
) -> StarRoadmap:
    """The roadmap without the parts that a new scan contradicts by more than CONTRADICTION.

    Regions are cut back where new hits lie deeper inside them than that. Nodes are discarded if too little of them
    remains or, with `drop_seen_through`, if the new scan saw through their hits. After any change, the roadmap is
    rebuilt from the remaining nodes; with `drop_seen_through` its hits are, too.

    Args:
        roadmap: the roadmap before.
        scan: the latest scan, in S.
        pose: (x, y, yaw) of S in W when it was taken.
        parameters: of the roadmap.
        robot_radius: m.
    """
    new_hits = lasting_hits(scan, pose)
    far = np.hypot(*(roadmap.stack.center - pose[:2]).T) > roadmap.stack.reach + scan.range_max
    kept: list[tuple[StarRegion, LaserScan, np.ndarray]] = []
    for region, (old, old_pose), out_of_reach in zip(roadmap.regions, roadmap.scans, far.tolist(), strict=True):
        if out_of_reach:
            kept.append((region, old, old_pose))
            continue
        if parameters.drop_seen_through and seen_through(old, old_pose, scan, pose, CONTRADICTION) > SEEN_THROUGH_SHARE:
            continue
        radius = robot_radius + region.margin
        # the disc is smaller by the slack, as a bearing that grazes a hit would lose much of its range at once
        if (region.free_range - cut_back(region, *new_hits, max(radius - CONTRADICTION, 0.0))).max() > CONTRADICTION:
            values = cut_back(region, *new_hits, radius)
            if values.sum() < KEPT_SHARE * region.free_range.sum():
                continue
            region = _with_free_range(region, values)
        kept.append((region, old, old_pose))
    if len(kept) == len(roadmap) and all(a is b for a, (b, _, _) in zip(roadmap.regions, kept, strict=True)):
        return roadmap
    return _remade(roadmap, kept, parameters, robot_radius)


def with_stall_point(
    roadmap: StarRoadmap, place: np.ndarray, parameters: PlannerParameters, robot_radius: float
) -> StarRoadmap:
    """The roadmap with regions in which the robot does not touch a place (2,) in W, as if a thin post stood there.

    Regions are made from smoothed scans with the planner's margin. If the controller certifies no motion although they
    overlap, they are wrong, and so is every path through that place. Nodes at which the robot would touch the place are
    discarded.
    """
    roadmap = dataclasses.replace(roadmap, stall_points=np.vstack((roadmap.stall_points, place)))
    nodes = [
        (clear_of(region, roadmap.stall_points, robot_radius), *seen)
        for region, seen in zip(roadmap.regions, roadmap.scans, strict=True)
        if np.hypot(*(region.center - place)) > robot_radius + region.margin
    ]
    return _remade(roadmap, nodes, parameters, robot_radius)


def clear_of(region: StarRegion, places: np.ndarray, robot_radius: float, fit: Fit = fit_piecewise_cubic) -> StarRegion:
    """The part of a region in which the robot keeps the region's margin from places (k, 2) in W."""
    if not len(places):
        return region
    radius = robot_radius + region.margin
    near = np.hypot(*(places - region.center).T) < float(region.free_range.max()) + radius
    if not near.any():
        return region
    free = region.free_range
    hits = point_hits(places[near], np.zeros(near.sum()), region.center, region.bearing_0, np.inf, len(free))
    return _with_free_range(region, eroded_range(hits, radius, free), fit)


def _with_free_range(region: StarRegion, free_range: np.ndarray, fit: Fit = fit_piecewise_cubic) -> StarRegion:
    """The region with another free range, shape (M,), m, fitted anew."""
    return dataclasses.replace(region, free_range=free_range, boundary=fit(free_range))


def _remade(
    roadmap: StarRoadmap,
    nodes: Iterable[tuple[StarRegion, LaserScan, np.ndarray]],
    parameters: PlannerParameters,
    robot_radius: float,
) -> StarRoadmap:
    """A roadmap of these nodes (region, scan, pose) that keeps its retired, closed, inspected and blocked places.

    It also keeps all hits, unless the pose may err: then only those of the nodes' scans.
    """
    forgets, kept = parameters.drop_seen_through, without_nodes(roadmap)
    if forgets:
        kept = dataclasses.replace(kept, hits=StarRoadmap.empty(parameters, robot_radius).hits)
    return with_nodes(kept, nodes, parameters, robot_radius, stamp=forgets)
