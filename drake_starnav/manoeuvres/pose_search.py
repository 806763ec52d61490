"""A search for a way of a footprint among surfaces, in (x, y, yaw), to the best of several goals.

Weighted A* over short moves. The cost to go is that of a disc which fits into the footprint, around the surfaces, or
that of the turn that is left, if it is more. No pose is looked at from which not even that disc gets through, and
without a way for it the search ends at once.

Few ways lead into a tight place, many out of it. So from a goal with an exact heading a way out is searched first, to
where the robot may turn freely; it is driven backwards in the end.
"""

import heapq
import math
from typing import NamedTuple

import numpy as np

from drake_starnav.geometry.compiled import kernel, put
from drake_starnav.geometry.footprint import Body, Footprint
from drake_starnav.geometry.polyline import measure_capsule_distances
from drake_starnav.robot.limits import wrap_angle
from drake_starnav.surroundings.chords import Chords
from drake_starnav.surroundings.separation import ClearanceLimits, is_collision_free
from drake_starnav.surroundings.view_arrays import ViewArrays

CELL, HEADINGS = 0.085, 96
"""Cell size, in radii of the disc around the robot, and headings in a turn."""
OFF_CENTRE = 0.75
"""Bound on how far a place is from the centre of its cell, in cells."""
FIRST_SHARES = (0.125, 0.25, 0.5)
"""From the start, primitives are tried at these shares, too: a robot that is wedged in has no room for whole ones. The
shares of length and turn may differ if it turns on the spot."""
GEAR_COST = 3.75
"""Cost of a change between forwards and backwards, in cells."""
SPACING = 0.5
"""No point of the footprint moves farther between two poses that are checked, in cells."""
CELLS_AROUND = 45
"""Cells from the start within which the search stays."""
REACH = CELLS_AROUND * CELL
"""That is this distance, in radii."""
SIDE = 2 * CELLS_AROUND + 1
"""Cells along a side of what is searched."""
IN_REACH = np.hypot(*(np.indices((SIDE, SIDE)) - CELLS_AROUND)) < CELLS_AROUND
"""Cells that are searched."""
EXACT, MOST_CHECKS = 8, 200000
"""A move that its cells do not decide counts as this many checks; a search that has made this many gives up."""
HEURISTIC_WEIGHT = 1.2
"""Weight of the cost to go."""
NEAR_GOAL = 0.255
"""A pose this near to the goal's place is there, in radii."""
SHOOT_EVERY, SHOOT_NEAR = 4, 10.0
"""A straight way to a goal is looked for from every n-th pose, and from all that are this near to it, in cells."""


class Space(NamedTuple):
    """Where the footprint may move, for compiled functions.

    Attributes:
        chords: what the last scan hit, and what hides space from it.
        views: those before.
        surface_chords: the surfaces alone, which hide nothing.
        body: the robot.
        discs: shape (k, 4), that cover it: centre, radius, and that of the disc within the footprint; robot's frame, m.
        inner_radius: of the largest disc about the robot's axis within the footprint, m.
        margin: that it keeps, m.
        clear: distance from the centre of each cell to the nearest surface, up to what matters, shape (SIDE, SIDE), m;
            NaN out of reach.
        grid: centre (x, y) of cell (0, 0), W, and the size of a cell, m.
    """

    chords: Chords
    views: ViewArrays
    surface_chords: Chords
    body: Body
    discs: np.ndarray
    inner_radius: float
    margin: float
    clear: np.ndarray
    grid: tuple[float, float, float]


class Primitives(NamedTuple):
    """The moves that are tried, see `Base.motion_primitives`.

    Attributes:
        usual: from all poses, shape (n, 5).
        first: shorter ones, from the starts alone, shape (m, 5).
        turn_cost: that of a turn at least, m/rad.
    """

    usual: np.ndarray
    first: np.ndarray
    turn_cost: float


def search_poses(
    start: np.ndarray,
    goals: np.ndarray,
    motion_primitives: np.ndarray,
    footprint: Footprint,
    margin: float,
    seen: tuple[Chords, ViewArrays],
) -> np.ndarray:
    """Return the poses (k, 4) of the cheapest way to one of some goals: x, y, yaw in W, and gear; none without a way.

    Args:
        start: (x, y, yaw) of the robot, W.
        goals: shape (n, 5): x, y, yaw in W, the largest error of the heading, rad, and what it costs to end there, m.
            If all these errors are 0, the way ends exactly there; the base then turns on the spot.
        motion_primitives: of the base, see `Base.motion_primitives`.
        footprint: of the robot.
        margin: that it keeps from the surfaces, m; where it starts nearer, it comes no nearer.
        seen: chords of the last scan, and past views. Only the first move keeps out of what these have not seen:
            the robot will have seen what later moves need.
    """
    space = _make_space(start, footprint, margin, *seen)
    primitives = _make_primitives(motion_primitives)
    start_row, way_in = np.array(((*start, 0.0, 0.0),)), np.zeros((0, 4))
    if not goals[:, 3].any():
        way_out = _find_way(goals, start_row, primitives, space, is_leaving=True)
        if not len(way_out):
            return way_out
        way_in = np.column_stack((way_out[-2::-1, :3], -way_out[:0:-1, 3]))
        goals = np.array(((*way_out[-1, :3], 0.0, 0.0),))
    way = _find_way(start_row, goals, primitives, space, is_leaving=False)
    return np.vstack((way[1:], way_in)) if len(way) else way


def _make_space(start: np.ndarray, footprint: Footprint, margin: float, chords: Chords, views: ViewArrays) -> Space:
    """Return where a footprint may move around a start; arguments as of `search_poses`."""
    cell = CELL * footprint.radius
    grid = (float(start[0]) - CELLS_AROUND * cell, float(start[1]) - CELLS_AROUND * cell, cell)
    cover, hides_nothing = footprint.cover, np.zeros(np.count_nonzero(chords.is_surface), np.bool_)
    inner_radii = _measure_inner_radii(footprint, np.vstack((cover, np.zeros(2))))
    discs = np.column_stack((cover, np.full(len(cover), footprint.cover_radius), inner_radii[:-1]))
    surface_ends = chords.ends[chords.is_surface]
    surface_chords = Chords(surface_ends, ~hides_nothing, hides_nothing, chords.center)
    farthest = footprint.cover_radius + margin + 2.0 * cell
    chord_rows = np.column_stack((surface_ends, hides_nothing))
    clear = measure_capsule_distances(np.array(grid[:2]), (SIDE, SIDE), cell, farthest, chord_rows)
    clear[~IN_REACH] = np.nan
    return Space(chords, views, surface_chords, footprint.body, discs, inner_radii[-1], margin, clear, grid)


def _measure_inner_radii(footprint: Footprint, places: np.ndarray) -> np.ndarray:
    """Return the radii of the largest discs about places (n, 2) within the footprint, shape (n,), m."""
    polygons = footprint.polygons
    depths = np.split(polygons.offsets - places @ polygons.normals.T, polygons.ends[:-1], axis=1)
    return np.max([part.min(axis=1) for part in depths], axis=0)


def _make_primitives(motion_primitives: np.ndarray) -> Primitives:
    """Return the primitives of a base with the shorter ones that are tried from the start."""
    turns_on_the_spot = (motion_primitives[:, 4] == 0.0).any()
    shares = [(a, a, b, max(a, b), 1.0) for a in FIRST_SHARES for b in (FIRST_SHARES if turns_on_the_spot else (a,))]
    turning = motion_primitives[motion_primitives[:, 2] != 0.0]
    turn_cost = float((turning[:, 3] / abs(turning[:, 2])).min())
    return Primitives(motion_primitives, np.vstack([motion_primitives * share for share in shares]), turn_cost)


def _find_way(
    starts: np.ndarray, goals: np.ndarray, primitives: Primitives, space: Space, *, is_leaving: bool
) -> np.ndarray:
    """Return the poses (k, 4) of the cheapest way from some starts to some goals; arguments as of `_expand_poses`."""
    cost_to_go = _compute_costs_to_go(space, goals)
    nodes, parents, last = _expand_poses(starts, goals, primitives, cost_to_go, space, is_leaving)
    poses = []
    while last >= 0:
        poses.append(nodes[last])
        last = parents[last]
    return np.array(poses[::-1]).reshape(-1, 4)


@kernel
def _find_cell(x, y, grid):
    """Return the cell of a place; it may lie outside of what is searched."""
    return int(round((x - grid[0]) / grid[2])), int(round((y - grid[1]) / grid[2]))


@kernel
def _compute_costs_to_go(space, goals):
    """Return the costs from each cell of the shortest way to a goal of the disc within the footprint, (SIDE, SIDE), m.

    What it costs to end at a goal counts, too.
    """
    grid, radius = space.grid, space.inner_radius - OFF_CENTRE * space.grid[2]
    out = np.full((SIDE, SIDE), np.inf)
    queue = [(0.0, 0, 0)]
    queue.pop()
    for k in range(len(goals)):
        i, j = _find_cell(goals[k, 0], goals[k, 1], grid)
        if 0 <= i < SIDE and 0 <= j < SIDE and goals[k, 4] < out[i, j]:
            out[i, j] = goals[k, 4]
            heapq.heappush(queue, (goals[k, 4], i, j))
    while len(queue) > 0:
        cost, i, j = heapq.heappop(queue)
        if cost > out[i, j]:
            continue
        for a in range(max(i - 1, 0), min(i + 2, SIDE)):
            for b in range(max(j - 1, 0), min(j + 2, SIDE)):
                next_cost = cost + grid[2] * math.hypot(a - i, b - j)
                if next_cost < out[a, b] and space.clear[a, b] > radius:
                    out[a, b] = next_cost
                    heapq.heappush(queue, (next_cost, a, b))
    return out


@kernel
def _apply_move(x, y, yaw, dx, dy, turn):
    """Return the pose after a move (dx, dy) that is turned evenly."""
    middle = yaw + 0.5 * turn
    cosine, sine = math.cos(middle), math.sin(middle)
    return x + cosine * dx - sine * dy, y + sine * dx + cosine * dy, yaw + turn


@kernel
def _check_move(x, y, yaw, move, space, is_first):
    """Return whether the footprint keeps its margin on a move (dx, dy, dyaw, ...) from a pose; and the checks made.

    With `is_first`, the move must also stay in space that was seen.
    """
    longest_step = SPACING * space.grid[2]
    count = int(math.ceil((math.hypot(move[0], move[1]) + space.body.radius * abs(move[2])) / longest_step)) + 1
    poses = np.empty((count + 1, 3))
    put(poses, np.int64(0), (x, y, yaw))
    dx, dy, turn = move[0] / count, move[1] / count, move[2] / count
    for k in range(1, count + 1):
        put(poses, k, _apply_move(poses[k - 1, 0], poses[k - 1, 1], poses[k - 1, 2], dx, dy, turn))
    is_blocked, is_roomy = _look_up_cells(poses, space)
    if is_blocked or (is_roomy and not is_first):
        return not is_blocked, 1
    chords, surfaces = space.chords, space.surface_chords
    if not is_first:
        chords = Chords(surfaces.ends, surfaces.is_surface, surfaces.occludes, poses[0, :2])
    return is_collision_free(poses, chords, space.views, space.body, ClearanceLimits(space.margin, np.inf)), EXACT


@kernel
def _look_up_cells(poses, space):
    """Return whether the cells tell that the footprint hits a surface at one of the poses (k, 3), or has its margin."""
    cell, is_roomy = space.grid[2], True
    for k in range(len(poses) - 1, -1, -1):
        cosine, sine = math.cos(poses[k, 2]), math.sin(poses[k, 2])
        for u, v, radius, inner_radius in space.discs:
            i, j = _find_cell(poses[k, 0] + cosine * u - sine * v, poses[k, 1] + sine * u + cosine * v, space.grid)
            clear = space.clear[i, j] if 0 <= i < SIDE and 0 <= j < SIDE else np.nan
            if clear < inner_radius - OFF_CENTRE * cell:
                return True, False
            is_roomy = is_roomy and clear > radius + space.margin + (OFF_CENTRE + SPACING) * cell
    return False, is_roomy


@kernel
def _shoot_straight(pose, goal, space, is_first):
    """Return gear and heading of a straight way to the goal between two turns on the spot; and the number of checks.

    The gear is 0 if there is no such way.
    """
    x, y, yaw = pose[0], pose[1], pose[2]
    checks, goal_distance = 0, math.hypot(goal[0] - x, goal[1] - y)
    for gear in (1.0, -1.0):
        heading = math.atan2(gear * (goal[1] - y), gear * (goal[0] - x)) if goal_distance > 1e-6 else yaw
        first = yaw + wrap_angle(heading - yaw)
        last = wrap_angle(goal[2] - heading)
        free, more = _check_move(x, y, yaw, np.array((0.0, 0.0, first - yaw)), space, is_first)
        checks += more
        if free:
            free, more = _check_move(
                x, y, first, np.array((gear * goal_distance, 0.0, 0.0)), space, is_first and first == yaw
            )
            checks += more
        if free:
            free, more = _check_move(goal[0], goal[1], first, np.array((0.0, 0.0, last)), space, False)
            checks += more
        if free:
            return gear, first, checks
    return 0.0, yaw, checks


class _Tree(NamedTuple):
    """The poses that a search has reached, for compiled functions.

    Attributes:
        nodes: shape (k, 4): x, y, yaw in W, and gear.
        parents: the predecessor of each, shape (k,); -1 of a start.
        costs: of the way to each, shape (k,), m.
        best: least cost by cell and heading, shape (SIDE, SIDE, HEADINGS), m.
    """

    nodes: np.ndarray
    parents: np.ndarray
    costs: np.ndarray
    best: np.ndarray


@kernel
def _expand_poses(starts, goals, primitives, cost_to_go, space, is_leaving):
    """Return the poses that were reached, the predecessor of each, and the last one of the way; -1 without a way.

    `starts` (m, 5) are as goals, with what it costs to begin there; `cost_to_go` is that of each cell, m. A pose at a
    goal is queued once more, with what it costs to end there: it is the way's last one if it comes first then.

    With `is_leaving` the search starts at the goal and also ends where the robot may turn freely; its result is driven
    backwards.
    """
    can_shoot = (primitives.usual[:, 4] == 0.0).any()
    tree = _begin_tree(starts, MOST_CHECKS + len(primitives.usual) + len(primitives.first) + 3)
    queue, count, checks, expanded_count = [(starts[n, 4], n, False) for n in range(len(starts))], len(starts), 0, 0
    heapq.heapify(queue)
    while len(queue) > 0 and checks < MOST_CHECKS:
        expanded_count += 1
        _, n, is_ending = heapq.heappop(queue)
        if is_ending:
            return tree.nodes[:count], tree.parents[:count], n
        is_start = n < len(starts)
        for k in range(len(goals)):
            may_shoot = can_shoot and k == expanded_count // SHOOT_EVERY % len(goals)
            reach = np.inf if expanded_count % SHOOT_EVERY == 0 else SHOOT_NEAR * space.grid[2]
            added, more = _end_at_goal(
                tree, queue, n, count, goals[k], reach if may_shoot else 0.0, space, is_leaving, is_start
            )
            count, checks = count + added, checks + more
        if is_leaving and can_shoot:
            x, y, yaw = tree.nodes[n, 0], tree.nodes[n, 1], tree.nodes[n, 2]
            free, more = _check_move(x, y, yaw, np.array((0.0, 0.0, 2.0 * math.pi)), space, False)
            checks += more
            if free:
                return tree.nodes[:count], tree.parents[:count], n
        added, more = _try_moves(tree, queue, n, count, goals, primitives, cost_to_go, space, is_leaving, is_start)
        count, checks = count + added, checks + more
    return tree.nodes[:count], tree.parents[:count], -1


@kernel
def _begin_tree(starts, room):
    """Return a tree of the starts (m, 5) with room for more poses."""
    room += len(starts)
    best = np.full((SIDE, SIDE, HEADINGS), np.inf, np.float32)
    tree = _Tree(np.empty((room, 4)), np.full(room, -1, np.int64), np.zeros(room), best)
    for n in range(len(starts)):
        put(tree.nodes, n, (starts[n, 0], starts[n, 1], starts[n, 2], 0.0))
        tree.costs[n] = starts[n, 4]
    return tree


@kernel
def _end_at_goal(tree, queue, n, count, goal, reach, space, is_leaving, is_start):
    """Queue the end of the way at a goal (5,), from pose n: there already, or straight from within `reach`, m.

    Returns:
        How many poses were added to the tree, which holds `count`, and how many checks were made.
    """
    x, y, yaw, _ = tree.nodes[n]
    goal_distance, ending_cost = math.hypot(goal[0] - x, goal[1] - y), tree.costs[n] + HEURISTIC_WEIGHT * goal[4]
    if goal_distance < NEAR_GOAL * space.body.radius and abs(wrap_angle(yaw - goal[2])) < goal[3]:
        heapq.heappush(queue, (ending_cost, n, True))
        return 0, 0
    if not goal_distance < reach:
        return 0, 0
    first, last = (goal, tree.nodes[n]) if is_leaving else (tree.nodes[n], goal)
    gear, heading, checks = _shoot_straight(first, last, space, is_leaving or is_start)
    if gear == 0.0:
        return 0, checks
    put(tree.nodes, count, (x, y, heading, 0.0))
    put(tree.nodes, count + 1, (goal[0], goal[1], heading, -gear if is_leaving else gear))
    put(tree.nodes, count + 2, (goal[0], goal[1], heading + wrap_angle(goal[2] - heading), 0.0))
    tree.parents[count], tree.parents[count + 1], tree.parents[count + 2] = n, count, count + 1
    heapq.heappush(queue, (ending_cost + HEURISTIC_WEIGHT * goal_distance, count + 2, True))
    return 3, checks


@kernel
def _try_moves(tree, queue, n, count, goals, primitives, cost_to_go, space, is_leaving, is_start):
    """Queue the poses after all moves from pose n that are free and cheap; return the same as `_end_at_goal`."""
    first_count, checks = count, 0
    for m in range(len(primitives.usual) + (len(primitives.first) if is_start else 0)):
        is_usual = m < len(primitives.usual)
        move = primitives.usual[m] if is_usual else primitives.first[m - len(primitives.usual)]
        to_go, more = _try_move(tree, n, count, move, cost_to_go, space, is_leaving, is_start)
        checks += more
        if to_go < np.inf:
            least_turn = np.inf  # what the turn to any goal costs, and ending there
            for goal in goals:
                turn = max(abs(wrap_angle(tree.nodes[count, 2] - goal[2])) - goal[3], 0.0)
                least_turn = min(least_turn, primitives.turn_cost * turn + goal[4])
            heapq.heappush(queue, (tree.costs[count] + HEURISTIC_WEIGHT * max(to_go, least_turn), count, False))
            count += 1
    return count - first_count, checks


@kernel
def _try_move(tree, n, count, move, cost_to_go, space, is_leaving, is_start):
    """Write the pose after a move from pose n as number `count` of the tree, if it is free and no cheaper way is known.

    Returns:
        The cost to go from its cell, m, infinite if it is not written; and how many checks were made.
    """
    x, y, yaw, gear = tree.nodes[n]
    next_x, next_y, next_yaw = _apply_move(x, y, yaw, move[0], move[1], move[2])
    i, j = _find_cell(next_x, next_y, space.grid)
    if i < 0 or j < 0 or i >= SIDE or j >= SIDE or cost_to_go[i, j] == np.inf:
        return np.inf, 0
    h = int(round(next_yaw / (2.0 * math.pi) * HEADINGS)) % HEADINGS
    cost = tree.costs[n] + move[3] + (GEAR_COST * space.grid[2] if gear * move[4] < 0.0 else 0.0)
    if not is_start and tree.best[i, j, h] <= cost:
        return np.inf, 0
    if is_leaving:
        free, checks = _check_move(next_x, next_y, next_yaw, -move, space, False)
    else:
        free, checks = _check_move(x, y, yaw, move, space, is_start)
    if not free:
        return np.inf, checks
    tree.best[i, j, h] = min(tree.best[i, j, h], cost)
    put(tree.nodes, count, (next_x, next_y, next_yaw, move[4]))
    tree.parents[count], tree.costs[count] = n, cost
    return cost_to_go[i, j], checks
