"""A robot whose lidars do not see all around turns to look. Merged scans have lost beams where no lidar looks."""

import math

import numpy as np

from drake_starnav.planning.monitoring import FACING, is_facing, is_turning
from drake_starnav.planning.state import PlannerInput, PlannerState, Progress
from drake_starnav.surroundings.region_union import find_covering_region
from drake_starnav.surroundings.star_region import StarRegion
from drake_starnav.utils.snapshot import replace_fields

LOOKS_AFTER = 0.5
"""Time without progress after which the robot turns to unseen space, s."""
STILL_TURNS = 1.0
"""The same while it still turns to a free heading, s."""
UNSEEN_WITHIN = 2.0
"""Unseen space matters within this distance, in radii of the disc that the robot covers when it turns."""
BEGINS_WITHIN = 0.1
"""No farther from where it began, in its radii, the robot has not left."""
FACED_ANGLE = 0.1
"""A place that the robot faces within this angle, rad, and does not see is occluded."""


def sees_exit_after_turn(state: PlannerState, current_region: StarRegion, inputs: PlannerInput) -> bool:
    """Return whether lidars that do not look all around see the probe of the exit since the robot has turned."""
    nodes, observation = state.roadmap.nodes, inputs.observation
    if not observation.scan.merged or state.route.exit is None or not len(nodes):
        return False
    turned_angle = abs(math.remainder(float(observation.pose[2] - nodes[-1].pose[2]), 2.0 * math.pi))
    return turned_angle > FACING and find_covering_region(current_region.as_union, *state.route.exit[1], 0.0) >= 0


def turn_to_look(state: PlannerState, inputs: PlannerInput) -> PlannerState:
    """Return the state with the heading to which the robot turns on the spot, where its lidars have not seen enough."""
    progress = state.progress._replace(looking_heading=math.nan)
    if len(state.route.path):
        look = look_beside_path if inputs.observation.scan.merged else look_along_path
        progress = look(state, progress, inputs)
    return replace_fields(state, progress=progress)


def look_along_path(state: PlannerState, progress: Progress, inputs: PlannerInput) -> Progress:
    """Return the progress of a robot whose lone lidar, on its axis, is turned until it faces a path unseen by it.

    Most bases turn so by themselves.
    """
    scan, path_bearing = inputs.observation.scan, find_path_bearing(state, inputs)
    is_unseen = np.abs(measure_bearings_from_path(path_bearing, inputs)).min() > scan.angle_increment
    is_blind = is_unseen and inputs.time - progress.time > LOOKS_AFTER
    is_looking = math.isfinite(state.progress.looking_heading)
    if not is_blind and (not is_looking or is_facing(inputs, state.route.path[0])):
        return progress
    return start_turn(progress, path_bearing, inputs)


def look_beside_path(state: PlannerState, progress: Progress, inputs: PlannerInput) -> Progress:
    """Return the progress of a robot with merged scans that stands before its path and looks at what is beside it.

    One that is no disc may turn where it begins, and faces its path before it leaves.
    """
    path_bearing, way_point = find_path_bearing(state, inputs), state.route.path[0]
    if may_turn_at_start(state, inputs) and math.cos(path_bearing) < math.cos(FACED_ANGLE):
        return start_turn(progress._replace(standing_since=inputs.time), path_bearing, inputs)
    scan, robot_turns = inputs.observation.scan, is_turning(state)
    from_path = np.abs(measure_bearings_from_path(path_bearing, inputs))
    is_near = scan.lost & (scan.distances < UNSEEN_WITHIN * inputs.outer_radius)
    unseen = np.flatnonzero(is_near & (from_path <= 0.5 * math.pi))
    patience = STILL_TURNS if robot_turns and not math.isfinite(state.progress.looking_heading) else LOOKS_AFTER
    waits = inputs.time - progress.standing_since > patience and len(unseen) > 0
    if progress.time == inputs.time or not (waits or not robot_turns or is_facing(inputs, way_point)):
        return progress._replace(standing_since=inputs.time)
    if not waits:
        return progress
    unseen_bearing = float(scan.bearings[unseen[from_path[unseen].argmax()]])
    if abs(unseen_bearing) < FACED_ANGLE:
        return progress._replace(standing_since=inputs.time)
    return start_turn(progress, unseen_bearing, inputs)


def may_turn_at_start(state: PlannerState, inputs: PlannerInput) -> bool:
    """Return whether a robot that is no disc and turns on the spot is where it began, and not for long."""
    context, first = inputs.manoeuvre_context, state.roadmap.nodes[0]
    if context is None or not context.base.turns_on_the_spot:
        return False
    is_early = inputs.time - first.time < inputs.parameters.progress_timeout
    driven_distance = math.dist(first.pose[:2], inputs.observation.pose[:2].tolist())
    return is_early and driven_distance < BEGINS_WITHIN * inputs.cover_radius


def find_path_bearing(state: PlannerState, inputs: PlannerInput) -> float:
    """Return the bearing of the first way point from the robot's heading, rad, not wrapped."""
    (x, y, yaw), way_point = inputs.observation.pose.tolist(), state.route.path[0]
    return math.atan2(way_point[1] - y, way_point[0] - x) - yaw


def measure_bearings_from_path(path_bearing: float, inputs: PlannerInput) -> np.ndarray:
    """Return the angles of the beams from the bearing of the path, shape (n,), in [-pi, pi), rad."""
    return np.mod(inputs.observation.scan.bearings - path_bearing + math.pi, 2.0 * math.pi) - math.pi


def start_turn(progress: Progress, bearing: float, inputs: PlannerInput) -> Progress:
    """Return the progress of a robot that turns on the spot by a bearing, rad."""
    return progress._replace(looking_heading=float(inputs.observation.pose[2]) + bearing)
