"""The planner as a pure step: planner state and a new scan in, planner state with a path out."""

import math

import numpy as np

from drake_starnav.errors import StarnavError
from drake_starnav.planning.closures import AVERAGED_SCANS, barred_by, closed, hidden, reopened, too_narrow, with_latest
from drake_starnav.planning.guidance import PASSED_DISTANCE, Guidance
from drake_starnav.planning.impassable import impassable_points
from drake_starnav.planning.looking import faces, is_turning, looking_aside, sees_all_around, turned_to_look
from drake_starnav.planning.manoeuvre import docking, manoeuvring
from drake_starnav.planning.map_revision import remaining
from drake_starnav.planning.monitoring import PlanCheck, check_plan, distance_to, points_ahead
from drake_starnav.planning.roadmap import StarRoadmap, revised, uncovered_share
from drake_starnav.planning.route import Route, find_route
from drake_starnav.planning.state import EMPTY_PATH, UNSET_POSITION, PlannerInput, PlannerState, PlannerStatus, Wait
from drake_starnav.surroundings.observation import Observation
from drake_starnav.surroundings.obstruction import AVOIDED
from drake_starnav.surroundings.region_union import cover_at
from drake_starnav.surroundings.star_region import StarRegion
from drake_starnav.utils.snapshot import replaced

PROGRESS_DISTANCE = 0.6
"""Motion that counts as progress, in radii of the robot."""
SILENT_SHARE = 0.5
"""The sensor counts as silent when it sends no scan for this share of `progress_timeout`."""
NEW_SHARE = 0.01
"""With a map from an earlier goal, a region is worth a node only if more than this share of its area is new."""
MOST_CLOSED = 6
"""Exits that are closed at most in one update."""


def plan_step(state: PlannerState, inputs: PlannerInput) -> PlannerState:
    """One update of the planner: learn from the scan, close a way that failed, and plan a path if there is none.

    A new path is also planned as soon as the latest scan blocks the optimistic path beyond the exit. On its way to the
    exit, the robot turns towards that path as soon as the latest scan shows it to be free.

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
    state, stalled = watched(state, inputs)
    closures = state.roadmap.closures
    here = closures.open_part(observation.region)
    check = check_plan(state, here, inputs)
    failed = _failed_way(state, inputs) if stalled else EMPTY_PATH
    state = replaced(state, recent=(*state.recent, observation)[-AVERAGED_SCANS:])
    state = _unless_blocked(_grown(state, here, check, stalled, inputs), check, inputs)
    if len(failed):
        state = closed(state, failed, inputs)
    if len(state.path):
        state = _along_path(state, check, inputs)
    if not len(state.path):
        state = _planned(state, stalled, inputs)
    if state.roadmap.closures is not closures:
        here = state.roadmap.closures.open_part(observation.region)
    return _manoeuvred(_anticipating(looking_aside(state, inputs), here, inputs), inputs)


def _anticipating(state: PlannerState, here: StarRegion, inputs: PlannerInput) -> PlannerState:
    """The state with guidance to the last point of the optimistic path in sight inside `here`, the region's open part.

    None on the way to another way point or to the goal, and while none of the next part of that path is in sight.
    """
    if state.aside is not None or state.status is not PlannerStatus.EXPLORING or len(state.path) != 1:
        return state
    path = state.optimistic_path
    ahead = points_ahead(path, *inputs.position.tolist(), tuple(here.as_union), inputs.robot_radius)
    if ahead < 0:
        return state
    return replaced(state, aside=Guidance(path[ahead : ahead + 1], False, here.as_union))


def _manoeuvred(state: PlannerState, inputs: PlannerInput) -> PlannerState:
    """The state with the manoeuvres of a robot that is no disc."""
    if inputs.body is None:
        return state
    pose, patience = inputs.observation.pose, inputs.parameters.progress_timeout
    if math.isfinite(inputs.heading):
        dock = np.array((*inputs.goal, inputs.heading, inputs.goal_tolerance))
        after = docking(state.manoeuvring, dock, pose, inputs.time, inputs.body, patience)
        return replaced(state, manoeuvring=after)
    path = EMPTY_PATH if _may_stand(state, inputs) else state.path
    after = manoeuvring(state.manoeuvring, path, pose, inputs.time, inputs.body, patience)
    return replaced(state, manoeuvring=after)


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
    moves = len(manoeuvres.poses) > 0 or not distance_to(inputs.position, state.progress_position) <= _progress(inputs)
    if may_stand or (moves and not manoeuvres.gives_up):
        return replaced(state, progress_position=inputs.position.copy(), progress_time=inputs.time), False
    if manoeuvres.gives_up or inputs.time - state.progress_time > inputs.parameters.progress_timeout:
        return replaced(state, progress_time=inputs.time), True
    return state, False


def _may_stand(state: PlannerState, inputs: PlannerInput) -> bool:
    """Whether the robot is at its goal, was without scans, or may be giving way to a moving obstacle."""
    scan = inputs.observation.scan
    if inputs.interval > SILENT_SHARE * inputs.parameters.progress_timeout:
        return True
    if scan.motion is not None and _is_near(scan.distances[scan.moving], inputs):
        return True
    approaching = state.status is PlannerStatus.APPROACHING and len(state.path) > 0
    return approaching and distance_to(inputs.position, state.path[-1]) < max(inputs.goal_tolerance, _progress(inputs))


def _is_near(distances: np.ndarray, inputs: PlannerInput) -> bool:
    """Whether the robot may be giving way to something at one of these distances, m."""
    return bool((distances < AVOIDED * inputs.robot_radius).any())


def _forget_hits(state: PlannerState, inputs: PlannerInput) -> PlannerState:
    """Return the state with an empty roadmap: of the places that are closed only walls are kept."""
    walls = replaced(state.roadmap.closures, failed=EMPTY_PATH)
    roadmap = StarRoadmap.empty(inputs.parameters, inputs.robot_radius, inputs.swept_radius, walls)
    return replaced(state, roadmap=roadmap, node_position=UNSET_POSITION)


def _progress(inputs: PlannerInput) -> float:
    return PROGRESS_DISTANCE * inputs.robot_radius


def node_is_due(state: PlannerState, region: StarRegion, check: PlanCheck, spaced: bool) -> bool:
    """Whether to add a node with the region of the latest scan, `spaced` from where one was last added or omitted.

    A node is due at the start, every `node_spacing` (with a map from an earlier goal only if enough of the region is
    new), when the target's probe is seen, and outside all regions.
    """
    if check.sees_probe or check.outside or not len(state.roadmap):
        return True
    return spaced and not (state.began_with_map and uncovered_share(region, state.roadmap.union) <= NEW_SHARE)


def _grown(
    state: PlannerState, here: StarRegion, check: PlanCheck, stalled: bool, inputs: PlannerInput
) -> PlannerState:
    """The state with a node where one is due, and with regions cut back where the scan contradicts them.

    It has no path then.
    """
    observation, position = inputs.observation, inputs.position
    spaced = distance_to(position, state.node_position) > inputs.parameters.spacing(inputs.robot_radius)
    due = stalled or _arrives_to_look(state, inputs) or node_is_due(state, here, check, spaced)
    due = due or turned_to_look(state, here, inputs)
    if not (due or spaced):
        return state
    regions = remaining(state.roadmap, observation, inputs.margins, inputs.robot_radius)
    changed = regions is not state.roadmap.regions
    roadmap = revised(state.roadmap, regions, inputs.margins, inputs.robot_radius)
    state = replaced(state, roadmap=roadmap, node_position=position.copy())
    return with_latest(state, inputs) if changed or due else state


def _is_at_exit(state: PlannerState, inputs: PlannerInput) -> bool:
    passed = PASSED_DISTANCE * inputs.robot_radius
    return state.target is not None and distance_to(inputs.position, state.target[0]) < passed


def _arrives_to_look(state: PlannerState, inputs: PlannerInput) -> bool:
    """Whether the robot is at the exit and has no node there."""
    away = distance_to(inputs.position, state.node_position)
    return _is_at_exit(state, inputs) and away >= 0.5 * PASSED_DISTANCE * inputs.robot_radius


def _unless_blocked(state: PlannerState, check: PlanCheck, inputs: PlannerInput) -> PlannerState:
    """The state; with the hits that show the way to be blocked, and without a path, if they do.

    Nor has it a path at an exit whose probe was not seen on the way, so that the exit may be closed.
    """
    if not len(state.path):
        return state
    if _is_at_exit(state, inputs) and not state.doubting:
        state = replaced(state, path=EMPTY_PATH)
    points = too_narrow(state, inputs) if check.doubtful or state.doubting else EMPTY_PATH
    if check.obstructed:
        points = np.vstack((points, impassable_points(inputs.observation, inputs.margins, inputs.robot_radius)))
    if not len(points):
        return state
    roadmap = replaced(state.roadmap, hits=state.roadmap.hits.stamped(points))
    return replaced(state, roadmap=roadmap, path=EMPTY_PATH)


def _along_path(state: PlannerState, check: PlanCheck, inputs: PlannerInput) -> PlannerState:
    """The state with the path still ahead; without a path if the robot has lost sight of it."""
    if check.strayed:
        return replaced(state, path=EMPTY_PATH)
    return replaced(state, path=state.path[check.passed :]) if check.passed else state


def _failed_way(state: PlannerState, inputs: PlannerInput) -> np.ndarray:
    """The way (k, 2) on which a robot has stalled; none for a disc that still turns to it."""
    way = np.vstack((state.guidance.path, state.optimistic_path))
    turned = inputs.body is not None or not is_turning(state) or not len(way) or faces(inputs, way[0])
    return way if turned else EMPTY_PATH


def _planned(state: PlannerState, stalled: bool, inputs: PlannerInput) -> PlannerState:
    """The state with a new path; if there is none, the goal is unreachable.

    At the first look the scan may be at fault: one that shows no way at all is forgotten. So is one in which the robot
    cannot move, for what is in its way hides the rest, and may leave. While something is near that may leave, the robot
    waits; where that moves, hits are forgotten, as they may have been of its like.
    """
    region = inputs.observation.region
    assert region is not None
    boxed_in = region.reach < _progress(inputs) < region.limit.max()
    first = state.plans == 0 and not stalled
    state, route = _searched(state, first, boxed_in, inputs)
    if route is not None:
        return replaced(
            state,
            status=PlannerStatus.APPROACHING if route.exit is None else PlannerStatus.EXPLORING,
            path=route.path,
            target=route.exit,
            plans=state.plans + 1,
            plan_position=inputs.position.copy(),
            optimistic_path=route.beyond,
        )
    if first or (boxed_in and state.plans == 0):
        walls = replaced(state.roadmap.closures, failed=EMPTY_PATH)
        return replaced(
            PlannerState.initial(inputs.parameters, inputs.robot_radius, inputs.swept_radius, walls),
            progress_position=state.progress_position,
            progress_time=state.progress_time,
        )
    state = replaced(state, path=EMPTY_PATH, target=None)
    if boxed_in:
        return state
    scan = inputs.observation.scan
    if not _is_near(scan.distances[scan.may_leave], inputs):
        return replaced(state, status=PlannerStatus.UNREACHABLE, barred_by=barred_by(state, inputs))
    state = wait_for_obstacle(state, inputs)
    moves = _is_near(scan.distances[scan.may_leave & ~scan.mappable], inputs)
    return _forget_hits(state, inputs) if moves and state.wait is not None else state


def wait_for_obstacle(state: PlannerState, inputs: PlannerInput) -> PlannerState:
    """Return the state of a robot that waits for what bars its way; after `obstacle_patience` s it gives its goal up.

    The time begins anew where the robot has come nearer to its goal since.
    """
    distance, patience = distance_to(inputs.position, inputs.goal), inputs.parameters.obstacle_patience
    wait = state.wait
    if wait is None or distance < wait.distance - _progress(inputs):
        wait = Wait(inputs.time, distance)
    if patience and inputs.time - wait.since > patience:
        said = f"an obstacle that may move, for which the robot has waited {patience:g} s"
        return replaced(state, status=PlannerStatus.UNREACHABLE, wait=None, barred_by=said)
    return replaced(state, status=PlannerStatus.WAITING, wait=wait)


def _searched(
    state: PlannerState, first: bool, boxed_in: bool, inputs: PlannerInput
) -> tuple[PlannerState, Route | None]:
    """The state and the route in it. An exit at which the robot stands is closed if what is beyond it is hidden.

    As long as it is neither seen nor shown to be hidden, the robot drives on towards it. Where no way is left, what was
    closed is opened again, once more to be tried.
    """
    region, route = inputs.observation.region, None
    assert region is not None
    for _ in range(MOST_CLOSED):
        here = state.roadmap.closures.open_part(region)
        route = find_route(state, here, inputs)
        if route is None and not first and (again := reopened(state, inputs)) is not state:
            return _searched(again, first, boxed_in, inputs)
        if route is None or route.exit is None:
            break
        viewpoint, probe = route.exit
        passed = PASSED_DISTANCE * inputs.robot_radius
        if distance_to(viewpoint, inputs.position) > passed or cover_at(here.as_union, *probe, 0.0) >= 0:
            break
        if not sees_all_around(inputs) and not faces(inputs, probe):
            return state, route._replace(path=probe[None])  # the lidar may not have looked there yet
        if state.doubting or boxed_in:
            break
        if not hidden(state, viewpoint, probe, inputs):
            return state, route._replace(path=probe[None])
        state = closed(state, np.vstack((route.path, route.beyond)), inputs)
    return state, route
