"""The paper's planner: it drives from node to node to the frontier nearest to the goal, and looks again there."""

import dataclasses

import numpy as np

from drake_starnav.baselines.paper.frontiers import cluster_frontiers
from drake_starnav.baselines.paper.perception import fit_slopes, smoothed_distances
from drake_starnav.lidar.laser_scan import LaserScan
from drake_starnav.planning.approach import approach
from drake_starnav.planning.cost_field import BLACKLIST_RADIUS
from drake_starnav.planning.frontiers import PROBE_DISTANCE, PROBE_REACHED, Frontiers, uncovered
from drake_starnav.planning.map_revision import clear_of
from drake_starnav.planning.planner import check_beams, watched
from drake_starnav.planning.recovery import leads_on, stall_point_ahead, without_target
from drake_starnav.planning.roadmap import (
    StarRoadmap,
    blacklist_target,
    bridged_points,
    enterable,
    with_node,
    without_nodes,
)
from drake_starnav.planning.search import (
    Route,
    cheapest_frontier,
    entry_node,
    graph_distances,
    graph_lengths,
    node_path,
)
from drake_starnav.planning.state import NO_PATH, PlannerInput, PlannerState, PlannerStatus
from drake_starnav.regions.observation import Observation
from drake_starnav.regions.star_region import StarRegion, covers

ARRIVAL_DISTANCE = 0.25
"""A way point this near is reached, m."""
STUCK_DISTANCE = 0.05
"""The target is stuck when a hit is nearer to it than this, m."""


def plan_step(state: PlannerState, now: PlannerInput) -> PlannerState:
    """One update of the planner; arguments as for `planning.plan_step`.

    A node is added at the start and where a target was tried: on arrival, where a hit lies at it, and, as in this
    project's planner, without progress. The paper's robot has no extent: regions keep no margin.

    Source: paper, section III-C and III-D.

    Raises:
        StarnavError: the scan differs in its number of beams from those before.
    """
    seen, target = now.seen, state.target
    if state.status is PlannerStatus.UNREACHABLE or seen.region is None:
        return state
    check_beams(state.roadmap, seen)
    region = clear_of(seen.region, state.roadmap.stall_points, now.robot_radius, fit_slopes)
    state, stalled = watched(state, now)
    arrived = target is not None and _distance(now.position, target[0]) < ARRIVAL_DISTANCE
    if stalled or arrived or not len(state.roadmap) or (target is not None and _hit_nearby(seen, target[0])):
        state, region = _grown(state, region, stalled, arrived, now)
    path = way_ahead(state.path, now.position)
    if not len(path):
        return _planned(state, region, stalled, now)
    return state if len(path) == len(state.path) else dataclasses.replace(state, path=path)


def extended(
    roadmap: StarRoadmap, region: StarRegion, scan: LaserScan, pose: np.ndarray, robot_radius: float
) -> StarRoadmap:
    """The roadmap with one more node; arguments as for `planning.roadmap.extended`.

    Frontiers stay until a node is added next to them: newer regions that cover them do not count.
    """
    hits = roadmap.hits.stamped(bridged_points(scan, smoothed_distances(scan), pose, robot_radius))
    return _with_frontiers(with_node(roadmap, region, scan, pose, hits), robot_radius)


def find_route(roadmap: StarRoadmap, here: StarRegion, now: PlannerInput) -> Route | None:
    """A route over the nodes to the goal if a region contains it, else to the frontier of least cost; None without one.

    The cost is the length of the way and of the straight line on to the goal; arguments as for
    `planning.search.find_route`.
    """
    goal, places = approach(roadmap.hits, now.goal, now.goal_tolerance, now.robot_radius)
    distance, previous = graph_distances(roadmap, here, now.position)
    for place in places:
        if covers(here.center, here.bearing_0, here.boundary.values, place[0], place[1]):
            return Route(place[None, :].copy(), Frontiers.none())
        goal_node = entry_node(roadmap, distance, place)
        if goal_node >= 0:
            return Route(node_path(roadmap, previous, goal_node, place), Frontiers.none())
    frontiers = roadmap.frontiers
    straight = np.hypot(*(frontiers.probe - goal).T)
    best, _, direct = cheapest_frontier(roadmap, now.position, graph_lengths(roadmap, distance), straight)
    if best < 0:
        return None
    target = frontiers.where(np.arange(len(frontiers)) == best)
    return Route(
        target.stand if direct else node_path(roadmap, previous, int(target.owner[0]), target.stand[0]), target
    )


def way_ahead(path: np.ndarray, position: np.ndarray) -> np.ndarray:
    """The path (k, 2) without way points already reached from a position (2,); W, m."""
    while len(path) > 1 and _distance(path[0], position) < ARRIVAL_DISTANCE:
        path = path[1:]
    return path


def _with_frontiers(roadmap: StarRoadmap, robot_radius: float) -> StarRoadmap:
    """The roadmap with the frontiers of its newest node, and without those at that node."""
    newest, (scan, pose), old = len(roadmap) - 1, roadmap.scans[-1], roadmap.frontiers
    old = old.where(np.hypot(*(old.stand - roadmap.stack.center[-1]).T) > ARRIVAL_DISTANCE)
    new = cluster_frontiers(roadmap.regions[-1], scan, pose, newest)
    new = new.where(uncovered(new.stand, roadmap.stack.arrays, skip=newest, slack=PROBE_REACHED * PROBE_DISTANCE))
    return dataclasses.replace(roadmap, frontiers=old.joined(new.where(enterable(new, roadmap, robot_radius))))


def _grown(
    state: PlannerState, region: StarRegion, stalled: bool, arrived: bool, now: PlannerInput
) -> tuple[PlannerState, StarRegion]:
    """The state with a new node and without path and target; and what is left of the scan's region.

    Where the robot has stalled, the place ahead is blocked. A target from which the new region leads on is dropped,
    any other is retired.
    """
    seen, target = now.seen, state.target
    roadmap = extended(state.roadmap, region, seen.scan, seen.pose, now.robot_radius)
    place = stall_point_ahead(roadmap, state.path, now, margin=0.0) if stalled else None
    if place is not None:
        roadmap = _with_stall_point(roadmap, place, now.robot_radius)
        region = clear_of(region, place[None, :], now.robot_radius, fit_slopes)
    if target is not None and arrived and leads_on(roadmap, target, now):
        roadmap = without_target(roadmap, target)
    elif target is not None:
        roadmap = blacklist_target(roadmap, target[0], BLACKLIST_RADIUS, target[1])
    return dataclasses.replace(state, roadmap=roadmap, target=None, path=NO_PATH), region


def _with_stall_point(roadmap: StarRoadmap, place: np.ndarray, robot_radius: float) -> StarRoadmap:
    """The roadmap with regions in which the robot does not touch a place (2,) in W."""
    out = without_nodes(dataclasses.replace(roadmap, stall_points=np.vstack((roadmap.stall_points, place))))
    for region, (scan, pose) in zip(roadmap.regions, roadmap.scans, strict=True):
        if _distance(region.center, place) > robot_radius:
            region = clear_of(region, out.stall_points, robot_radius, fit_slopes)
            out = _with_frontiers(with_node(out, region, scan, pose, roadmap.hits), robot_radius)
    return out


def _planned(state: PlannerState, region: StarRegion, stalled: bool, now: PlannerInput) -> PlannerState:
    """The state with a new path. Without one the goal is unreachable, except that a first look is forgotten."""
    route = find_route(state.roadmap, region, now)
    if route is None and state.plans == 0 and not stalled:
        return dataclasses.replace(
            PlannerState.initial(now.parameters, now.robot_radius),
            progress_position=state.progress_position,
            progress_time=state.progress_time,
        )
    if route is None:
        return dataclasses.replace(state, status=PlannerStatus.UNREACHABLE, path=NO_PATH, target=None)
    target = np.vstack((route.target.stand, route.target.probe)) if len(route.target) else None
    return dataclasses.replace(
        state,
        status=PlannerStatus.APPROACHING if target is None else PlannerStatus.EXPLORING,
        path=way_ahead(route.path, now.position),
        target=target,
        plans=state.plans + 1,
    )


def _hit_nearby(seen: Observation, place: np.ndarray) -> bool:
    """Whether a hit of the latest scan lies within STUCK_DISTANCE of a place (2,) in W."""
    offset = seen.scan.points(seen.pose) - place
    return bool(len(offset)) and float(np.hypot(offset[:, 0], offset[:, 1]).min()) < STUCK_DISTANCE


def _distance(a: np.ndarray, b: np.ndarray) -> float:
    return float(np.hypot(a[0] - b[0], a[1] - b[1]))
