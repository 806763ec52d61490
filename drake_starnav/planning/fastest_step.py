"""The planner's step along the fastest path: the roadmap grows as usual and is searched only without such a path."""

import dataclasses

import numpy as np

from drake_starnav.planning.fastest_path import ProgressMonitor, fastest_path, narrowest_place
from drake_starnav.planning.parameters import PlannerParameters
from drake_starnav.planning.planner import check_beams, node_is_due, node_spacing_driven, plan_step
from drake_starnav.planning.roadmap import StarRoadmap, extended, impassable_points
from drake_starnav.planning.state import NO_PATH, PlannerInput, PlannerState, PlannerStatus
from drake_starnav.regions.observation import Observation
from drake_starnav.robot import RobotParameters

NO_PLACES = np.zeros((0, 2))


def fastest_step(state: PlannerState, now: PlannerInput, robot: RobotParameters) -> PlannerState:
    """One update of the planner along the fastest path; see `fastest_path`.

    Every scan's hits are added to the distance grid, and each update plans a new path. Places closed for lack of
    progress are reopened if they leave no path; if there is still none, the roadmap is searched as in `plan_step`.

    Args:
        state, now: as for `plan_step`.
        robot: size and speed limit.

    Raises:
        StarnavError: as `plan_step`.
    """
    seen, position, goal, time, parameters = now.seen, now.position, now.goal, now.time, now.parameters
    if state.status is PlannerStatus.UNREACHABLE or seen.region is None:
        return state
    check_beams(state.roadmap, seen)
    state = _grown(state, seen, position, parameters, robot)
    stall_points = state.progress_monitor.stall_points
    path, to_go = _path(state.roadmap, position, goal, stall_points, robot)
    if not len(path) and len(stall_points):
        stall_points = NO_PLACES
        path, to_go = _path(state.roadmap, position, goal, stall_points, robot)
    if not len(path):
        if state.progress_monitor.followed:  # the rest of that path leads nowhere
            state = dataclasses.replace(state, path=NO_PATH, progress_monitor=ProgressMonitor())
        return plan_step(state, now)
    progress_monitor, stalled = dataclasses.replace(
        state.progress_monitor, stall_points=stall_points, followed=True
    ).watched(to_go, time)
    place = narrowest_place(state.roadmap.hits, path, robot.radius) if stalled else None
    if place is not None:
        progress_monitor = dataclasses.replace(progress_monitor, stall_points=np.vstack((stall_points, place)))
    arrives = np.hypot(*(path[-1] - goal)) <= parameters.grid_resolution
    return dataclasses.replace(
        state,
        path=np.vstack((path[:-1], goal)) if arrives else path,
        status=PlannerStatus.APPROACHING if arrives else PlannerStatus.EXPLORING,
        target=None,
        progress_monitor=progress_monitor,
        anticipated=None,
        plans=state.plans + 1,
    )


def _grown(
    state: PlannerState,
    seen: Observation,
    position: np.ndarray,
    parameters: PlannerParameters,
    robot: RobotParameters,
) -> PlannerState:
    """The state with the scan's hits added to the distance grid and, if one is due, with a new node."""
    assert seen.region is not None
    points = impassable_points(seen.scan, seen.pose, parameters, robot.radius)
    roadmap = dataclasses.replace(state.roadmap, hits=state.roadmap.hits.stamped(points))
    node_position = state.node_position
    if node_is_due(state, seen.region, position, parameters):
        roadmap = extended(roadmap, seen.region, seen.scan, seen.pose, parameters, robot.radius, stamp=False)
        node_position = seen.pose[:2].copy()
    elif node_spacing_driven(state, position, parameters):
        node_position = position.copy()
    return dataclasses.replace(state, roadmap=roadmap, node_position=node_position)


def _path(
    roadmap: StarRoadmap, position: np.ndarray, goal: np.ndarray, stall_points: np.ndarray, robot: RobotParameters
) -> tuple[np.ndarray, float]:
    places = np.vstack((roadmap.stack.center, position, goal))
    return fastest_path(roadmap.hits, position, goal, places.min(axis=0), places.max(axis=0), stall_points, robot)
