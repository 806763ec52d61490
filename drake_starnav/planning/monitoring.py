"""Monitoring of a plan under way: most updates change nothing, so all its checks are made in one compiled call."""

import math
from typing import NamedTuple

import numpy as np
from numba import njit

from drake_starnav.planning.guidance import PASSED_DISTANCE
from drake_starnav.planning.impassable import bridged_ends
from drake_starnav.planning.optimistic_path import is_obstructed
from drake_starnav.planning.state import EMPTY_PATH, PlannerInput, PlannerState, PlannerStatus
from drake_starnav.planning.string_pulling import last_in_sight
from drake_starnav.regions.erosion import SMOOTHING_BEAMS, moving_average
from drake_starnav.regions.region_union import cover_at, first_gap
from drake_starnav.regions.star_region import StarRegion

OUTSIDE_TOLERANCE = 0.03
"""The robot counts as outside the regions only when it is this far out, m."""
PROBE_SEEN_AFTER = 0.3
"""Seeing the probe of the target adds a node only this far from the last node, m."""
REPLAN_DISTANCE = 0.1
"""A blocked optimistic path triggers a new plan only this far from where the last plan was made, m."""


class PlanCheck(NamedTuple):
    """What the latest scan and the roadmap show of the plan.

    Attributes:
        sees_probe: whether the latest region shows the target's probe, far enough from the last node.
        outside: whether the robot has left all regions.
        obstructed: whether the scan blocks the optimistic path from the target on.
        passed: number of way points that the robot has passed, or can see past; never the last one.
        strayed: whether the robot, inside the union of regions, has lost the line of sight to the next way point.
        ahead: index of the last point of the next segment in sight inside the latest region; -1 while there is none,
            and on the way to another way point or to the goal.
    """

    sees_probe: bool
    outside: bool
    obstructed: bool
    passed: int
    strayed: bool
    ahead: int


def check_plan(state: PlannerState, region: StarRegion, inputs: PlannerInput) -> PlanCheck:
    """Check the plan of a state.

    Args:
        state: with at least one node.
        region: of the latest scan, clear of stall points.
        inputs: the latest scan, and where the robot is.
    """
    scan, pose = inputs.observation.scan, inputs.observation.pose.tolist()
    place = pose[0], pose[1], math.cos(pose[2]), math.sin(pose[2])
    x, y = inputs.position.tolist()
    driven, since_plan = (
        distance_to(inputs.position, state.node_position),
        distance_to(inputs.position, state.plan_position),
    )
    plan = (
        state.path,
        EMPTY_PATH if state.target is None else state.target[1:],
        state.optimistic_path if since_plan > REPLAN_DISTANCE else EMPTY_PATH,
        state.next_segment if state.status is PlannerStatus.EXPLORING else EMPTY_PATH,
    )
    seen = scan.beams, place, inputs.margins.smoothing_slack
    unions = state.roadmap.union, region.alone, region.alone if state.doubting else state.roadmap.union
    return PlanCheck(*_checked((x, y), driven, plan, unions, seen, inputs.robot_radius))


def points_ahead(points: np.ndarray, region: StarRegion, position: np.ndarray) -> int:
    """Index of the last of points (k, 2) in W in line of sight from a position (2,) inside a region, or -1."""
    return int(last_in_sight(points, *position.tolist(), region.alone))


def distance_to(a: np.ndarray, b: np.ndarray) -> float:
    """Distance of two places (2,), m; from lists, which `math.dist` reads several times faster than arrays."""
    return math.dist(a.tolist(), b.tolist())


@njit(cache=True)
def _checked(position, driven, plan, unions, seen, robot_radius):
    """The loop of `check_plan`: the fields of a `PlanCheck`."""
    (x, y), (path, probe, optimistic, segment), (union, here, sight) = position, plan, unions
    sees_probe = driven > PROBE_SEEN_AFTER and len(probe) > 0 and cover_at(here, probe[0, 0], probe[0, 1], 0.0) >= 0
    outside = driven > OUTSIDE_TOLERANCE and cover_at(union, x, y, OUTSIDE_TOLERANCE) < 0
    if len(path) == 0:
        return sees_probe, outside, False, 0, False, -1
    passed = passed_points(x, y, path, sight)
    strayed = (
        cover_at(union, x, y, 0.0) >= 0 and first_gap(union, position, (path[passed, 0], path[passed, 1]), 0.0) > 0.0
    )
    ahead = last_in_sight(segment, x, y, here) if passed == len(path) - 1 else -1
    obstructed = False
    if len(optimistic) > 1:  # there is something beyond the probe
        beams, place, slack = seen
        distance = moving_average(beams, SMOOTHING_BEAMS, slack)
        obstructed = is_obstructed(optimistic, bridged_ends(beams, distance, place, 2.0 * robot_radius), robot_radius)
    return sees_probe, outside, obstructed, passed, strayed, ahead


@njit(cache=True)
def passed_points(x, y, path, union):
    """Number of way points that the robot at (x, y) has passed, or can see past; never the last one."""
    k = 0
    while k + 1 < len(path):
        near = math.hypot(path[k, 0] - x, path[k, 1] - y) < PASSED_DISTANCE
        if not near and first_gap(union, (x, y), (path[k + 1, 0], path[k + 1, 1]), 0.0) > 0.0:
            break
        k += 1
    return k
