"""Manoeuvres of a robot that is no disc: short sequences of turns and moves, where it is stuck on its path.

The roadmap is searched for the narrowest disc of the footprint, so its paths tell no heading. Where the robot stands
although it has a path, a way is searched in (x, y, yaw) with the exact footprint, to a place farther along the path. If
the robot is stuck again and again near one place, its way is closed for its footprint: it then counts as stalled, and
another way is planned, on which it may try anew.
"""

import math
from itertools import pairwise

import numpy as np

from drake_starnav.geometry.polyline import measure_arc_lengths, measure_segment_distance, resample_polyline
from drake_starnav.manoeuvres.pose_search import CELL, NEAR_GOAL, REACH, SPACING, search_poses
from drake_starnav.planning.planner import can_plan, may_stand, plan_step
from drake_starnav.planning.state import (
    EMPTY_PATH,
    NO_POSES,
    ManoeuvreContext,
    ManoeuvreState,
    PlannerInput,
    PlannerState,
)
from drake_starnav.robot import Base
from drake_starnav.robot.limits import compute_time_from_rest, wrap_angle
from drake_starnav.surroundings.chords import Chords
from drake_starnav.utils.snapshot import replace_fields

RANK_COST = 1.06
"""What each rank in the list of goals costs, beside the distance to a goal; all lengths here are in outer radii of the
robot."""
GOALS_ALONG_PATH = ((1.9, 0.6), (0.95, 0.6), (3.8, 0.6), (1.9, math.inf))
"""Goals along the path: how far ahead, and by how much the heading may be off the path's, rad."""
EXTRA_MARGINS = (0.006, 0.019, 0.032, 0.045)
"""Added to the certificate's margin, since its scans differ; a wider one after each manoeuvre that it refused."""
STUCK_TIME = 0.3
"""A robot that has not moved for this long, or for twice the time that it takes from rest, is stuck, s."""
MOVED, TURNED = 0.021, 0.05
"""It has moved if it did so by more than this, or turned by more than this, rad."""
CIRCLED_ANGLE = 2.5 * math.pi
"""A robot that turned one way by this, rad, and came no nearer to the end of its path is stuck, too: it circles."""
SAME_PLACE = 1.27
"""Extent of a place: a manoeuvre ends where the robot may turn as it likes for this length of its path."""
TRIES, REMEMBERED_TRIES = 3, 8
"""A place where TRIES of the REMEMBERED_TRIES last manoeuvres began counts as failed."""
AT_POSE, AT_HEADING = 0.021, 0.02
"""A pose of a manoeuvre is reached this near to it, along the motion, or in heading, rad."""
DOCKED_HEADING = 0.04
"""A robot at its goal with this error of its heading need not manoeuvre, rad."""
DOCKS = np.array([(x, y, 0.0, 0.0, 0.0) for x, y in ((0.6, 0.0), (0.0, 0.6), (-0.6, 0.0), (0.0, -0.6))])
"""Offsets of docking places beside the goal, along x and y of W, in shares of its tolerance."""


def plan_with_manoeuvres(state: PlannerState, inputs: PlannerInput) -> PlannerState:
    """Update the planner as `plan_step` does, and the manoeuvres of a robot that is no disc."""
    if not can_plan(state, inputs):
        return state
    state, context = plan_step(state, inputs), inputs.manoeuvre_context
    if context is None:
        return state
    pose, patience = inputs.observation.pose, inputs.parameters.progress_timeout
    if math.isfinite(inputs.heading):
        dock = np.array((*inputs.goal, inputs.heading, inputs.goal_tolerance))
        manoeuvre = step_docking(state.manoeuvre, dock, pose, inputs.time, context, patience)
    else:
        path = EMPTY_PATH if may_stand(state, inputs) else state.route.path
        manoeuvre = step_manoeuvre(state.manoeuvre, path, pose, inputs.time, context, patience)
    return replace_fields(state, manoeuvre=manoeuvre)


def step_manoeuvre(
    previous_state: ManoeuvreState,
    path: np.ndarray,
    pose: np.ndarray,
    time: float,
    context: ManoeuvreContext,
    patience: float,
) -> ManoeuvreState:
    """Return the manoeuvre after a scan, without the poses that the robot has reached; a new one if it is stuck.

    Args:
        previous_state: the manoeuvre after the previous scan.
        path: shape (k, 2), way points ahead, W, m; none: the robot may stand.
        pose: (x, y, yaw) of the robot, W.
        time: of the scan, s.
        context: of the robot.
        patience: a manoeuvre is given up if no pose of it is reached for this long, s.
    """
    state, radius = previous_state._replace(has_given_up=False), context.footprint.radius
    if previous_state.has_given_up:
        state = state._replace(attempts=EMPTY_PATH)
    state = update_turned_angle(state, path, pose, radius)
    if not len(path) or has_moved(previous_state, pose, radius):
        state = state._replace(pose=pose.copy(), standing_since=time)
    if len(state.poses):
        if not len(path) or is_roomy(pose, path, context):
            return end_manoeuvre(state, time)
        next_state = drop_reached_poses(state, pose, time, context)
        is_still = time - state.standing_since >= 2.0 * find_stuck_time(context)
        if next_state is not state or (time - state.since < patience and not is_still):
            return next_state
        state = state._replace(poses=NO_POSES)
    if time - state.standing_since < find_stuck_time(context) and abs(state.turned_angle) < CIRCLED_ANGLE:
        return state
    state = state._replace(turned_angle=0.0)
    tries = len(find_attempts_near(state, pose, SAME_PLACE * radius))
    if tries >= TRIES:
        return state._replace(standing_since=time, has_given_up=True)
    poses = find_manoeuvre(pose, path, context, tries)
    return begin_manoeuvre(state, poses, state.attempts, pose, time)


def step_docking(
    previous_state: ManoeuvreState,
    dock: np.ndarray,
    pose: np.ndarray,
    time: float,
    context: ManoeuvreContext,
    patience: float,
) -> ManoeuvreState:
    """Return the manoeuvre after a scan of a robot that is to have a heading at its goal.

    It starts an attempt when it has stood for the stuck time, times one plus the attempts so far. Arguments as of
    `step_manoeuvre`; `dock` is (x, y, yaw) of the goal, W, and its tolerance, m: a robot that turns on the spot gets to
    the very place.
    """
    state = previous_state._replace(has_given_up=False)
    radius = context.footprint.radius
    turns_on_the_spot = context.base.turns_on_the_spot
    if has_moved(previous_state, pose, radius):
        state = state._replace(pose=pose.copy(), standing_since=time if turns_on_the_spot else state.standing_since)
    if len(state.poses):
        next_state = drop_reached_poses(state, pose, time, context)
        if next_state is not state or time - state.since < patience:
            return next_state
        return end_manoeuvre(state, time)
    attempts = find_attempts_near(state, pose, REACH * radius)
    is_docked = abs(math.remainder(dock[2] - pose[2], 2.0 * math.pi)) < DOCKED_HEADING
    is_docked = is_docked and not (turns_on_the_spot and math.dist(dock[:2], pose[:2]) >= dock[3])
    if is_docked or time - state.standing_since < find_stuck_time(context) * (1 + len(attempts)):
        return state
    goals = np.array([(*dock[:3], 0.0 if turns_on_the_spot else AT_HEADING, 0.0)])
    if turns_on_the_spot:  # or beside it, where the walls leave more room
        goals = np.vstack((goals, goals + DOCKS * dock[3]))
    poses = _search_manoeuvre(pose, goals, context, len(attempts))
    return begin_manoeuvre(state, poses, attempts, pose, time)


def drop_reached_poses(
    state: ManoeuvreState, pose: np.ndarray, time: float, context: ManoeuvreContext
) -> ManoeuvreState:
    """Return the state without the poses that are reached; the same state if none is."""
    passed_count = count_reached(pose, state.poses, context.base, context.footprint.radius)
    if passed_count == len(state.poses):
        return end_manoeuvre(state, time)
    return state._replace(poses=state.poses[passed_count:], since=time) if passed_count else state


def begin_manoeuvre(
    state: ManoeuvreState, poses: np.ndarray, attempts: np.ndarray, pose: np.ndarray, time: float
) -> ManoeuvreState:
    """Return the state with poses (k, 4) that are driven from now on, and one more attempt, at the robot's pose."""
    attempts = np.vstack((attempts[1 - REMEMBERED_TRIES :], pose[:2]))
    return state._replace(poses=poses, since=time, standing_since=time, attempts=attempts)


def end_manoeuvre(state: ManoeuvreState, time: float) -> ManoeuvreState:
    """Return the state without a manoeuvre; the robot counts as moving now."""
    return state._replace(poses=NO_POSES, standing_since=time)


def find_attempts_near(state: ManoeuvreState, pose: np.ndarray, distance: float) -> np.ndarray:
    """Return where attempts began within a distance (m) of a pose, shape (n, 2), W, m."""
    return state.attempts[np.hypot(*(state.attempts - pose[:2]).T) < distance]


def find_stuck_time(context: ManoeuvreContext) -> float:
    """Return how long a robot stands before it counts as stuck, s."""
    limits = context.limits
    start_time = compute_time_from_rest(MOVED * context.footprint.radius, limits.max_speed, limits.max_acceleration)
    return max(STUCK_TIME, 2.0 * start_time)


def has_moved(previous_state: ManoeuvreState, pose: np.ndarray, outer_radius: float) -> bool:
    """Return whether a robot at a pose has moved by more than MOVED outer radii, or turned, since the state's pose."""
    x, y, yaw = previous_state.pose.tolist()
    if not math.dist(pose[:2], (x, y)) < MOVED * outer_radius:
        return True
    return abs(math.remainder(pose[2] - yaw, 2.0 * math.pi)) > TURNED


def update_turned_angle(
    previous_state: ManoeuvreState, path: np.ndarray, pose: np.ndarray, outer_radius: float
) -> ManoeuvreState:
    """Return the state with the least that was left of the path (k, 2), and how far the robot has turned since."""
    if not len(path):
        return previous_state._replace(least_path_left=math.inf, turned_angle=0.0)
    length_left, end = float(measure_arc_lengths(np.vstack((pose[:2], path)))[-1]), (*path[-1], pose[2])
    if (
        length_left < previous_state.least_path_left - MOVED * outer_radius
        or not math.dist(path[-1], previous_state.end[:2]) < SAME_PLACE * outer_radius
    ):
        return previous_state._replace(least_path_left=length_left, turned_angle=0.0, end=end)
    return previous_state._replace(
        turned_angle=previous_state.turned_angle + math.remainder(pose[2] - previous_state.end[2], 2.0 * math.pi),
        end=end,
    )


def is_roomy(pose: np.ndarray, path: np.ndarray, context: ManoeuvreContext) -> bool:
    """Return whether the robot may turn freely on the path (k, 2) ahead of a pose, so that it needs no manoeuvre."""
    if not context.base.turns_on_the_spot:
        return False
    way, needed_distance = np.vstack((pose[:2], path)), context.footprint.radius + context.margin
    places_ahead = resample_polyline(way, 0.5 * SAME_PLACE * context.footprint.radius)[:3]
    hits = context.surroundings.certified_star.boundary.points
    return all((measure_segment_distance(hits, a, b) > needed_distance).all() for a, b in pairwise(places_ahead))


def count_reached(pose: np.ndarray, poses: np.ndarray, base: Base, radius: float) -> int:
    """Return how many of the poses (k, 4) of a manoeuvre a robot of a radius (m) at a pose (x, y, yaw) has reached."""
    count, tolerance = 0, AT_POSE * radius
    for x, y, yaw, gear in poses.tolist():
        dx, dy = x - pose[0], y - pose[1]
        if gear == 0.0:
            is_reached = abs(math.remainder(yaw - pose[2], 2.0 * math.pi)) < AT_HEADING
        elif base.holonomic:
            is_reached = math.hypot(dx, dy) < 2.0 * tolerance
        else:
            is_reached = gear * (math.cos(pose[2]) * dx + math.sin(pose[2]) * dy) < tolerance
        if not is_reached:
            break
        count += 1
    return count


def find_manoeuvre(pose: np.ndarray, path: np.ndarray, context: ManoeuvreContext, tried_count: int) -> np.ndarray:
    """Return poses (k, 4) of a manoeuvre, as of `ManoeuvreState`; none if no way is found.

    Args:
        pose: (x, y, yaw) of the robot, W.
        path: shape (k, 2), way points ahead, W, m.
        context: of the robot.
        tried_count: how many manoeuvres failed here; others are tried then.
    """
    goals, outer_radius = _list_goals(pose, path, context), context.footprint.radius
    goal_distances = np.hypot(*(goals[:, :2] - pose[:2]).T)
    goal_turns = np.array([wrap_angle(turn) for turn in goals[:, 2] - pose[2]])
    first = tried_count % len(goals)
    costs = RANK_COST * outer_radius * np.roll(np.arange(len(goals)), first) + np.maximum(
        goal_distances[first] - goal_distances, 0.0
    )
    is_ahead = (goal_distances >= NEAR_GOAL * outer_radius) | (np.abs(goal_turns) >= goals[:, 3])
    return _search_manoeuvre(pose, np.column_stack((goals, costs))[is_ahead], context, tried_count)


def _search_manoeuvre(pose: np.ndarray, goals: np.ndarray, context: ManoeuvreContext, tried_count: int) -> np.ndarray:
    """Return the poses of a way to some goals, with a margin that grows with the attempts that failed here."""
    outer_radius = context.footprint.radius
    chords = _thin_out_chords(context.surroundings.view.chords, pose[:2], outer_radius)
    margin = context.margin + EXTRA_MARGINS[tried_count % len(EXTRA_MARGINS)] * outer_radius
    return search_poses(
        pose, goals, context.motion_primitives, context.footprint, margin, (chords, context.surroundings.further_views)
    )


def _list_goals(pose: np.ndarray, path: np.ndarray, context: ManoeuvreContext) -> np.ndarray:
    """Return goals, the best first, shape (n, 4): x, y, yaw, and the largest error of the heading, m and rad."""
    goals = []
    line = np.vstack((pose[:2], path))
    arc_lengths, outer_radius = measure_arc_lengths(line), context.footprint.radius
    for look, heading_tolerance in dict.fromkeys(
        (min(look * outer_radius, float(arc_lengths[-1])), heading_tolerance)
        for look, heading_tolerance in GOALS_ALONG_PATH
    ):
        x, y = (float(np.interp(look, arc_lengths, coordinate)) for coordinate in line.T)
        leg = min(max(int(np.searchsorted(arc_lengths, look)), 1), len(line) - 1)
        dx, dy = line[leg] - line[leg - 1]
        goals.append((x, y, math.atan2(dy, dx), heading_tolerance))
    return np.array(goals)


def _thin_out_chords(chords: Chords, place: np.ndarray, outer_radius: float) -> Chords:
    """Return what is within the search's reach, thinned out to the nearest ones."""
    middle = 0.5 * (chords.ends[:, :2] + chords.ends[:, 2:])
    chord_distances = np.hypot(*(middle - place).T)
    near_chords = np.argsort(chord_distances, kind="stable")[
        : int((chord_distances < (REACH + 1.0) * outer_radius).sum())
    ]
    cells = np.floor(middle[near_chords] / (SPACING * CELL * outer_radius)).astype(np.int64)
    _, first = np.unique(cells @ (1 << 32, 1), return_index=True)  # of the places in a cell
    kept_chords = near_chords[np.sort(first)]
    return Chords(chords.ends[kept_chords], chords.is_surface[kept_chords], chords.occludes[kept_chords], chords.center)
