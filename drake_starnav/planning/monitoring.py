"""Monitoring of a plan under way: most updates change nothing, so all its checks are made in one compiled call."""

import math
from typing import NamedTuple

import numpy as np

from drake_starnav.geometry.compiled import kernel
from drake_starnav.lidar.laser_scan import Beams
from drake_starnav.planning.grid import GridArrays, measure_distance_at
from drake_starnav.planning.guidance import PASSED_DISTANCE
from drake_starnav.planning.impassable import bridge_hits
from drake_starnav.planning.state import EMPTY_PATH, PlannerInput, PlannerState
from drake_starnav.surroundings.erosion import SMOOTHING_BEAMS, average_neighbours
from drake_starnav.surroundings.region_union import RegionUnion, find_covering_region, find_first_departure
from drake_starnav.surroundings.star_region import StarRegion

OUTSIDE_TOLERANCE = 0.12
"""The robot counts as outside the regions only when it is this far out, in its radii."""
PROBE_SEEN_AFTER = 1.2
"""Seeing the probe of the exit adds a node only this far from the last node, in radii."""
REPLAN_DISTANCE = 0.4
"""A blocked optimistic path triggers a new plan only this far from where the last plan was made, in radii."""
OBSTRUCTION_SLACK = 0.24
"""A hit blocks a path if it is nearer than the robot's radius minus this share of it: noise and the size of cells."""
UNCERTAIN_WITHIN = 4.8
"""Within this distance, in radii, gaps that may only appear closed are measured again."""
FACING = math.radians(30.0)
"""A robot faces a place that lies within this angle of its heading, rad."""
TURNED, TURNED_WITHIN = 0.1, 0.5
"""A robot turns if it does so by more than the first, rad, in the second, s."""


class PlanCheck(NamedTuple):
    """What the latest scan and the roadmap show of the plan.

    Attributes:
        sees_probe: whether the latest region shows the probe of the exit, far enough from the last node.
        is_outside: whether the robot has left all regions.
        is_blocked: whether the scan blocks the optimistic path from the exit on.
        passed_count: number of way points that the robot has passed, or can see past; never the last one.
        has_strayed: whether the robot, inside the union of regions, has lost the line of sight to the next way point.
        is_uncertain: whether a hit of the grid is nearer to the path close to the robot than its radius: averaged scans
            are to decide.
    """

    sees_probe: bool
    is_outside: bool
    is_blocked: bool
    passed_count: int
    has_strayed: bool
    is_uncertain: bool


def check_plan(state: PlannerState, region: StarRegion, inputs: PlannerInput) -> PlanCheck:
    """Check the plan of a state.

    Args:
        state: of the planner, maybe without a node yet.
        region: of the latest scan, clear of closures.
        inputs: the latest scan, and where the robot is.
    """
    scan, (x, y, yaw) = inputs.observation.scan, inputs.observation.pose.tolist()
    roadmap, route = state.roadmap, state.route
    frame = x, y, math.cos(yaw), math.sin(yaw)
    return PlanCheck(
        *_check(  # plain tuples are handed over six times as fast as named ones
            tuple(inputs.position.tolist()),
            distance_to(inputs.position, state.progress.node_position),
            distance_to(inputs.position, route.start),
            route.path,
            EMPTY_PATH if route.exit is None else route.exit[1:],
            route.beyond,
            tuple(roadmap.union),
            tuple(region.as_union),
            state.is_retrying,
            tuple(roadmap.grid.arrays),
            tuple(scan.beams),
            frame,
            inputs.margins.smoothing_slack,
            inputs.cover_radius,
        )
    )


def is_facing(inputs: PlannerInput, position: np.ndarray) -> bool:
    """Return whether the robot faces a position (2,) in W."""
    (x, y), (robot_x, robot_y, yaw) = position.tolist(), inputs.observation.pose.tolist()
    return math.cos(math.atan2(y - robot_y, x - robot_x) - yaw) > math.cos(FACING)


def is_turning(state: PlannerState) -> bool:
    """Return whether the robot has turned between the last two scans."""
    if len(state.recent_observations) < 2:
        return False
    previous, latest = state.recent_observations[-2:]
    turned_angle = abs(math.remainder(float(latest.pose[2] - previous.pose[2]), 2.0 * math.pi))
    return turned_angle * TURNED_WITHIN > TURNED * (latest.time - previous.time)


def distance_to(a: np.ndarray, b: np.ndarray) -> float:
    """Return the distance of two places (2,), m; of lists, which `math.dist` reads much faster than arrays."""
    return math.dist(a.tolist(), b.tolist())


@kernel
def _check(
    position, node_distance, plan_distance, path, probe, beyond, union, region, is_retrying, grid, beams, frame, slack,
    cover_radius,
):  # fmt: skip
    """Return the fields of a `PlanCheck`, as for `check_plan`.

    The robot is `node_distance` from the last node, and `plan_distance` from where the plan was made, m.
    """
    (x, y), union, region, grid = position, RegionUnion(*union), RegionUnion(*region), GridArrays(*grid)
    tolerance = OUTSIDE_TOLERANCE * cover_radius
    sees_probe = (
        node_distance > PROBE_SEEN_AFTER * cover_radius
        and len(probe) > 0
        and find_covering_region(region, probe[0, 0], probe[0, 1], 0.0) >= 0
    )
    is_outside = node_distance > tolerance and find_covering_region(union, x, y, tolerance) < 0
    if len(path) == 0:
        return sees_probe, is_outside, False, 0, False, False
    passed_count = count_passed_points(x, y, path, region if is_retrying else union, cover_radius)
    has_strayed = (
        find_covering_region(union, x, y, 0.0) >= 0
        and find_first_departure(union, (x, y), (path[passed_count, 0], path[passed_count, 1]), 0.0, cover_radius) > 0.0
    )
    is_uncertain = _is_uncertain(path, x, y, grid, cover_radius) or _is_uncertain(beyond, x, y, grid, cover_radius)
    is_blocked = False
    if plan_distance > REPLAN_DISTANCE * cover_radius and len(beyond) > 1:  # there is something beyond the probe
        beams = Beams(*beams)
        distance = average_neighbours(beams, np.int64(SMOOTHING_BEAMS), slack)
        is_blocked = is_obstructed(beyond, bridge_hits(beams, distance, frame, 2.0 * cover_radius), cover_radius)
    return sees_probe, is_outside, is_blocked, passed_count, has_strayed, is_uncertain


@kernel
def _is_uncertain(way, x, y, grid, cover_radius):
    """Return whether hits seem to close a way (k, 2) within UNCERTAIN_WITHIN of (x, y)."""
    for i in range(len(way)):
        is_near = math.hypot(way[i, 0] - x, way[i, 1] - y) < UNCERTAIN_WITHIN * cover_radius
        if is_near and measure_distance_at(grid, way[i, 0], way[i, 1]) < cover_radius:
            return True
    return False


@kernel
def count_passed_points(x, y, path, union, radius):
    """Return the number of way points that the robot at (x, y) has passed, or can see past; never the last one."""
    k = 0
    while k + 1 < len(path):
        is_near = math.hypot(path[k, 0] - x, path[k, 1] - y) < PASSED_DISTANCE * radius
        if not is_near and find_first_departure(union, (x, y), (path[k + 1, 0], path[k + 1, 1]), 0.0, radius) > 0.0:
            break
        k += 1
    return k


@kernel
def is_obstructed(path, points, cover_radius):
    """Return whether points (n, 2) that the robot must not touch block an optimistic path (k, 2), all in W, m.

    Every second point of the path counts, as its steps are shorter than the robot. The first one, the probe, does not:
    it may lie near the obstacle at which the exit was found.
    """
    distance = cover_radius - OBSTRUCTION_SLACK * cover_radius
    low_x = low_y = np.inf
    high_x = high_y = -np.inf
    for j in range(len(points)):
        x, y = points[j]
        low_x, high_x, low_y, high_y = min(low_x, x), max(high_x, x), min(low_y, y), max(high_y, y)
    for i in range(1, len(path), 2):
        x, y = path[i]
        if x < low_x - distance or x > high_x + distance or y < low_y - distance or y > high_y + distance:
            continue  # most of a long path is out of the scan's reach
        for j in range(len(points)):
            dx, dy = points[j, 0] - x, points[j, 1] - y
            if dx * dx + dy * dy < distance * distance:
                return True
    return False
