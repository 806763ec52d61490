"""Manoeuvres of a robot that is no disc: short sequences of turns and moves, where it is stuck on its path.

The roadmap is searched for the narrowest disc of the footprint, so its paths tell no heading. Where the robot stands
although it has a path, a way is searched in (x, y, yaw) with the exact footprint, to a place farther along the path. If
the robot is stuck again and again near one place, its way is closed for its footprint: it then counts as stalled, and
another way is planned, on which it may try anew.
"""

import math
from itertools import pairwise
from typing import NamedTuple

import numpy as np

from drake_starnav.geometry.footprint import Footprint
from drake_starnav.geometry.polyline import distance_to_segment, measure_arc_lengths, resample_polyline
from drake_starnav.planning.pose_search import CELL, NEAR_GOAL, REACH, SPACING, search_poses
from drake_starnav.robot import Base
from drake_starnav.robot.limits import Limits, time_from_rest, wrap_angle
from drake_starnav.surroundings.chords import Chords
from drake_starnav.surroundings.surroundings import Surroundings

RANK_COST = 1.06
"""What a goal costs more than the one before it, beside the way by which it is nearer than the first; all lengths here
are in radii of the disc around the robot."""
LOOKS = ((1.9, 0.6), (0.95, 0.6), (3.8, 0.6), (1.9, math.inf))
"""Goals along the path: how far ahead, and by how much the heading may be off the path's, rad."""
EXTRA_MARGINS = (0.006, 0.019, 0.032, 0.045)
"""Added to the certificate's margin, since its scans differ; a wider one after each manoeuvre that it refused."""
STUCK = 0.3
"""A robot that has not moved for this long, or for twice the time that it takes from rest, is stuck, s."""
MOVED, TURNED = 0.021, 0.05
"""It has moved if it did so by more than this, or turned by more than this, rad."""
CIRCLED = 2.5 * math.pi
"""A robot that turned one way by this, rad, and came no nearer to the end of its path is stuck, too: it circles."""
SAME_PLACE = 1.27
"""Extent of a place: a manoeuvre ends where the robot may turn as it likes for this length of its path."""
TRIES, REMEMBERED = 3, 8
"""A place where TRIES of the REMEMBERED last manoeuvres began counts as failed."""
AT_POSE, AT_HEADING = 0.021, 0.02
"""A pose of a manoeuvre is reached this near to it, along the motion, or in heading, rad."""
DOCKED = 0.04
"""A robot at its goal with this error of its heading need not manoeuvre, rad."""
DOCKS = np.array([(x, y, 0.0, 0.0, 0.0) for x, y in ((0.6, 0.0), (0.0, 0.6), (-0.6, 0.0), (0.0, -0.6))])
"""Places beside a goal that serve as well, in shares of its tolerance."""
NO_POSES = np.zeros((0, 4))


class ManoeuvreContext(NamedTuple):
    """A robot that is no disc.

    Attributes:
        footprint: of the robot.
        star: what its certificate knows.
        margin: that the certificate keeps, m.
        moves: of its manoeuvres, as of `Base.moves`.
        limits: of its drive.
        base: how it moves.
    """

    footprint: Footprint
    surroundings: Surroundings
    margin: float
    moves: np.ndarray
    limits: Limits
    base: Base

    @property
    def stuck_time(self) -> float:
        """How long it stands before it counts as stuck, s."""
        limits = self.limits
        return max(
            STUCK, 2.0 * time_from_rest(MOVED * self.footprint.radius, limits.max_speed, limits.max_acceleration)
        )


class ManoeuvreState(NamedTuple):
    """What the planner knows of the robot's manoeuvres.

    Attributes:
        poses: shape (k, 4), still ahead: x, y, yaw in W, and the gear: 0 turns on the spot, 1 drives forwards, -1
            backwards.
        since: when one of them was last reached, s.
        pose: where the robot last moved to, shape (3,).
        still_since: since when it has been there, s.
        least_left: how much of its path was left where least was, m.
        winding: by how much it has turned since then, to the left, rad.
        end: x, y of the path's end, W, m, and the robot's heading at the last scan, rad.
        attempts: where the last ones began, or were searched in vain, since the way was last given up, shape (n, 2),
            W, m.
        gives_up: whether no more is tried on this way.
    """

    poses: np.ndarray = NO_POSES
    since: float = 0.0
    pose: np.ndarray = np.full(3, np.inf)
    still_since: float = 0.0
    least_left: float = math.inf
    winding: float = 0.0
    end: tuple[float, float, float] = (math.inf, math.inf, 0.0)
    attempts: np.ndarray = np.zeros((0, 2))
    gives_up: bool = False


def step_manoeuvre(
    before: ManoeuvreState, path: np.ndarray, pose: np.ndarray, time: float, context: ManoeuvreContext, patience: float
) -> ManoeuvreState:
    """Return the manoeuvres after a scan: what was reached is left out, and one begins if the robot is stuck.

    Args:
        before: those after the scan before.
        path: shape (k, 2), way points ahead, W, m; none: the robot may stand.
        pose: (x, y, yaw) of the robot, W.
        time: of the scan, s.
        context: of the robot.
        patience: a manoeuvre is given up if no pose of it is reached for this long, s.
    """
    after = before._replace(attempts=before.attempts[:0], gives_up=False) if before.gives_up else before
    after, unit = update_winding(after, path, pose, context.footprint.radius), context.footprint.radius
    if not len(path) or _has_moved(before, pose, unit):
        after = after._replace(pose=pose.copy(), still_since=time)
    if len(after.poses):
        passed = count_reached(pose, after.poses, context.base, unit)
        if passed == len(after.poses) or not len(path) or is_roomy(pose, path, context):
            return after._replace(poses=NO_POSES, still_since=time)
        if passed:
            return after._replace(poses=after.poses[passed:], since=time)
        if time - after.since < patience and time - after.still_since < 2.0 * context.stuck_time:
            return after
        after = after._replace(poses=NO_POSES)
    if time - after.still_since < context.stuck_time and abs(after.winding) < CIRCLED:
        return after
    after = after._replace(winding=0.0)
    tries = int((np.hypot(*(after.attempts - pose[:2]).T) < SAME_PLACE * unit).sum())
    if tries >= TRIES:
        return after._replace(still_since=time, gives_up=True)
    attempts = np.vstack((after.attempts[1 - REMEMBERED :], pose[:2]))
    poses = find_manoeuvre(pose, path, context, tries)
    return after._replace(poses=poses, since=time, still_since=time, attempts=attempts)


def step_docking(
    before: ManoeuvreState, dock: np.ndarray, pose: np.ndarray, time: float, context: ManoeuvreContext, patience: float
) -> ManoeuvreState:
    """Return the manoeuvres of a robot at its goal that is to have a heading there, and stands without.

    Where no way is found, it waits longer each time. Arguments as of `step_manoeuvre`; `dock` is (x, y, yaw) of the
    goal, W, and its tolerance, m: a robot that turns on the spot gets to the very place.
    """
    after, turns = before._replace(gives_up=False), context.base.turns_on_the_spot
    if _has_moved(before, pose, context.footprint.radius):
        after = after._replace(pose=pose.copy(), still_since=time if turns else after.still_since)
    if len(after.poses):
        passed = count_reached(pose, after.poses, context.base, context.footprint.radius)
        if passed < len(after.poses) and (passed or time - after.since < patience):
            return after._replace(poses=after.poses[passed:], since=time if passed else after.since)
        after = after._replace(poses=NO_POSES, still_since=time)
    near = after.attempts[np.hypot(*(after.attempts - pose[:2]).T) < REACH * context.footprint.radius]
    docked = abs(math.remainder(dock[2] - pose[2], 2.0 * math.pi)) < DOCKED
    docked = docked and not (turns and math.dist(dock[:2], pose[:2]) >= dock[3])
    if docked or time - after.still_since < context.stuck_time * (1 + len(near)):
        return after
    wanted = np.array([(*dock[:3], 0.0 if turns else AT_HEADING, 0.0)])
    if turns:  # or beside it, where the walls leave more room
        wanted = np.vstack((wanted, wanted + DOCKS * dock[3]))
    poses = _search_manoeuvre(pose, wanted, context, len(near))
    return after._replace(
        poses=poses, since=time, still_since=time, attempts=np.vstack((near[1 - REMEMBERED :], pose[:2]))
    )


def _has_moved(before: ManoeuvreState, pose: np.ndarray, unit: float) -> bool:
    """Return whether a robot of a radius has moved or turned since it last did, to be at a pose."""
    x, y, yaw = before.pose.tolist()
    if not math.dist(pose[:2], (x, y)) < MOVED * unit:
        return True
    return abs(math.remainder(pose[2] - yaw, 2.0 * math.pi)) > TURNED


def update_winding(before: ManoeuvreState, path: np.ndarray, pose: np.ndarray, unit: float) -> ManoeuvreState:
    """Return the same with what is left of the path (k, 2) and the turns since that was least."""
    if not len(path):
        return before._replace(least_left=math.inf, winding=0.0)
    left, end = float(measure_arc_lengths(np.vstack((pose[:2], path)))[-1]), (*path[-1], pose[2])
    if left < before.least_left - MOVED * unit or not math.dist(path[-1], before.end[:2]) < SAME_PLACE * unit:
        return before._replace(least_left=left, winding=0.0, end=end)
    return before._replace(winding=before.winding + math.remainder(pose[2] - before.end[2], 2.0 * math.pi), end=end)


def is_roomy(pose: np.ndarray, path: np.ndarray, context: ManoeuvreContext) -> bool:
    """Return whether the robot may turn freely on the path (k, 2) ahead of a pose, so that it needs no manoeuvre."""
    if not context.base.turns_on_the_spot:
        return False
    way, needed = np.vstack((pose[:2], path)), context.footprint.radius + context.margin
    ahead = resample_polyline(way, 0.5 * SAME_PLACE * context.footprint.radius)[:3]
    hits = context.surroundings.certified_star.boundary.points
    return all((distance_to_segment(hits, a, b) > needed).all() for a, b in pairwise(ahead))


def count_reached(pose: np.ndarray, poses: np.ndarray, base: Base, radius: float) -> int:
    """Return how many of the poses (k, 4) of a manoeuvre a robot of a radius (m) at a pose (x, y, yaw) has reached."""
    count, near = 0, AT_POSE * radius
    for x, y, yaw, gear in poses.tolist():
        dx, dy = x - pose[0], y - pose[1]
        if gear == 0.0:
            there = abs(math.remainder(yaw - pose[2], 2.0 * math.pi)) < AT_HEADING
        elif base.holonomic:
            there = math.hypot(dx, dy) < 2.0 * near
        else:
            there = gear * (math.cos(pose[2]) * dx + math.sin(pose[2]) * dy) < near
        if not there:
            break
        count += 1
    return count


def find_manoeuvre(pose: np.ndarray, path: np.ndarray, context: ManoeuvreContext, tried: int) -> np.ndarray:
    """Return poses (k, 4) of a manoeuvre, as of `ManoeuvreState`; none if no way is found.

    Args:
        pose: (x, y, yaw) of the robot, W.
        path: shape (k, 2), way points ahead, W, m.
        context: of the robot.
        tried: how many manoeuvres failed here; others are tried then.
    """
    goals, unit = _list_goals(pose, path, context), context.footprint.radius
    away = np.hypot(*(goals[:, :2] - pose[:2]).T)
    turned = np.array([wrap_angle(turn) for turn in goals[:, 2] - pose[2]])
    first = tried % len(goals)
    costs = RANK_COST * unit * np.roll(np.arange(len(goals)), first) + np.maximum(away[first] - away, 0.0)
    ahead = (away >= NEAR_GOAL * unit) | (np.abs(turned) >= goals[:, 3])
    return _search_manoeuvre(pose, np.column_stack((goals, costs))[ahead], context, tried)


def _search_manoeuvre(pose: np.ndarray, wanted: np.ndarray, context: ManoeuvreContext, tried: int) -> np.ndarray:
    """`search_poses` to goals as it takes them, with a margin by how many manoeuvres failed here."""
    unit = context.footprint.radius
    surfaces = _near_surfaces(context.surroundings.view.chords, pose[:2], unit)
    margin = context.margin + EXTRA_MARGINS[tried % len(EXTRA_MARGINS)] * unit
    return search_poses(
        pose, wanted, context.moves, context.footprint, margin, (surfaces, context.surroundings.other_views)
    )


def _list_goals(pose: np.ndarray, path: np.ndarray, context: ManoeuvreContext) -> np.ndarray:
    """Return goals, the best first, shape (n, 4): x, y, yaw, and the largest error of the heading, m and rad."""
    goals = []
    line = np.vstack((pose[:2], path))
    along, unit = measure_arc_lengths(line), context.footprint.radius
    for look, aligned in dict.fromkeys((min(look * unit, float(along[-1])), aligned) for look, aligned in LOOKS):
        x, y = (float(np.interp(look, along, coordinate)) for coordinate in line.T)
        leg = min(max(int(np.searchsorted(along, look)), 1), len(line) - 1)
        dx, dy = line[leg] - line[leg - 1]
        goals.append((x, y, math.atan2(dy, dx), aligned))
    return np.array(goals)


def _near_surfaces(surfaces: Chords, place: np.ndarray, unit: float) -> Chords:
    """Return what is within the search's reach, thinned out to the nearest ones."""
    middle = 0.5 * (surfaces.ends[:, :2] + surfaces.ends[:, 2:])
    away = np.hypot(*(middle - place).T)
    near = np.argsort(away, kind="stable")[: int((away < (REACH + 1.0) * unit).sum())]
    cells = np.floor(middle[near] / (SPACING * CELL * unit)).astype(np.int64)
    _, first = np.unique(cells @ (1 << 32, 1), return_index=True)  # of the places in a cell
    kept = near[np.sort(first)]
    return Chords(surfaces.ends[kept], surfaces.is_surface[kept], surfaces.occludes[kept], surfaces.center)
