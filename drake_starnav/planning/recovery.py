"""Recovery from dead ends: which targets are given up, and which place a stalled robot marks as blocked."""

import dataclasses
import math

import numpy as np

from drake_starnav.geometry.polyline import distance_to_segment
from drake_starnav.planning.cost_field import BLACKLIST_RADIUS
from drake_starnav.planning.frontiers import ARRIVAL_DISTANCE
from drake_starnav.planning.guidance import PASSED_DISTANCE
from drake_starnav.planning.impassable import narrowest_place
from drake_starnav.planning.parameters import PlannerParameters
from drake_starnav.planning.roadmap import StarRoadmap, blacklist_target
from drake_starnav.planning.search import cost_at_robot
from drake_starnav.planning.state import EMPTY_PATH, PlannerInput, PlannerState
from drake_starnav.regions.erosion import smoothed_distances
from drake_starnav.regions.scan_averaging import AVERAGED_WITHIN, mean_scan
from drake_starnav.regions.star_region import StarRegion

STALL_POINT_AHEAD = 0.05
"""A blocked place lies this far ahead of the robot, beyond radius and margin, m."""
FACING = math.radians(30.0)
"""A robot faces a place that lies within this angle of its heading, rad."""
CAME_STRAIGHT = 1.5
"""Places that the robot drove over are not blocked. Between nodes no farther apart than so many node spacings it drove
in a straight line."""
INSPECTION_DETOUR = 1.0
"""A target is inspected from its very viewpoint if giving it up would lengthen the optimistic path by more than this,
m."""
AVERAGED_SCANS = 16
"""A place is closed by the mean of so many scans, which nearly removes the bias of the nearest hit, and by hits that at
least half of them confirm."""
INSPECTED_WITHIN = 2.0
"""An inspection counts within this many arrival distances of where it was made."""


def has_arrived(state: PlannerState, region: StarRegion, inputs: PlannerInput) -> bool:
    """Whether the robot has arrived at its target; after an inspection in vain, at its very viewpoint.

    Where it doubts, it has arrived once the latest region leads on.
    """
    if state.target is None:
        return False
    away = math.dist(inputs.position.tolist(), state.target[0].tolist())
    if not away < ARRIVAL_DISTANCE:
        return False
    if state.doubting:
        return _shows(region, state.target[1], inputs.parameters.grid_resolution)
    return away < PASSED_DISTANCE or not _has_inspected(state.roadmap, inputs)


def too_narrow(state: PlannerState, inputs: PlannerInput) -> np.ndarray:
    """What shows that a robot which doubts does not fit on its way past the target, shape (n, 2), W, m; or nothing.

    That is where two hits on both sides of the way are nearer to each other than its diameter: the hits around the
    robot and the place between those two. The latest scans are averaged, since the nearest of the many hits in a single
    one is too near by the errors of most.
    """
    if not state.doubting or state.target is None or len(state.recent) < AVERAGED_SCANS:
        return EMPTY_PATH
    scan, count = mean_scan(state.recent, inputs.robot_radius + AVERAGED_WITHIN)
    distance = smoothed_distances(scan, inputs.margins.smoothing_slack)
    hits = scan.points_at(distance, scan.hits & (2 * count > AVERAGED_SCANS), state.recent[-1].pose)
    way = np.vstack((inputs.position, state.path, state.optimistic_path))
    narrow = narrowest_place(hits, way, 2.0 * inputs.robot_radius)
    return EMPTY_PATH if narrow is None else np.vstack((hits, narrow))


def after_trying(roadmap: StarRoadmap, target: np.ndarray, arrived: bool, inputs: PlannerInput) -> StarRoadmap:
    """The roadmap after a target (viewpoint and probe) was tried; its newest region was made there.

    If the robot has arrived and the newest region shows the probe, the target is dropped, since the region leads on.
    Otherwise the target is retired, except at the first inspection if much depends on it: the robot then inspects it
    from its very viewpoint.
    """
    if arrived and leads_on(roadmap, target, inputs):
        return without_target(roadmap, target)
    first_inspection = arrived and not _has_inspected(roadmap, inputs)
    given_up = blacklist_target(roadmap, target[0], BLACKLIST_RADIUS, target[1])
    if first_inspection and _lengthens_optimistic_path(roadmap, given_up, inputs):
        return dataclasses.replace(roadmap, inspection_points=np.vstack((roadmap.inspection_points, inputs.position)))
    return given_up


def leads_on(roadmap: StarRoadmap, target: np.ndarray, inputs: PlannerInput) -> bool:
    """Whether the newest region shows the probe of a target (viewpoint and probe)."""
    return _shows(roadmap.regions[-1], target[1], inputs.parameters.grid_resolution)


def without_target(roadmap: StarRoadmap, target: np.ndarray) -> StarRoadmap:
    """The roadmap without the frontier of a target (viewpoint and probe)."""
    others = np.hypot(*(roadmap.frontiers.viewpoint - target[0]).T) > 1e-9
    return dataclasses.replace(roadmap, frontiers=roadmap.frontiers.where(others))


def stall_point_ahead(
    roadmap: StarRoadmap, path: np.ndarray, inputs: PlannerInput, margin: float | None = None
) -> np.ndarray | None:
    """The place that bars a stalled robot's path (k, 2), shape (2,), W, m; None where nothing need bar it.

    It is just ahead, or in the middle of a passage that is too tight for a robot that is no disc. Nothing bars the path
    where the robot may stand only to turn, if it is a disc; where it came along; or where it may be slow to leave
    another blocked place. `margin` (m) is that of the regions; None: the planner's.
    """
    if not len(path) or (inputs.body is None and not _faces(inputs.observation.pose, path[0])):
        return None
    way = path[0] - inputs.position
    distance = inputs.robot_radius + (inputs.margins.preferred if margin is None else margin) + STALL_POINT_AHEAD
    ahead = inputs.position + way * (distance / max(float(np.hypot(*way)), 1e-9))
    passage = None if inputs.body is None else inputs.body.passage(inputs.observation.pose, path)
    if passage is not None and passage.along(inputs.observation.pose) < 0.0:
        ahead = np.array(passage.at(0.0))
    if _came_along(roadmap, ahead, inputs.parameters, inputs.robot_radius) or _is_enclosed(
        inputs.position, ahead, roadmap.stall_points
    ):
        return None
    return ahead


def _shows(region: StarRegion, probe: np.ndarray, cell: float) -> bool:
    """Whether a region contains a place up to one cell (m) from a probe (2,) in W, since gates lie on grid cells."""
    around = np.arange(16) * (math.pi / 8.0)
    ring = np.column_stack((np.cos(around), np.sin(around)))
    places = probe + cell * np.linspace(0.0, 1.0, 4)[:, None, None] * ring
    return bool(region.contains(places.reshape(-1, 2)).any())


def _has_inspected(roadmap: StarRoadmap, inputs: PlannerInput) -> bool:
    """Whether the robot is near where it has inspected a target in vain."""
    away = np.hypot(*(roadmap.inspection_points - inputs.position).T)
    return bool((away < INSPECTED_WITHIN * ARRIVAL_DISTANCE).any())


def _lengthens_optimistic_path(before: StarRoadmap, after: StarRoadmap, inputs: PlannerInput) -> bool:
    """Whether the optimistic path to the goal is longer by more than INSPECTION_DETOUR in `after` than in `before`."""
    here = inputs.position[None, :]
    away = np.hypot(*(before.blacklisted_probes - here).T)  # where the robot stands nothing is closed
    before = dataclasses.replace(
        before, blacklisted_probes=before.blacklisted_probes[away > BLACKLIST_RADIUS + PASSED_DISTANCE]
    )
    shorter, longer = (cost_at_robot(known, inputs) for known in (before, after))
    return math.isfinite(shorter) and longer - shorter > INSPECTION_DETOUR


def _faces(pose: np.ndarray, place: np.ndarray) -> bool:
    """Whether a robot at a pose (x, y, yaw) faces a place (2,) in W."""
    offset = place - pose[:2]
    return math.cos(math.atan2(offset[1], offset[0]) - pose[2]) > math.cos(FACING)


def _came_along(roadmap: StarRoadmap, place: np.ndarray, parameters: PlannerParameters, robot_radius: float) -> bool:
    """Whether the robot has driven over a place (2,) in W, so that nothing stands there."""
    driven = roadmap.union.center
    return any(
        distance_to_segment(place[None], start, end)[0] < robot_radius
        for start, end in zip(driven[:-1], driven[1:], strict=True)
        if np.hypot(*(end - start)) < CAME_STRAIGHT * parameters.node_spacing
    )


def _is_enclosed(position: np.ndarray, place: np.ndarray, stall_points: np.ndarray) -> bool:
    """Whether blocking a place ahead would enclose the robot between it and a blocked place behind.

    The robot came by one of the two ways and can leave by it.
    """
    way, others = place - position, stall_points - position
    behind = others @ way < 0.0
    return bool((np.hypot(*others[behind].T) < 2.0 * np.hypot(*way)).any())
