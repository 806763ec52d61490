"""The planner as a pure step: planner state and a new scan in, planner state with a path out."""

import numpy as np

from drake_starnav.errors import StarnavError
from drake_starnav.planning.closures import (
    AVERAGED_SCANS,
    add_latest_node,
    close_path,
    find_blocking_keep_outs,
    find_narrow_gap_hits,
    is_probe_occluded,
    reopen_closures,
)
from drake_starnav.planning.guidance import PASSED_DISTANCE
from drake_starnav.planning.impassable import bridge_observed_hits
from drake_starnav.planning.looking import sees_exit_after_turn, turn_to_look
from drake_starnav.planning.map_revision import find_consistent_regions
from drake_starnav.planning.monitoring import PlanCheck, check_plan, distance_to, is_facing, is_turning
from drake_starnav.planning.roadmap import StarRoadmap, measure_uncovered_share, replace_regions
from drake_starnav.planning.route import find_route
from drake_starnav.planning.state import (
    EMPTY_PATH,
    UNSET_POSITION,
    DeadEnd,
    PlannerInput,
    PlannerState,
    PlannerStatus,
    Route,
)
from drake_starnav.surroundings.observation import Observation
from drake_starnav.surroundings.region_union import find_covering_region
from drake_starnav.surroundings.star_region import StarRegion
from drake_starnav.utils.snapshot import replace_fields

PROGRESS_DISTANCE = 0.6
"""Motion that counts as progress, in radii of the robot."""
SILENT_SHARE = 0.5
"""The sensor counts as silent when it sends no scan for this share of `progress_timeout`."""
NEW_SHARE = 0.01
"""With a map from an earlier goal, a region is worth a node only if more than this share of its area is new."""
AVOIDED_WITHIN = 6.0
"""A moving obstacle nearer than this obstructs the robot, in cover radii; the robot may be giving way to it."""
MOST_CLOSED = 6
"""Exits that are closed at most in one update."""


def plan_step(state: PlannerState, inputs: PlannerInput) -> PlannerState:
    """Update the roadmap with a scan, close a route that failed, and plan one if there is none.

    A new route is also planned as soon as the latest scan blocks the optimistic path beyond the exit.

    Args:
        state: before; it is not changed.
        inputs: the latest scan, and where the robot is and shall go.

    Raises:
        StarnavError: the scan's region has another number of bearings than those before, or the way to the goal takes
            too large a grid.

    Source: in the place of Algorithm 1 of the paper, lines 9 to 19, and of its section III-C.
    """
    observation = inputs.observation
    if not can_plan(state, inputs):
        return state
    assert observation.region is not None
    check_beams(state.roadmap, observation)
    state, has_stalled = track_progress(state, inputs)
    current_region = state.roadmap.closures.open_part(observation.region)
    check = check_plan(state, current_region, inputs)
    failed_path = find_failed_path(state, inputs) if has_stalled else EMPTY_PATH
    state = replace_fields(state, recent_observations=(*state.recent_observations, observation)[-AVERAGED_SCANS:])
    state = update_roadmap(state, current_region, check, has_stalled, inputs)
    state = discard_blocked_path(state, check, inputs)
    if len(failed_path):
        state = close_path(state, failed_path, inputs)
    if len(state.route.path):
        state = drop_passed_points(state, check)
    if not len(state.route.path):
        state = replan(state, has_stalled, inputs)
    return turn_to_look(state, inputs) if inputs.has_limited_view else state


def can_plan(state: PlannerState, inputs: PlannerInput) -> bool:
    """Return whether there is a scan to plan with, and the goal is not given up."""
    return state.status is not PlannerStatus.UNREACHABLE and inputs.observation.region is not None


def check_beams(roadmap: StarRoadmap, observation: Observation) -> None:
    """Raise a `StarnavError` if a scan's region has another number of bearings than the roadmap's regions."""
    if observation.region is None or not len(roadmap):
        return
    bearings, expected_bearings = len(observation.region.free_range), roadmap.union.values.shape[1]
    if bearings != expected_bearings:
        raise StarnavError(
            f"laser scan: {len(observation.scan.ranges)} beams (a region of {bearings} bearings) after scans of "
            f"{len(roadmap.nodes[0].scan.ranges)} beams ({expected_bearings} bearings); allowed: the same number in "
            "every scan"
        )


def track_progress(state: PlannerState, inputs: PlannerInput) -> tuple[PlannerState, bool]:
    """Return the state with its progress updated, and whether the robot has stalled.

    A robot may stand at its goal, without scans, and where it may be giving way. During a manoeuvre its time does not
    run: `step_manoeuvre` has a patience of its own, and reports `has_given_up`.
    """
    progress, has_given_up = state.progress, state.manoeuvre.has_given_up
    has_moved = not distance_to(inputs.position, progress.position) <= find_progress_distance(inputs)
    manoeuvres = len(state.manoeuvre.poses) > 0
    if may_stand(state, inputs) or ((has_moved or manoeuvres) and not has_given_up):
        progress = progress._replace(position=inputs.position.copy(), time=inputs.time)
        return replace_fields(state, progress=progress), False
    if has_given_up or inputs.time - progress.time > inputs.parameters.progress_timeout:
        return replace_fields(state, progress=progress._replace(time=inputs.time)), True
    return state, False


def may_stand(state: PlannerState, inputs: PlannerInput) -> bool:
    """Return whether the robot is at its goal, was without scans, or may be giving way to a moving obstacle."""
    scan = inputs.observation.scan
    if inputs.interval > SILENT_SHARE * inputs.parameters.progress_timeout:
        return True
    if scan.motion is not None and is_any_near(scan.distances[scan.moving], inputs):
        return True
    approaches = state.status is PlannerStatus.APPROACHING and len(state.route.path) > 0
    reach = max(inputs.goal_tolerance, find_progress_distance(inputs))
    return approaches and distance_to(inputs.position, state.route.path[-1]) < reach


def is_any_near(distances: np.ndarray, inputs: PlannerInput) -> bool:
    """Return whether the robot may be giving way to something at one of these distances, m."""
    return bool((distances < AVOIDED_WITHIN * inputs.cover_radius).any())


def find_progress_distance(inputs: PlannerInput) -> float:
    """Return the length of a motion that counts as progress, m."""
    return PROGRESS_DISTANCE * inputs.cover_radius


def find_failed_path(state: PlannerState, inputs: PlannerInput) -> np.ndarray:
    """Return the path (k, 2) on which a robot has stalled; none for a disc that still turns to it."""
    path = np.vstack((state.guidance.path, state.route.beyond))
    if inputs.manoeuvre_context is not None or not is_turning(state):
        return path
    return path if not len(path) or is_facing(inputs, path[0]) else EMPTY_PATH


def update_roadmap(
    state: PlannerState, current_region: StarRegion, check: PlanCheck, has_stalled: bool, inputs: PlannerInput
) -> PlannerState:
    """Add a node where one is due, and cut back the regions that the scan contradicts.

    With a new node the path is discarded, so that another one is planned.
    """
    node_distance = distance_to(inputs.position, state.progress.node_position)
    is_spaced = node_distance > inputs.parameters.spacing(inputs.cover_radius)
    is_due = (
        has_stalled
        or (is_at_exit(state, inputs) and node_distance >= 0.5 * PASSED_DISTANCE * inputs.cover_radius)
        or is_node_due(state, current_region, check, is_spaced)
        or (inputs.has_limited_view and sees_exit_after_turn(state, current_region, inputs))
    )
    if not (is_due or is_spaced):
        return state
    regions = find_consistent_regions(state.roadmap, inputs.observation, inputs.margins, inputs.cover_radius)
    is_contradicted = regions is not state.roadmap.regions
    roadmap = replace_regions(state.roadmap, regions, inputs.margins, inputs.cover_radius)
    progress = state.progress._replace(node_position=inputs.position.copy())
    state = replace_fields(state, roadmap=roadmap, progress=progress)
    return add_latest_node(state, inputs) if is_contradicted or is_due else state


def is_node_due(state: PlannerState, region: StarRegion, check: PlanCheck, is_spaced: bool) -> bool:
    """Return whether to add a node with the region of the latest scan, `is_spaced` from the last one added or omitted.

    A node is due at the start, every `node_spacing` (with a map from an earlier goal only if enough of the region is
    new), when the probe of the exit is seen, and outside all regions.
    """
    if check.sees_probe or check.is_outside or not len(state.roadmap):
        return True
    return is_spaced and not (
        state.progress.began_with_map and measure_uncovered_share(region, state.roadmap.union) <= NEW_SHARE
    )


def is_at_exit(state: PlannerState, inputs: PlannerInput) -> bool:
    """Return whether the robot is at the viewpoint of the exit."""
    viewpoint = None if state.route.exit is None else state.route.exit[0]
    return viewpoint is not None and distance_to(inputs.position, viewpoint) < PASSED_DISTANCE * inputs.cover_radius


def discard_blocked_path(state: PlannerState, check: PlanCheck, inputs: PlannerInput) -> PlannerState:
    """Discard a path that the scan shows to be blocked, and remember the hits that do.

    At an exit whose probe was not seen on the way the path is discarded, too, so that the exit may be closed.
    """
    if not len(state.route.path):
        return state
    if is_at_exit(state, inputs) and not state.is_retrying:
        state = discard_path(state)
    points = find_narrow_gap_hits(state, inputs) if check.is_uncertain or state.is_retrying else EMPTY_PATH
    if check.is_blocked:
        points = np.vstack((points, bridge_observed_hits(inputs.observation, inputs.margins, inputs.cover_radius)))
    if not len(points):
        return state
    roadmap = replace_fields(state.roadmap, grid=state.roadmap.grid.add_hits(points))
    return replace_fields(discard_path(state), roadmap=roadmap)


def discard_path(state: PlannerState) -> PlannerState:
    """Return the state without a path, so that one is planned."""
    return replace_fields(state, route=state.route._replace(path=EMPTY_PATH))


def drop_passed_points(state: PlannerState, check: PlanCheck) -> PlannerState:
    """Return the state with the path still ahead; without a path if the robot has lost sight of it."""
    if check.has_strayed:
        return discard_path(state)
    if not check.passed_count:
        return state
    return replace_fields(state, route=state.route._replace(path=state.route.path[check.passed_count :]))


def replan(state: PlannerState, has_stalled: bool, inputs: PlannerInput) -> PlannerState:
    """Return the state with a new route, or in a dead end.

    Before the first plan, a map without a route is forgotten: the scan may be faulty, or what boxes the robot in hides
    the rest, and may leave.
    """
    region = inputs.observation.region
    assert region is not None
    # the region is smaller than a step of progress, though the lidar sees farther
    is_boxed_in = region.reach < find_progress_distance(inputs) < region.limit.max()
    has_no_plan = state.progress.plan_count == 0
    is_before_first_plan = has_no_plan and not has_stalled
    state, route = find_open_route(state, is_before_first_plan, is_boxed_in, inputs)
    if route is not None:
        return start_route(state, route, inputs)
    if is_before_first_plan or (is_boxed_in and has_no_plan):
        return forget_all(state, inputs)
    state = replace_fields(state, route=Route())
    return state if is_boxed_in else enter_dead_end(state, inputs)


def start_route(state: PlannerState, route: Route, inputs: PlannerInput) -> PlannerState:
    """Return the state with a route that begins where the robot is."""
    return replace_fields(
        state,
        status=PlannerStatus.APPROACHING if route.exit is None else PlannerStatus.EXPLORING,
        route=route._replace(start=inputs.position.copy()),
        progress=state.progress._replace(plan_count=state.progress.plan_count + 1),
    )


def forget_all(state: PlannerState, inputs: PlannerInput) -> PlannerState:
    """Return the state before the first scan, but for keep-outs and the time without progress."""
    keep_outs = replace_fields(state.roadmap.closures, failed_places=EMPTY_PATH)
    initial = PlannerState.initial(inputs.parameters, inputs.cover_radius, inputs.outer_radius, keep_outs)
    progress = initial.progress._replace(position=state.progress.position, time=state.progress.time)
    return replace_fields(initial, progress=progress)


def forget_roadmap(state: PlannerState, inputs: PlannerInput) -> PlannerState:
    """Return the state with an empty roadmap: of the places that are closed only keep-outs are kept."""
    roadmap = forget_all(state, inputs).roadmap
    return replace_fields(state, roadmap=roadmap, progress=state.progress._replace(node_position=UNSET_POSITION))


def enter_dead_end(state: PlannerState, inputs: PlannerInput) -> PlannerState:
    """Give the goal up, or wait while something is near that may leave.

    If that moves, all hits of the map are forgotten: some may be of other obstacles that moved.
    """
    scan = inputs.observation.scan
    if not is_any_near(scan.distances[scan.may_leave], inputs):
        return give_up(state, find_blocking_keep_outs(state, inputs), inputs)
    state = wait_for_obstacle(state, inputs)
    is_waiting = state.status is PlannerStatus.WAITING
    is_moving = is_any_near(scan.distances[scan.may_leave & ~scan.mappable], inputs)
    return forget_roadmap(state, inputs) if is_moving and is_waiting else state


def wait_for_obstacle(state: PlannerState, inputs: PlannerInput) -> PlannerState:
    """Return the state of a robot that waits for what bars its way; after `obstacle_patience` s it gives its goal up.

    The time begins anew where the robot has come nearer to its goal since.
    """
    distance, patience = distance_to(inputs.position, inputs.goal), inputs.parameters.obstacle_patience
    dead_end = state.progress.dead_end
    if dead_end is None or distance < dead_end.distance - find_progress_distance(inputs):
        dead_end = DeadEnd(inputs.time, distance)
    if patience and inputs.time - dead_end.since > patience:
        return give_up(state, f"an obstacle that may move, for which the robot has waited {patience:g} s", inputs)
    return replace_fields(state, status=PlannerStatus.WAITING, progress=state.progress._replace(dead_end=dead_end))


def give_up(state: PlannerState, cause: str, inputs: PlannerInput) -> PlannerState:
    """Return the state of a robot to which no way is left, for a cause that may be empty."""
    dead_end = DeadEnd(inputs.time, distance_to(inputs.position, inputs.goal), cause)
    return replace_fields(state, status=PlannerStatus.UNREACHABLE, progress=state.progress._replace(dead_end=dead_end))


def find_open_route(
    state: PlannerState, is_before_first_plan: bool, is_boxed_in: bool, inputs: PlannerInput
) -> tuple[PlannerState, Route | None]:
    """Find a route whose exit is open; return the state with what was closed or reopened, and the route, or None.

    An exit at which the robot stands is closed if its probe is occluded, and the search begins again, at most
    MOST_CLOSED times. As long as the probe is neither seen nor shown to be occluded, or once MOST_CLOSED exits are
    closed, the robot drives on towards it. Where no route is left, closures are reopened.
    """
    region, route = inputs.observation.region, None
    assert region is not None
    for closed_count in range(MOST_CLOSED + 1):
        current_region = state.roadmap.closures.open_part(region)
        route = find_route(state, current_region, inputs)
        if (
            route is None
            and not is_before_first_plan
            and (reopened_state := reopen_closures(state, inputs)) is not state
        ):
            return find_open_route(reopened_state, is_before_first_plan, is_boxed_in, inputs)
        if route is None or not is_at_unseen_exit(route, current_region, inputs):
            break
        assert route.exit is not None
        viewpoint, probe = route.exit
        if inputs.has_limited_view and not is_facing(inputs, probe):
            return state, route._replace(path=probe[None])  # the lidar may not have looked there yet
        if state.is_retrying or is_boxed_in:
            break
        if closed_count == MOST_CLOSED or not is_probe_occluded(state, viewpoint, probe, inputs):
            return state, route._replace(path=probe[None])
        state = close_path(state, np.vstack((route.path, route.beyond)), inputs)
    return state, route


def is_at_unseen_exit(route: Route, current_region: StarRegion, inputs: PlannerInput) -> bool:
    """Return whether a route leaves the regions where the robot is, and the latest scan does not show its probe."""
    if route.exit is None or distance_to(route.exit[0], inputs.position) > PASSED_DISTANCE * inputs.cover_radius:
        return False
    return find_covering_region(current_region.as_union, *route.exit[1], 0.0) < 0
