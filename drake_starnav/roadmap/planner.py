"""The planner as a pure step: what is known, one more scan, and out comes what is known now and where to go."""

import dataclasses
import math

import numpy as np

from drake_starnav.guidance import PASSED_DISTANCE, Guidance
from drake_starnav.polyline import distance_to_segment
from drake_starnav.roadmap.consistency import blocked, clear_of, reconciled
from drake_starnav.roadmap.hit_memory import CLOSED_RADIUS
from drake_starnav.roadmap.parameters import PlannerParameters
from drake_starnav.roadmap.roadmap import StarRoadmap, extended, rebuilt, retired, uncovered_share
from drake_starnav.roadmap.search import UNREACHABLE_PENALTY, barred_in_vain, find_route, last_in_sight, optimistic_cost
from drake_starnav.roadmap.state import Observation, PlannerState, PlannerStatus
from drake_starnav.stars.region import (
    LINE_STEP,
    RegionStack,
    StarRegion,
    covers,
    first_cover,
    scan_region,
    segment_covered,
)

OUTSIDE_TOLERANCE = 0.03
"""The robot counts as having left the regions only when this far outside, m."""
AT_GOAL = 0.3
"""A robot this near to its goal is there, m."""
SILENT_SHARE = 0.5
"""A scan is old after this share of the time in which progress is expected."""
BLOCKED_AHEAD = 0.05
"""A place that the robot could not drive to lies this far before it, beyond its radius and the margin, m."""
FACING = math.radians(30.0)
"""A robot that cannot go on faces where it should go within this, rad; one that does not may only be turning."""
GIVING_WAY = 1.5
"""While something that moves is this near, the robot may be giving way, and lack of progress means nothing, m."""
NEW_SHARE = 0.01
"""With a map from an earlier goal, a region of whose area no more than this share is new makes no node."""
CAME_ALONG_NODES = 40
"""A place that the robot passed between the latest so many nodes is not blocked."""
CAME_STRAIGHT = 1.5
"""From one node to the next it has come in a line, if they are not farther apart than this many node spacings."""
AT_STAND = 0.04
"""Where a robot has looked at a target in vain, it arrives at one only this near to its stand, m."""
LOOKED_AROUND = 2.0
"""It has looked within this many arrival distances of there."""
PROBE_SEEN_AFTER = 0.3
"""A target whose probe is seen makes a node only this far from the last one, m."""


def plan_step(
    state: PlannerState,
    seen: Observation,
    position: np.ndarray,
    goal: np.ndarray,
    time: float,
    parameters: PlannerParameters,
    robot_radius: float,
) -> PlannerState:
    """One update of the planner.

    A node is added at the start, when the robot leaves the union of regions, every `node_spacing` (with a map from an
    earlier goal only where it sees something new), when the target frontier's probe is seen, on arrival at the target,
    and when no progress was made for `progress_timeout`. In the last two cases, and when a hit lies within
    `stuck_distance` of it, the target is retired; on arrival only after a look from its very stand, if much depends on
    it (`closer_look`). A robot that faces its way and makes no progress blocks the place just ahead too, unless it has
    come along there or is leaving another one.

    With `anticipation` the robot turns, on its way to a target frontier, towards the way on from there as soon as the
    latest scan shows it.

    Args:
        state: before; it is not changed.
        seen: the latest scan.
        position: of the robot now, shape (2,), W, m.
        goal: shape (2,), W, m.
        time: s.
        parameters: of the roadmap.
        robot_radius: m.
    """
    if state.status is PlannerStatus.UNREACHABLE or seen.region is None:
        return state
    region = seen.region
    if state.status is PlannerStatus.WAITING and len(state.roadmap) and state.roadmap.margin != parameters.margin:
        roadmap = rebuilt(state.roadmap, parameters.margin, parameters, robot_radius)
        state = dataclasses.replace(state, roadmap=roadmap)
    if len(state.roadmap) and (region.margin != state.roadmap.margin or len(state.roadmap.blocked)):
        region = _narrower(seen, state.roadmap, state.roadmap.margin, parameters, robot_radius)
    state, stalled = _watched(state, seen, position, time, parameters)
    roadmap, target = state.roadmap, state.target
    arrived = target is not None and _arrived(roadmap, target, position, parameters)
    stuck = target is not None and _hit_nearby(seen, target[0], parameters.stuck_distance)
    tried = arrived or stalled or stuck
    spaced = node_spacing_driven(state, position, parameters)
    due = tried or node_is_due(state, region, position, parameters)
    if due or spaced:
        roadmap = reconciled(roadmap, seen.scan, seen.pose, parameters, robot_radius)
    search = due or roadmap is not state.roadmap
    if search:
        roadmap = extended(roadmap, region, seen.scan, seen.pose, parameters, robot_radius)
        way = state.guidance.path
        if stalled and parameters.retire_dead_ends and len(way) and _faces(seen.pose, way[0]):
            ahead = _ahead(position, way[0], robot_radius + roadmap.margin + BLOCKED_AHEAD)
            if not _came_along(roadmap, ahead, parameters, robot_radius) and not _shut_in(
                position, ahead, roadmap.blocked
            ):
                roadmap = blocked(roadmap, ahead, parameters, robot_radius)
                region = clear_of(region, ahead[None, :], parameters, robot_radius)
        if tried and target is not None:
            if parameters.retire_dead_ends:
                roadmap = _after_trying(roadmap, seen, target, arrived, position, goal, parameters, robot_radius)
            target = None
        state = dataclasses.replace(state, roadmap=roadmap, target=target, node_position=seen.pose[:2].copy())
    elif spaced:
        state = dataclasses.replace(state, node_position=position.copy())
    if not search and len(state.path):
        path = _path_ahead(state.roadmap, state.path, position, parameters)
        search = parameters.string_pulling and _strayed(state.roadmap, path, position)
        if not search and len(path) < len(state.path):
            state = dataclasses.replace(state, path=path)
    if search or not len(state.path):
        first_look = state.plans == 0 and not stalled
        state = _planned(state, seen, region, position, goal, parameters, robot_radius, first_look)
    anticipated = _anticipated(state, seen.region, position, parameters, robot_radius)
    return state if anticipated is state.anticipated else dataclasses.replace(state, anticipated=anticipated)


def _anticipated(
    state: PlannerState,
    region: StarRegion,
    position: np.ndarray,
    parameters: PlannerParameters,
    robot_radius: float,
) -> Guidance | None:
    """The last point of the way on that is in straight sight inside the region of the latest scan, as guidance.

    None on the way to another way point, to the goal, and while nothing of the way on is seen.
    """
    if not parameters.anticipation or state.status is not PlannerStatus.EXPLORING or len(state.path) != 1:
        return None
    regions = RegionStack.of([clear_of(region, state.roadmap.blocked, parameters, robot_radius)])
    last = last_in_sight(state.way_on, position, regions)
    return Guidance(state.way_on[last : last + 1], False, regions) if last >= 0 else None


def _after_trying(
    roadmap: StarRoadmap,
    seen: Observation,
    target: np.ndarray,
    arrived: bool,
    position: np.ndarray,
    goal: np.ndarray,
    parameters: PlannerParameters,
    robot_radius: float,
) -> StarRoadmap:
    """The roadmap once a target (stand and probe) was driven to, its newest region made there.

    If that region does not contain the probe, regions with less and less margin are tried, and if that is in vain the
    target is retired. If much depends on it, it is looked at from nearer before that, but with the margin as it is:
    what only less margin shows from there is a gap that the robot would hardly get through.
    """
    if arrived and roadmap.regions[-1].contains(target[1]):
        return roadmap
    margin = roadmap.regions[-1].margin - parameters.margin_step
    first_look = arrived and not _looked(roadmap, position, parameters)
    while first_look and parameters.margin_shrinking and margin > -1e-9:
        region = _narrower(seen, roadmap, max(margin, 0.0), parameters, robot_radius)
        if region.contains(target[1]):
            return extended(roadmap, region, seen.scan, seen.pose, parameters, robot_radius, stamp=False)
        margin -= parameters.margin_step
    given_up = retired(roadmap, target[0], parameters.retired_radius, target[1])
    if first_look and _detour(roadmap, given_up, position, goal, parameters, robot_radius):
        return dataclasses.replace(roadmap, looked=np.vstack((roadmap.looked, position)))
    return given_up


def _arrived(roadmap: StarRoadmap, target: np.ndarray, position: np.ndarray, parameters: PlannerParameters) -> bool:
    """Whether the robot has come to a target (stand and probe): to its very stand, where it has looked in vain."""
    near = AT_STAND if _looked(roadmap, position, parameters) else np.inf
    return _distance(position, target[0]) < min(near, parameters.arrival_distance)


def _looked(roadmap: StarRoadmap, position: np.ndarray, parameters: PlannerParameters) -> bool:
    """Whether the robot is about where it has looked in vain at a target that was kept."""
    away = np.hypot(*(roadmap.looked - position).T)
    return bool((away < LOOKED_AROUND * parameters.arrival_distance).any())


def _detour(
    before: StarRoadmap,
    after: StarRoadmap,
    position: np.ndarray,
    goal: np.ndarray,
    parameters: PlannerParameters,
    robot_radius: float,
) -> bool:
    """Whether the optimistic path to the goal is longer by `closer_look` once a target was given up."""
    if parameters.cost_to_go != "grid":
        return False
    away = np.hypot(*(before.closed - position).T)  # where the robot stands nothing is closed
    before = dataclasses.replace(before, closed=before.closed[away > CLOSED_RADIUS + AT_STAND])
    shorter, longer = (
        float(optimistic_cost(known, position, goal, parameters, robot_radius).at(position[None, :])[0])
        for known in (before, after)
    )
    return math.isfinite(shorter) and min(longer - shorter, UNREACHABLE_PENALTY) > parameters.closer_look


def _faces(pose: np.ndarray, place: np.ndarray) -> bool:
    """Whether a robot at a pose (x, y, yaw) faces a place (2,) in W."""
    offset = place - pose[:2]
    return math.cos(math.atan2(offset[1], offset[0]) - pose[2]) > math.cos(FACING)


def _came_along(roadmap: StarRoadmap, place: np.ndarray, parameters: PlannerParameters, robot_radius: float) -> bool:
    """Whether the robot has lately passed over a place (2,) in W, so that nothing stands there."""
    driven = roadmap.stack.center[-CAME_ALONG_NODES:]
    return any(
        distance_to_segment(place[None], start, end)[0] < robot_radius
        for start, end in zip(driven[:-1], driven[1:], strict=True)
        if _distance(start, end) < CAME_STRAIGHT * parameters.node_spacing
    )


def _shut_in(position: np.ndarray, place: np.ndarray, blocked: np.ndarray) -> bool:
    """Whether a place ahead, and one that is blocked already behind it, would hold the robot between them.

    It came here by one of the two ways: it may be slow to leave, but it can.
    """
    way, others = place - position, blocked - position
    behind = others @ way < 0.0
    return bool((np.hypot(*others[behind].T) < 2.0 * np.hypot(*way)).any())


def _ahead(position: np.ndarray, place: np.ndarray, distance: float) -> np.ndarray:
    """The point at a distance (m) from a position towards a place, shape (2,)."""
    way = place - position
    return position + way * (distance / max(float(np.hypot(*way)), 1e-9))


def _watched(
    state: PlannerState, seen: Observation, position: np.ndarray, time: float, parameters: PlannerParameters
) -> tuple[PlannerState, bool]:
    """The state with its progress watch brought up to date, and whether the watch has run out.

    A robot at its goal, one that gets no scans, or one that may be giving way has reason to stand.
    """
    moved = not _distance(position, state.progress_position) <= parameters.progress_distance
    silent = time - seen.scan.time > SILENT_SHARE * parameters.progress_timeout
    at_goal = (
        state.status is PlannerStatus.APPROACHING
        and len(state.path) > 0
        and _distance(position, state.path[-1]) < AT_GOAL
    )
    giving_way = bool((seen.scan.distances[seen.scan.moving] < GIVING_WAY).any())
    stalled = not moved and time - state.progress_time > parameters.progress_timeout
    if moved or silent or at_goal or giving_way:
        state, stalled = dataclasses.replace(state, progress_position=position.copy(), progress_time=time), False
    elif stalled:
        state = dataclasses.replace(state, progress_time=time)
    return state, stalled


def _narrower(
    seen: Observation, roadmap: StarRoadmap, margin: float, parameters: PlannerParameters, robot_radius: float
) -> StarRegion:
    """The region of the latest scan with a margin that the roadmap has come to, clear of what is blocked."""
    region = seen.region
    if region is None or region.margin != margin:
        region = scan_region(seen.scan, seen.pose, robot_radius, dataclasses.replace(parameters, margin=margin))
    return clear_of(region, roadmap.blocked, parameters, robot_radius)


def node_is_due(state: PlannerState, region: StarRegion, position: np.ndarray, parameters: PlannerParameters) -> bool:
    """Whether the roadmap shall have a node where the robot is, with the region of the latest scan."""
    if not len(state.roadmap):
        return True
    if parameters.growth == "arrival":
        return False
    driven = _distance(position, state.node_position)
    if node_spacing_driven(state, position, parameters) and not (
        state.mapped and uncovered_share(region, state.roadmap.stack) <= NEW_SHARE
    ):
        return True
    shape = (region.center, region.bearing_0, region.boundary.values)
    if state.target is not None and driven > PROBE_SEEN_AFTER and covers(*shape, *state.target[1]):
        return True
    return driven > OUTSIDE_TOLERANCE and not _inside_some_region(state.roadmap, position)


def node_spacing_driven(state: PlannerState, position: np.ndarray, parameters: PlannerParameters) -> bool:
    """Whether the robot is `node_spacing` from where a node was last added, or nothing new was seen for one."""
    return _distance(position, state.node_position) > parameters.node_spacing


def _inside_some_region(roadmap: StarRoadmap, position: np.ndarray) -> bool:
    """Whether the robot, moved by the tolerance towards the region's centre, is in one of the regions."""
    stack = roadmap.stack
    if first_cover(*stack.arrays, *position) >= 0:
        return True
    offset = stack.center - position
    away = np.hypot(offset[:, 0], offset[:, 1])
    for k in np.flatnonzero(away <= stack.reach + OUTSIDE_TOLERANCE)[::-1]:
        nearer = position + offset[k] * min(OUTSIDE_TOLERANCE / max(away[k], 1e-9), 1.0)
        if covers(stack.center[k], stack.bearing_0[k], stack.values[k], *nearer):
            return True
    return False


def _planned(
    state: PlannerState,
    seen: Observation,
    region: StarRegion,
    position: np.ndarray,
    goal: np.ndarray,
    parameters: PlannerParameters,
    robot_radius: float,
    first_look: bool,
) -> PlannerState:
    """The state with a new route; where none is left, margins shrink round by round until one is found.

    Where only what was tried in vain bars the goal, that is tried again, before all else is explored that cannot help.
    At the first look the scan may be at fault: one that shows no way at all is forgotten.
    """
    current = None if state.target is None else state.target[0]
    roadmap, rounds = state.roadmap, state.rounds
    while True:
        route = find_route(roadmap, region, position, goal, parameters, robot_radius, current)
        again = parameters.margin_shrinking and rounds < parameters.margin_rounds
        if route is not None and not (
            again and route.hopeless and barred_in_vain(roadmap, position, goal, parameters, robot_radius)
        ):
            break
        if not again and first_look:
            fresh = PlannerState.initial(parameters, robot_radius)
            return dataclasses.replace(
                fresh, progress_position=state.progress_position, progress_time=state.progress_time
            )
        if not again:
            return dataclasses.replace(
                state,
                roadmap=roadmap,
                status=PlannerStatus.UNREACHABLE,
                path=np.zeros((0, 2)),
                target=None,
                rounds=rounds,
            )
        rounds += 1
        margin = roadmap.margin if route is not None else max(roadmap.margin - parameters.margin_step, 0.0)
        roadmap = rebuilt(roadmap, margin, parameters, robot_radius)
        region = _narrower(seen, roadmap, margin, parameters, robot_radius)
        roadmap = extended(roadmap, region, seen.scan, seen.pose, parameters, robot_radius)
        current = None
    target = None
    if len(route.target):
        target = np.vstack((route.target.stand, route.target.probe))
        if not (roadmap.frontiers.stand == route.target.stand).all(axis=1).any():  # a gate
            roadmap = dataclasses.replace(roadmap, frontiers=roadmap.frontiers.joined(route.target))
    return dataclasses.replace(
        state,
        roadmap=roadmap,
        status=PlannerStatus.APPROACHING if target is None else PlannerStatus.EXPLORING,
        path=_path_ahead(roadmap, route.path, position, parameters),
        target=target,
        rounds=rounds,
        plans=state.plans + 1,
        way_on=route.way_on,
    )


def _path_ahead(
    roadmap: StarRoadmap, path: np.ndarray, position: np.ndarray, parameters: PlannerParameters
) -> np.ndarray:
    """The path without the way points that are passed, or (when pulling strings) that the robot can see past."""
    passed = PASSED_DISTANCE if parameters.string_pulling else parameters.arrival_distance
    while len(path) > 1 and (
        _distance(path[0], position) < passed
        or (parameters.string_pulling and segment_covered(*roadmap.stack.arrays, *position, *path[1], LINE_STEP))
    ):
        path = path[1:]
    return path


def _strayed(roadmap: StarRoadmap, path: np.ndarray, position: np.ndarray) -> bool:
    """Whether the robot, inside the union of regions, has lost the line of sight to the next way point."""
    regions = roadmap.stack.arrays
    return first_cover(*regions, *position) >= 0 and not segment_covered(*regions, *position, *path[0], LINE_STEP)


def _hit_nearby(seen: Observation, place: np.ndarray, distance: float) -> bool:
    """Whether a hit of the latest scan lies within `distance` (m) of a place (2,) in W."""
    if distance <= 0.0:
        return False
    offset = seen.scan.points(seen.pose) - place
    return bool(len(offset)) and float(np.hypot(offset[:, 0], offset[:, 1]).min()) < distance


def _distance(a: np.ndarray, b: np.ndarray) -> float:
    return float(np.hypot(a[0] - b[0], a[1] - b[1]))
