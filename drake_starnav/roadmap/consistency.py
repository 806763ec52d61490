"""Old regions held against a new scan: where the believed pose drifts, what was free may lie behind a wall by now.

A node's region and hits are in the frame in which its scan was taken. When the robot comes back, its new scan tells how
far that frame has moved: hits of the new scan then lie inside old regions, and old hits where the new scan saw free
space. The new scan is right about what surrounds the robot now.
"""

import dataclasses
import math
from collections.abc import Iterable

import numpy as np
from numba import njit

from drake_starnav.roadmap.parameters import PlannerParameters
from drake_starnav.roadmap.roadmap import StarRoadmap, extended
from drake_starnav.scan import LaserScan
from drake_starnav.stars.free_range import eroded_range, half_gaps, point_hits
from drake_starnav.stars.region import StarRegion, fit_region

KEPT_SHARE = 0.7
"""A region of which less than this share of its reach is left, summed over all bearings, is dropped."""
SEEN_THROUGH_SHARE = 0.1
"""A node of whose hits more than this share lie in space that the new scan saw free is dropped."""
FEWEST_HITS = 5
"""Fewer hits in free space than this contradict nothing."""


def cut_back(region: StarRegion, scan: LaserScan, pose: np.ndarray, radius: float) -> np.ndarray:
    """The free range of an old region as far as a new scan allows, shape (M,), m.

    Args:
        region: made from an older scan.
        scan: the new one, in S.
        pose: (x, y, yaw) of S in W when it was taken.
        radius: of the robot with the region's margin, m.
    """
    points, gaps = scan.points(pose), half_gaps(scan, scan.distances)[scan.hits]
    within = float(region.free_range.max()) + radius + 0.1
    hits = point_hits(points, gaps, region.center, region.bearing_0, within, len(region.free_range))
    return eroded_range(hits, radius, region.free_range)


def seen_through(old: LaserScan, old_pose: np.ndarray, scan: LaserScan, pose: np.ndarray, slack: float) -> float:
    """The share of an old scan's hits that lie in the midst of what a new scan saw free: by `slack` (m) on all sides.

    Only hits in the new scan's reach count; 0 where too few of them contradict it.
    """
    offset = old.points(old_pose) - pose[:2]
    distance = np.hypot(offset[:, 0], offset[:, 1])
    bearing = np.mod(np.arctan2(offset[:, 1], offset[:, 0]) - pose[2] - scan.angle_min, 2.0 * np.pi)
    beam = bearing / scan.angle_increment
    judged = (distance < scan.range_max) & (scan.full_circle | (beam <= len(scan.ranges) - 1))
    free = _free_around(beam, distance, scan.distances, scan.angle_increment, slack, scan.full_circle)
    through = judged & (distance < free - slack)
    return 0.0 if through.sum() < FEWEST_HITS else float(through.sum() / judged.sum())


@njit(cache=True)
def _free_around(beam, distance, ranges, increment, slack, wrap):
    """The shortest range among the beams that pass a place at `beam` and `distance` within `slack`."""
    n = len(ranges)
    out = np.full(len(beam), np.inf)
    for i in range(len(beam)):
        half = min(slack / max(distance[i], slack) / increment, 0.25 * n)
        for k in range(int(math.floor(beam[i] - half)), int(math.ceil(beam[i] + half)) + 1):
            if wrap or 0 <= k < n:
                out[i] = min(out[i], ranges[k % n])
    return out


def reconciled(
    roadmap: StarRoadmap,
    scan: LaserScan,
    pose: np.ndarray,
    parameters: PlannerParameters,
    robot_radius: float,
) -> StarRoadmap:
    """The roadmap without what a new scan contradicts by more than `parameters.contradiction`.

    Regions are cut back where the new hits cut deeper into them than that; nodes of which too little is left, or whose
    hits the new scan saw through, are dropped. If any was, the map is built anew from the rest, hits and all.

    Args:
        roadmap: before.
        scan: the latest, in S.
        pose: (x, y, yaw) of S in W when it was taken.
        parameters: of the roadmap; with `contradiction` 0 the roadmap stays.
        robot_radius: m.
    """
    slack = parameters.contradiction
    if slack <= 0.0:
        return roadmap
    kept: list[tuple[StarRegion, LaserScan, np.ndarray]] = []
    for region, (old, old_pose) in zip(roadmap.regions, roadmap.scans, strict=True):
        far = np.hypot(*(region.center - pose[:2])) > region.reach + scan.range_max
        if far:
            kept.append((region, old, old_pose))
            continue
        if seen_through(old, old_pose, scan, pose, slack) > SEEN_THROUGH_SHARE:
            continue
        radius = robot_radius + region.margin
        # with a disc that is smaller by the slack: a bearing that grazes a hit loses much by little
        if (region.free_range - cut_back(region, scan, pose, max(radius - slack, 0.0))).max() > slack:
            values = cut_back(region, scan, pose, radius)
            if values.sum() < KEPT_SHARE * region.free_range.sum():
                continue
            narrower = dataclasses.replace(parameters, margin=region.margin)
            region = fit_region((values, region.limit), region.center, region.bearing_0, narrower)
        kept.append((region, old, old_pose))
    if len(kept) == len(roadmap) and all(a is b for a, (b, _, _) in zip(roadmap.regions, kept, strict=True)):
        return roadmap
    return _remade(roadmap, kept, parameters, robot_radius)


def blocked(roadmap: StarRoadmap, place: np.ndarray, parameters: PlannerParameters, robot_radius: float) -> StarRoadmap:
    """The roadmap with no region that lets the robot touch a place (2,) in W, as if a thin post stood there.

    Regions are made from smoothed scans with the planner's margin; where the controller certifies no motion from place
    to place although they overlap, they are wrong for this robot, and so is every path through there. Nodes at which it
    would touch the place are dropped.
    """
    roadmap = dataclasses.replace(roadmap, blocked=np.vstack((roadmap.blocked, place)))
    nodes = [
        (clear_of(region, roadmap.blocked, parameters, robot_radius), *seen)
        for region, seen in zip(roadmap.regions, roadmap.scans, strict=True)
        if np.hypot(*(region.center - place)) > robot_radius + region.margin
    ]
    return _remade(roadmap, nodes, parameters, robot_radius)


def clear_of(region: StarRegion, places: np.ndarray, parameters: PlannerParameters, robot_radius: float) -> StarRegion:
    """The part of a region in which the robot stays off places (k, 2) in W, with the region's margin."""
    radius = robot_radius + region.margin
    near = np.hypot(*(places - region.center).T) < float(region.free_range.max()) + radius
    if not near.any():
        return region
    free = region.free_range
    hits = point_hits(places[near], np.zeros(near.sum()), region.center, region.bearing_0, np.inf, len(free))
    narrower = dataclasses.replace(parameters, margin=region.margin)
    return fit_region((eroded_range(hits, radius, free), region.limit), region.center, region.bearing_0, narrower)


def _remade(
    roadmap: StarRoadmap,
    nodes: Iterable[tuple[StarRegion, LaserScan, np.ndarray]],
    parameters: PlannerParameters,
    robot_radius: float,
) -> StarRoadmap:
    """A roadmap of these nodes (region, scan, pose) that keeps what was tried in vain."""
    out = dataclasses.replace(
        StarRoadmap.empty(parameters, robot_radius),
        margin=roadmap.margin,
        retired=roadmap.retired,
        closed=roadmap.closed,
        looked=roadmap.looked,
        blocked=roadmap.blocked,
    )
    for region, scan, pose in nodes:
        out = extended(out, region, scan, pose, parameters, robot_radius)
    return out
