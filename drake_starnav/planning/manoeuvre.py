"""Manoeuvres of a robot that is no disc: short sequences of turns and straight or curved moves, where the law is stuck.

The roadmap is searched for the narrowest disc of the footprint, so its paths tell no heading. Where the robot stands
although it has a path, a way is searched in (x, y, yaw) with the exact footprint: to a pose beyond a tight passage, or
to a place farther along the path. If the robot is stuck again and again near one place, its way is closed for its
footprint: it then counts as stalled, and another way is planned, on which it may try anew.
"""

import heapq
import math
from itertools import pairwise
from typing import NamedTuple

import numpy as np
from numba import njit

from drake_starnav.geometry.footprint import Footprint
from drake_starnav.geometry.polyline import arc_lengths, distance_to_segment, resampled
from drake_starnav.planning.passage import Passage, tight_passage
from drake_starnav.regions.chords import Chords
from drake_starnav.regions.safe_region import CertifiedRegion
from drake_starnav.regions.separation import keeps_clear
from drake_starnav.robot import Base
from drake_starnav.robot.limits import wrapped_angle

CELL, HEADINGS = 0.04, 96
"""Of the search: cell size, m, and headings in a turn."""
STRAIGHTEN = (0.03, 0.06, 0.1, 0.15, 0.2)
"""Turns that are tried first, either way, by a base that turns on the spot, rad."""
GEAR_COST = 0.15
"""Of a change between forwards and backwards, m."""
SPACING = 0.02
"""No point of the footprint moves farther between two poses that are checked, m."""
REACH = 1.8
"""The search stays within this distance of the robot along each axis, m."""
MOST_EXPANDED = 2500
"""A search that has looked at so many poses gives up."""
NEAR_GOAL = 0.12
"""A pose this near to the goal's place is there, m."""
ANY_HEADING = 7.0
LOOKS = ((0.9, 0.5), (0.45, 0.6), (1.8, 0.6), (0.9, ANY_HEADING))
"""Goals along the path: how far ahead, m, and by how much the heading may be off the path's, rad."""
THINNED = 0.02
"""Of the surfaces one is kept for each cell of this size, m."""
EXTRA_MARGINS = (0.003, 0.009, 0.015, 0.021)
"""Beyond the certificate's margin, since its scans differ; a wider one after each manoeuvre that it refused, m."""
STUCK = 0.3
"""A robot that has not moved for so long is stuck, s."""
MOVED, TURNED = 0.01, 0.05
"""It has moved if it did so by more than this, m or rad."""
ROOM_AHEAD = 0.6
"""A manoeuvre ends where the robot may turn as it likes for so long on its path, m."""
PATIENCE = 4.0
"""A manoeuvre is given up if no pose of it is reached for so long, s."""
TRIES, SAME_PLACE, REMEMBERED = 3, 0.6, 8
"""So many of the last ones, whose number is the third, are begun within so far of one place, m."""
AT_POSE, AT_HEADING = 0.01, 0.02
"""A pose of a manoeuvre is reached this near to it, along the motion, m, or in heading, rad."""
NO_POSES = np.zeros((0, 4))


class Body(NamedTuple):
    """A robot that is no disc.

    Attributes:
        footprint: of the robot.
        star: what its certificate knows.
        margin: that the certificate keeps, m.
        base: how it moves.
    """

    footprint: Footprint
    star: CertifiedRegion
    margin: float
    base: Base

    def passage(self, pose: np.ndarray, path: np.ndarray) -> Passage | None:
        """The tight passage ahead of a pose (x, y, yaw) on a path (k, 2) in W, if any."""
        return tight_passage(pose, path, self.star.hits, self.footprint, self.margin)


class Manoeuvring(NamedTuple):
    """What the planner knows of the robot's manoeuvres.

    Attributes:
        poses: shape (k, 4), still ahead: x, y, yaw in W, and the gear: 0 turns on the spot, 1 drives forwards, -1
            backwards.
        since: when one of them was last reached, s.
        pose: where the robot last moved to, shape (3,).
        still: since when it has been there, s.
        begun: where the last ones began, or were searched in vain, since the way was last given up, shape (n, 2), W, m.
        gives_up: whether no more is tried on this way.
    """

    poses: np.ndarray = NO_POSES
    since: float = 0.0
    pose: np.ndarray = np.full(3, np.inf)
    still: float = 0.0
    begun: np.ndarray = np.zeros((0, 2))
    gives_up: bool = False


class _Space(NamedTuple):
    """Where the footprint may move, for compiled functions: surfaces, `Polygons`, and margin, radius and room, m."""

    surfaces: Chords
    polygons: tuple
    sizes: tuple


def manoeuvring(before: Manoeuvring, path: np.ndarray, pose: np.ndarray, time: float, body: Body) -> Manoeuvring:
    """The manoeuvres after a scan: what was reached is left out, and one begins if the robot is stuck.

    Args:
        before: with the scan before.
        path: shape (k, 2), way points ahead, W, m; none: the robot may stand.
        pose: (x, y, yaw) of the robot, W.
        time: of the scan, s.
        body: the robot.
    """
    now = before._replace(begun=before.begun[:0], gives_up=False) if before.gives_up else before
    turned = abs(math.remainder(pose[2] - before.pose[2], 2.0 * math.pi)) if np.isfinite(before.pose[2]) else math.inf
    if not len(path) or not math.dist(pose[:2], before.pose[:2]) < MOVED or turned > TURNED:
        now = now._replace(pose=pose.copy(), still=time)
    if len(now.poses):
        passed = reached(pose, now.poses, body.base)
        if passed == len(now.poses) or not len(path) or is_roomy(pose, path, body):
            return now._replace(poses=NO_POSES, still=time)
        if passed:
            return now._replace(poses=now.poses[passed:], since=time)
        if time - now.since < PATIENCE and time - now.still < 2.0 * STUCK:
            return now
        now = now._replace(poses=NO_POSES)
    if time - now.still < STUCK:
        return now
    tries = int((np.hypot(*(now.begun - pose[:2]).T) < SAME_PLACE).sum())
    if tries >= TRIES:
        return now._replace(still=time, gives_up=True)
    begun = np.vstack((now.begun[1 - REMEMBERED :], pose[:2]))
    poses = found_manoeuvre(pose, path, body, tries)
    return now._replace(poses=poses, since=time, still=time, begun=begun)


def is_roomy(pose: np.ndarray, path: np.ndarray, body: Body) -> bool:
    """Whether the robot may turn as it likes on the path (k, 2) ahead of a pose, so that it needs no manoeuvre."""
    if not body.base.turns_on_the_spot:
        return False
    way, needed = np.vstack((pose[:2], path)), body.footprint.radius + body.margin
    ahead = resampled(way, 0.5 * ROOM_AHEAD)[:3]
    return all((distance_to_segment(body.star.hits, a, b) > needed).all() for a, b in pairwise(ahead))


def reached(pose: np.ndarray, poses: np.ndarray, base: Base) -> int:
    """How many of the poses (k, 4) of a manoeuvre a robot at a pose (x, y, yaw) has reached."""
    count = 0
    for x, y, yaw, gear in poses.tolist():
        dx, dy = x - pose[0], y - pose[1]
        if gear == 0.0:
            there = abs(math.remainder(yaw - pose[2], 2.0 * math.pi)) < AT_HEADING
        elif base.holonomic:
            there = math.hypot(dx, dy) < 2.0 * AT_POSE
        else:
            there = gear * (math.cos(pose[2]) * dx + math.sin(pose[2]) * dy) < AT_POSE
        if not there:
            break
        count += 1
    return count


def found_manoeuvre(pose: np.ndarray, path: np.ndarray, body: Body, tried: int) -> np.ndarray:
    """Poses (k, 4) of a manoeuvre, as of `Manoeuvring`; none if no way is found.

    Args:
        pose: (x, y, yaw) of the robot, W.
        path: shape (k, 2), way points ahead, W, m.
        body: the robot.
        tried: how many manoeuvres failed here; others are tried then.
    """
    surfaces = _near_surfaces(body.star.chords, pose[:2])
    margin = body.margin + EXTRA_MARGINS[tried % len(EXTRA_MARGINS)]
    space = _Space(surfaces, body.footprint.polygons, (margin, body.footprint.radius, REACH))
    goals, first = _goals(pose, path, body), _STRAIGHTENING if body.base.turns_on_the_spot else _STRAIGHTENING[:0]
    turn = tried % max(len(goals), 1)
    for goal in goals[turn:] + goals[:turn]:
        x, y, yaw, aligned = goal
        turned = abs(math.remainder(yaw - pose[2], 2.0 * math.pi))
        if math.hypot(x - pose[0], y - pose[1]) < NEAR_GOAL and turned < aligned:
            continue
        poses = _searched(pose, np.array(goal), body.base.moves, first, space)
        if len(poses):
            return poses
    return NO_POSES


def _goals(pose: np.ndarray, path: np.ndarray, body: Body) -> list[tuple[float, float, float, float]]:
    """Poses (x, y, yaw) to search for, with the largest error of the heading, rad."""
    goals = []
    passage = body.passage(pose, path)
    if passage is not None:
        front, back = body.footprint.outline[:, 0].max(), body.footprint.outline[:, 0].min()
        before = passage.along(pose) < -0.6 * front
        for away in (0.1 - back, -0.06 - front) if before else (0.1 - back,):
            goals.append((*passage.at(away), passage.yaw, AT_HEADING))
    line = np.vstack((pose[:2], path))
    along = arc_lengths(line)
    for look, aligned in LOOKS:
        x, y = (float(np.interp(look, along, coordinate)) for coordinate in line.T)
        leg = min(max(int(np.searchsorted(along, min(look, along[-1]))), 1), len(line) - 1)
        dx, dy = line[leg] - line[leg - 1]
        goals.append((x, y, math.atan2(dy, dx), aligned))
    return goals


def _near_surfaces(surfaces: Chords, place: np.ndarray) -> Chords:
    """Surfaces within the search's reach, the nearest one for each cell of THINNED; they hide nothing."""
    middle = 0.5 * (surfaces.ends[:, :2] + surfaces.ends[:, 2:])
    away = np.hypot(*(middle - place).T)
    near = np.argsort(away, kind="stable")[: int((away < REACH + 0.5).sum())]
    _, first = np.unique(np.floor(middle[near] / THINNED).astype(np.int64), axis=0, return_index=True)
    ends = surfaces.ends[near[np.sort(first)]]
    return Chords(ends, np.zeros(len(ends), np.bool_), np.array(place, dtype=float))


_STRAIGHTENING = np.array([(0.0, 0.0, s * turn, 0.05 + 0.3 * turn, 0.0) for turn in STRAIGHTEN for s in (1.0, -1.0)])


@njit(cache=True)
def _after(x, y, yaw, dx, dy, turn):
    """The pose after a move (dx, dy) that is turned evenly."""
    middle = yaw + 0.5 * turn
    cosine, sine = math.cos(middle), math.sin(middle)
    return x + cosine * dx - sine * dy, y + sine * dx + cosine * dy, yaw + turn


@njit(cache=True)
def _is_free(x, y, yaw, move, space):
    """Whether the footprint keeps its margin on a move (dx, dy, dyaw, ...) from a pose."""
    radius = space.sizes[1]
    count = int(math.ceil((math.hypot(move[0], move[1]) + radius * abs(move[2])) / SPACING)) + 1
    poses = np.empty((count + 1, 3))
    poses[0] = x, y, yaw
    dx, dy, turn = move[0] / count, move[1] / count, move[2] / count
    for k in range(1, count + 1):
        poses[k] = _after(poses[k - 1, 0], poses[k - 1, 1], poses[k - 1, 2], dx, dy, turn)
    return keeps_clear(poses, space.surfaces, space.polygons, space.sizes)


@njit(cache=True)
def _shot(x, y, yaw, goal, space):
    """Gear and heading of a straight way to the goal between two turns on the spot, gear 0 if there is none."""
    away = math.hypot(goal[0] - x, goal[1] - y)
    for gear in (1.0, -1.0):
        heading = math.atan2(gear * (goal[1] - y), gear * (goal[0] - x)) if away > 1e-6 else yaw
        first = yaw + wrapped_angle(heading - yaw)
        last = wrapped_angle(goal[2] - heading)
        if (
            _is_free(x, y, yaw, np.array((0.0, 0.0, first - yaw)), space)
            and _is_free(x, y, first, np.array((gear * away, 0.0, 0.0)), space)
            and _is_free(goal[0], goal[1], first, np.array((0.0, 0.0, last)), space)
        ):
            return gear, first
    return 0.0, yaw


@njit(cache=True)
def _searched(start, goal, moves, first, space):
    """Poses (k, 4) of the cheapest way found from a pose to a goal (x, y, yaw, largest error of the heading).

    `first` are turns on the spot that are tried from the start alone; none if the base does not turn so.
    """
    side = int(2.0 * REACH / CELL) + 1
    best = np.full((side, side, HEADINGS), np.inf, np.float32)
    room, usual, turns = MOST_EXPANDED * len(moves) + len(first) + 4, len(moves), len(first) > 0
    moves = np.concatenate((moves, first))
    nodes, parents, costs = np.empty((room, 4)), np.full(room, -1, np.int64), np.zeros(room)
    nodes[0] = start[0], start[1], start[2], 0.0
    queue, count, last = [(0.0, 0)], 1, -1
    for expanded in range(MOST_EXPANDED):
        if len(queue) == 0:
            break
        _, n = heapq.heappop(queue)
        x, y, yaw, gear = nodes[n]
        away = math.hypot(goal[0] - x, goal[1] - y)
        if away < NEAR_GOAL and abs(wrapped_angle(yaw - goal[2])) < goal[3]:
            last = n
            break
        if turns and (expanded % 4 == 0 or away < 0.4):
            shot, heading = _shot(x, y, yaw, goal, space)
            if shot != 0.0:
                nodes[count] = x, y, heading, 0.0
                nodes[count + 1] = goal[0], goal[1], heading, shot
                nodes[count + 2] = goal[0], goal[1], heading + wrapped_angle(goal[2] - heading), 0.0
                parents[count], parents[count + 1], parents[count + 2] = n, count, count + 1
                last = count + 2
                break
        for m in range(len(moves) if n == 0 else usual):
            px, py, turned = _after(x, y, yaw, moves[m, 0], moves[m, 1], moves[m, 2])
            i, j = int(round((px - start[0] + REACH) / CELL)), int(round((py - start[1] + REACH) / CELL))
            h = int(round(turned / (2.0 * math.pi) * HEADINGS)) % HEADINGS
            cost = costs[n] + moves[m, 3] + (GEAR_COST if gear * moves[m, 4] < 0.0 else 0.0)
            outside = i < 0 or j < 0 or i >= side or j >= side
            if outside or (m < usual and best[i, j, h] <= cost) or not _is_free(x, y, yaw, moves[m], space):
                continue
            best[i, j, h] = min(best[i, j, h], cost)
            nodes[count], parents[count], costs[count] = (px, py, turned, moves[m, 4]), n, cost
            heapq.heappush(queue, (cost + 1.2 * math.hypot(goal[0] - px, goal[1] - py), count))
            count += 1
    return _way(nodes, parents, last)


@njit(cache=True)
def _way(nodes, parents, last):
    """The nodes from after the first to the last one, shape (k, 4); none if it is -1."""
    count, n = 0, last
    while n > 0:
        count, n = count + 1, parents[n]
    out, n = np.empty((count, 4)), last
    for k in range(count - 1, -1, -1):
        out[k], n = nodes[n], parents[n]
    return out
