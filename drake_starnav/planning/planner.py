"""The planner as a pure step: planner state and a new scan in, planner state with a path out."""

import dataclasses
from enum import Flag, auto

import numpy as np

from drake_starnav.errors import StarnavError
from drake_starnav.planning.guidance import Guidance
from drake_starnav.planning.impassable import impassable_points
from drake_starnav.planning.manoeuvre import manoeuvring
from drake_starnav.planning.map_revision import remaining, revised, with_stall_point
from drake_starnav.planning.monitoring import PlanCheck, check_plan, distance_to, passed_points, points_ahead
from drake_starnav.planning.recovery import (
    AVERAGED_SCANS,
    after_trying,
    has_arrived,
    stall_point_ahead,
    too_narrow,
)
from drake_starnav.planning.roadmap import StarRoadmap, extended, rebuilt, uncovered_share
from drake_starnav.planning.search import Route, find_route
from drake_starnav.planning.state import EMPTY_PATH, PlannerInput, PlannerState, PlannerStatus
from drake_starnav.regions.observation import Observation
from drake_starnav.regions.obstruction import AVOIDED
from drake_starnav.regions.region_union import RegionUnion
from drake_starnav.regions.star_region import StarRegion, clear_of

PROGRESS_DISTANCE = 0.15
"""Motion that counts as progress, m."""
SILENT_SHARE = 0.5
"""The sensor counts as silent when it sends no scan for this share of `progress_timeout`."""
NEW_SHARE = 0.01
"""With a map from an earlier goal, a region is worth a node only if more than this share of its area is new."""


class GrowthTrigger(Flag):
    """Why the roadmap grows; several triggers may hold at once.

    Attributes:
        ARRIVED: the robot is at its target.
        STALLED: the robot has made no progress for too long.
        TRIED: either of these, after which the target has been tried.
        DUE: the robot is where a node is wanted.
        SPACED: it has driven `node_spacing`. Alone this makes a node only if the scan contradicts the roadmap.
    """

    NONE = 0
    ARRIVED = auto()
    STALLED = auto()
    DUE = auto()
    SPACED = auto()
    TRIED = ARRIVED | STALLED


def plan_step(state: PlannerState, inputs: PlannerInput) -> PlannerState:
    """One update of the planner: grow the roadmap if anything triggers it, and plan a path if there is none.

    A new path is also planned as soon as the latest scan blocks the optimistic path beyond the target frontier. On its
    way to the frontier, the robot turns towards that path as soon as the latest scan shows it to be free.

    Args:
        state: before; it is not changed.
        inputs: the latest scan, and where the robot is and shall go.

    Raises:
        StarnavError: the scan differs in its number of beams from those before, or the goal is too far.
    """
    observation = inputs.observation
    if state.status is PlannerStatus.UNREACHABLE or observation.region is None:
        return state
    check_beams(state.roadmap, observation)
    region = clear_of(observation.region, state.roadmap.stall_points, inputs.robot_radius + observation.region.margin)
    if state.doubting:
        state = dataclasses.replace(state, recent=(*state.recent, observation)[-AVERAGED_SCANS:])
    state, stalled = watched(state, inputs)
    check = check_plan(state, region, inputs)
    trigger = _growth_trigger(state, region, check, stalled, inputs)
    if trigger:
        state, region = _grown(state, region, trigger, inputs)
    if len(state.path):
        state = _unless_obstructed(state, check, inputs)
    if len(state.path):
        state = _along_path(state, check, inputs.position)
    ahead = check.ahead
    if not len(state.path):
        first_plan = state.plans == 0 and not stalled
        state = _planned(state, region, first_plan, inputs)
        region = clear_of(
            observation.region, state.roadmap.stall_points, inputs.robot_radius + observation.region.margin
        )
        ahead = points_ahead(state.next_segment, region, inputs.position)
    return _manoeuvred(_with_anticipation(state, region, ahead), inputs)


def _manoeuvred(state: PlannerState, inputs: PlannerInput) -> PlannerState:
    """The state with the manoeuvres of a robot that is no disc."""
    if inputs.body is None:
        return state
    path = EMPTY_PATH if _may_stand(state, inputs) else state.path
    pose, patience = inputs.observation.pose, inputs.parameters.progress_timeout
    now = manoeuvring(state.manoeuvring, path, pose, inputs.time, inputs.body, patience)
    return dataclasses.replace(state, manoeuvring=now)


def check_beams(roadmap: StarRoadmap, observation: Observation) -> None:
    """Raise a `StarnavError` if a scan's region has another number of bearings than the roadmap's regions."""
    if observation.region is None or not len(roadmap):
        return
    bearings, before = len(observation.region.free_range), roadmap.union.values.shape[1]
    if bearings != before:
        raise StarnavError(
            f"laser scan: {len(observation.scan.ranges)} beams (a region of {bearings} bearings) after scans of "
            f"{len(roadmap.nodes[0].scan.ranges)} beams ({before} bearings); allowed: the same number in every scan"
        )


def watched(state: PlannerState, inputs: PlannerInput) -> tuple[PlannerState, bool]:
    """The state with its progress monitor updated, and whether the robot has stalled.

    A robot may stand at its goal, without scans, and where it may be giving way; a manoeuvre has a patience of its own.
    """
    may_stand = _may_stand(state, inputs)
    manoeuvres = state.manoeuvring
    moves = len(manoeuvres.poses) > 0 or not distance_to(inputs.position, state.progress_position) <= PROGRESS_DISTANCE
    if may_stand or (moves and not manoeuvres.gives_up):
        return dataclasses.replace(state, progress_position=inputs.position.copy(), progress_time=inputs.time), False
    if manoeuvres.gives_up or inputs.time - state.progress_time > inputs.parameters.progress_timeout:
        return dataclasses.replace(state, progress_time=inputs.time), True
    return state, False


def _may_stand(state: PlannerState, inputs: PlannerInput) -> bool:
    """Whether the robot is at its goal, was without scans, or may be giving way to a moving obstacle."""
    scan = inputs.observation.scan
    if inputs.interval > SILENT_SHARE * inputs.parameters.progress_timeout:
        return True
    if scan.motion is not None and bool((scan.distances[scan.moving] < AVOIDED).any()):
        return True
    approaching = state.status is PlannerStatus.APPROACHING and len(state.path) > 0
    return approaching and distance_to(inputs.position, state.path[-1]) < max(inputs.goal_tolerance, PROGRESS_DISTANCE)


def _growth_trigger(
    state: PlannerState, region: StarRegion, check: PlanCheck, stalled: bool, inputs: PlannerInput
) -> GrowthTrigger:
    """The triggers that hold now."""
    spaced = distance_to(inputs.position, state.node_position) > inputs.parameters.node_spacing
    arrived = has_arrived(state, region, inputs)
    due = not stalled and not arrived and node_is_due(state, region, check, spaced)
    trigger = GrowthTrigger.NONE
    if stalled:
        trigger |= GrowthTrigger.STALLED
    if arrived:
        trigger |= GrowthTrigger.ARRIVED
    if due:
        trigger |= GrowthTrigger.DUE
    if spaced:
        trigger |= GrowthTrigger.SPACED
    return trigger


def node_is_due(state: PlannerState, region: StarRegion, check: PlanCheck, spaced: bool) -> bool:
    """Whether to add a node with the region of the latest scan, `spaced` from where one was last added or omitted.

    A node is due at the start, every `node_spacing` (with a map from an earlier goal only if enough of the region is
    new), when the target's probe is seen, and outside all regions.
    """
    if check.sees_probe or check.outside or not len(state.roadmap):
        return True
    return spaced and not (state.began_with_map and uncovered_share(region, state.roadmap.union) <= NEW_SHARE)


def _grown(
    state: PlannerState, region: StarRegion, trigger: GrowthTrigger, inputs: PlannerInput
) -> tuple[PlannerState, StarRegion]:
    """The state with a new node and no path, if anything triggers one; and what is left of the scan's region.

    Regions that the scan contradicts are dropped first. A target that was tried is given up, and may be retired. If the
    robot has stalled, the place ahead may be blocked.
    """
    if not trigger:
        return state, region
    observation, margins, robot_radius = inputs.observation, inputs.margins, inputs.robot_radius
    roadmap, target, node = state.roadmap, state.target, dataclasses.replace(observation, region=region)
    regions = remaining(roadmap, observation, margins, robot_radius)
    if regions is not roadmap.regions:
        roadmap = revised(roadmap, regions, margins, robot_radius, (node,))
    elif trigger == GrowthTrigger.SPACED:
        return dataclasses.replace(state, node_position=inputs.position.copy()), region
    else:
        roadmap = extended(roadmap, node, margins, robot_radius)
    if GrowthTrigger.STALLED in trigger:
        place = stall_point_ahead(roadmap, state.guidance.path, inputs)
        if place is not None:
            roadmap = with_stall_point(roadmap, place, margins, robot_radius)
            region = clear_of(region, place[None, :], robot_radius + region.margin)
    if target is not None and trigger & GrowthTrigger.TRIED:
        roadmap = after_trying(roadmap, target, GrowthTrigger.ARRIVED in trigger, inputs)
        target = None
    node_position = observation.pose[:2].copy()
    return dataclasses.replace(
        state, roadmap=roadmap, target=target, node_position=node_position, path=EMPTY_PATH
    ), region


def _unless_obstructed(state: PlannerState, check: PlanCheck, inputs: PlannerInput) -> PlannerState:
    """The state; if the latest scans show the way past the target to be blocked, with their hits and without a path."""
    points = too_narrow(state, inputs)
    if check.obstructed:
        points = np.vstack((points, impassable_points(inputs.observation, inputs.margins, inputs.robot_radius)))
    if not len(points):
        return state
    roadmap = dataclasses.replace(state.roadmap, hits=state.roadmap.hits.stamped(points))
    return dataclasses.replace(state, roadmap=roadmap, path=EMPTY_PATH)


def _along_path(state: PlannerState, check: PlanCheck, position: np.ndarray) -> PlannerState:
    """The state with the path still ahead; without a path if the robot has lost sight of it."""
    if check.strayed:
        return dataclasses.replace(state, path=EMPTY_PATH)
    return dataclasses.replace(state, path=state.path[check.passed :]) if check.passed else state


def _path_ahead(regions: RegionUnion, path: np.ndarray, position: np.ndarray) -> np.ndarray:
    """The path without way points already passed, or that the robot can see past."""
    return path[passed_points(*position, path, regions) :] if len(path) > 1 else path


def _planned(state: PlannerState, region: StarRegion, first_plan: bool, inputs: PlannerInput) -> PlannerState:
    """The state with a new path; if there is none, the goal is unreachable.

    At the first look the scan may be at fault: one that shows no way at all is forgotten. So is one in which the robot
    cannot move, for what is in its way hides the rest, and may leave.
    """
    route, state = _searched(state, region, inputs)
    boxed_in = region.reach < PROGRESS_DISTANCE < region.limit.max()
    if route is None and (first_plan or (boxed_in and state.plans == 0)):
        return dataclasses.replace(
            PlannerState.initial(inputs.parameters, inputs.swept_radius),
            progress_position=state.progress_position,
            progress_time=state.progress_time,
        )
    if route is None:
        status = state.status if boxed_in else PlannerStatus.UNREACHABLE
        return dataclasses.replace(state, status=status, path=EMPTY_PATH, target=None)
    target, roadmap = None, state.roadmap
    if route.blacklisted_probes is not None and len(route.blacklisted_probes) > len(roadmap.blacklisted_probes):
        roadmap = dataclasses.replace(roadmap, blacklisted_probes=route.blacklisted_probes)
    if len(route.target):
        target = np.vstack((route.target.viewpoint, route.target.probe))
        if not (roadmap.frontiers.viewpoint == route.target.viewpoint).all(axis=1).any():  # a virtual frontier
            roadmap = dataclasses.replace(roadmap, frontiers=roadmap.frontiers.joined(route.target))
    return dataclasses.replace(
        state,
        roadmap=roadmap,
        status=PlannerStatus.APPROACHING if target is None else PlannerStatus.EXPLORING,
        path=_path_ahead(region.alone if state.doubting else roadmap.union, route.path, inputs.position),
        target=target,
        plans=state.plans + 1,
        plan_position=inputs.position.copy(),
        optimistic_path=route.optimistic_path,
        next_segment=route.next_segment,
    )


def _searched(state: PlannerState, region: StarRegion, inputs: PlannerInput) -> tuple[Route | None, PlannerState]:
    """The route, if there is one, and the state with the roadmap in which it was found.

    Where there is none, the robot doubts from then on that gaps are closed which hits may only seem to close, and what
    was tried in vain is tried again, in a roadmap that is rebuilt.
    """
    observation, roadmap = inputs.observation, state.roadmap
    current = None if state.target is None else state.target[0]
    route = find_route(roadmap, region, inputs, current, doubting=state.doubting)
    tried = len(roadmap.blacklisted_probes) or len(roadmap.stall_points)
    if route is not None or (state.doubting and not tried):
        return route, state
    assert observation.region is not None
    if tried:
        roadmap = rebuilt(roadmap, inputs.margins, inputs.robot_radius)
        if roadmap.nodes[-1].scan is not observation.scan:
            roadmap = extended(roadmap, observation, inputs.margins, inputs.robot_radius)
    route = find_route(roadmap, observation.region, inputs, doubting=True)
    return route, dataclasses.replace(state, roadmap=roadmap, doubting=True)


def _with_anticipation(state: PlannerState, region: StarRegion, ahead: int) -> PlannerState:
    """The state with what the latest region shows of the optimistic path beyond the target."""
    anticipated = _anticipated(state, region, ahead) if ahead >= 0 else None
    return state if anticipated is state.anticipated else dataclasses.replace(state, anticipated=anticipated)


def _anticipated(state: PlannerState, region: StarRegion, ahead: int) -> Guidance | None:
    """Guidance to the last point of the optimistic path in line of sight inside the latest region.

    None on the way to another way point or to the goal, and while none of that path is in sight.

    Args:
        state: with a path.
        region: of the latest scan.
        ahead: index of that point in the next segment.
    """
    if state.status is not PlannerStatus.EXPLORING or len(state.path) != 1:
        return None
    return Guidance(state.next_segment[ahead : ahead + 1], False, region.alone)
