"""Search of the roadmap: which frontier to drive to next, and along which path."""

import dataclasses
import heapq
import math
from dataclasses import dataclass, field

import numpy as np
from numba import njit

from drake_starnav.planning.approach import Approach, approach
from drake_starnav.planning.cost_field import CostField, Origins, Terrain, cost_to_go
from drake_starnav.planning.distance_grid import STRIDE
from drake_starnav.planning.frontiers import Frontiers
from drake_starnav.planning.optimistic_path import index_along, next_segment_of, optimistic_path_beyond
from drake_starnav.planning.roadmap import StarRoadmap
from drake_starnav.planning.state import PlannerInput
from drake_starnav.planning.string_pulling import string_pulled
from drake_starnav.regions.region_union import cover_at, covers, first_gap, least_outside
from drake_starnav.regions.star_region import StarRegion

HYSTERESIS = 0.5
"""Bonus of the current target, against oscillation between targets, m."""
OFF_MAP_PENALTY = 0.1
"""Extra length if the robot is outside all regions and must first drive to the nearest node, m."""
VIRTUAL_FRONTIER_ADVANTAGE = 0.25
"""A gate opens only if the optimistic path is shorter than the way over the best frontier by this much, m."""
VIRTUAL_FRONTIER_LENGTH = 0.2
"""The optimistic path leaves the regions where it stays outside for this length, m."""
VIRTUAL_FRONTIER_INSET = 0.95
"""A gate at the edge of the latest region stands at this fraction of the distance from its centre."""
VIRTUAL_FRONTIER_BEARINGS = 180
"""Number of bearings at which such gates are considered."""
VIRTUAL_FRONTIER_DETOUR = 0.15
"""Such a gate may lengthen the way by no more than this, m."""
MOST_BLACKLISTED = 4
"""Largest number of places closed in one search."""
BLACKLIST_SLACK = 0.02
"""Around a target tried in vain, openings wider than the margin by this much stay open, m."""
MARGINS_IN_DOUBT = 3.0
"""Hits may err by this many times the least margin, which allows for the errors of most."""
SIGHT_BEARINGS = 360
"""Lines of sight are tested first where another one near the same of so many bearings was blocked."""


NOWHERE_TO_GO = np.zeros((0, 2))


@dataclass(frozen=True)
class Route:
    """The chosen target and the way to it.

    Attributes:
        path: shape (k, 2), way points from after the robot to the target, W, m.
        target: the target frontier, one row; empty when the target is the goal.
        optimistic_path: shape (m, 2), the optimistic path from the target's probe to the goal, W, m; the probe alone
            where none leads, nothing where the target is the goal.
        next_segment: shape (n, 2), the part of it to which the robot may turn.
        blacklisted_probes: shape (k, 2), the roadmap's closed places and those added because the optimistic path still
            led through a retired target; None if none were added.
    """

    path: np.ndarray
    target: Frontiers
    optimistic_path: np.ndarray = field(default_factory=lambda: np.zeros((0, 2)))
    next_segment: np.ndarray = field(default_factory=lambda: np.zeros((0, 2)))
    blacklisted_probes: np.ndarray | None = None


def find_route(
    roadmap: StarRoadmap,
    here: StarRegion,
    now: PlannerInput,
    current: np.ndarray | None = None,
    *,
    doubting: bool = False,
) -> Route | None:
    """A route to the goal if a region contains it, else to the frontier of least cost g + h.

    None if the hits leave no way to the goal even if all unknown space were free.

    For a goal beside a wall, the target is the place nearest to it that a region contains; see `approach`.

    g is the length in the graph from the robot to the frontier (or the straight line, where it stays inside the
    union of regions), h the optimistic cost-to-go from the frontier's probe to the goal.

    Args:
        roadmap: the snapshot.
        here: region of the latest scan.
        now: where the robot is and shall go, and the parameters.
        current: stand of the present target frontier, shape (2,), which gets a bonus.
        doubting: whether gaps count as open that are too narrow only if the hits are as wrong as they can be; the
            target is then where the optimistic path leaves the regions.

    Source: paper, section III-D; ranking of frontiers: this project.
    """
    position = now.position
    goal, places = goal_approach(roadmap, now)
    distance, previous = graph_distances(roadmap, here, position)
    for place in places:
        if cover_at(here.alone, place[0], place[1], 0.0) >= 0:
            return Route(place[None, :].copy(), Frontiers.none())
        goal_node = entry_node(roadmap, distance, place)
        if goal_node >= 0:
            # Where nodes are added on the way, the way over the nodes would lead back to the one behind again and again
            direct = first_gap(roadmap.union, tuple(position), tuple(place), 0.0) < 0.0
            path = place[None, :].copy() if direct else node_path(roadmap, previous, goal_node, place)
            return Route(_pulled(roadmap, position, path), Frontiers.none())
    target, enabled, tries, inside = Frontiers.none(), True, 0, NOWHERE_TO_GO
    if doubting:
        roadmap = dataclasses.replace(roadmap, frontiers=Frontiers.none())
    while True:
        best, cost, direct, to_go = _cheapest(roadmap, distance, now, goal, current, enabled, doubting)
        if not enabled or not to_go.at(position[None, :])[0] < cost - VIRTUAL_FRONTIER_ADVANTAGE:
            break
        optimistic = to_go.path(position)
        frontier, path = virtual_frontier(roadmap, optimistic)
        if not len(frontier) or tries == MOST_BLACKLISTED:
            inside = NOWHERE_TO_GO if len(frontier) else optimistic
            enabled = False  # the search may have ended at the robot, where the frontiers' costs are lower bounds
        elif _is_blacklisted(roadmap, frontier.stand)[0]:  # the way that was tried in vain there is still open
            probes = np.vstack((roadmap.blacklisted_probes, frontier.probe))
            roadmap = dataclasses.replace(roadmap, blacklisted_probes=probes)
            tries += 1
        else:
            target, path = virtual_frontier_in_sight(roadmap, here, to_go, frontier, path)
            break
    if not len(target) and best < 0:  # the regions may lead to the goal all the same, but for noise at their edges
        return Route(_pulled(roadmap, position, inside), target) if len(inside) else None
    if not len(target):
        target = roadmap.frontiers.where(np.arange(len(roadmap.frontiers)) == best)
        path = target.stand if direct else node_path(roadmap, previous, int(target.owner[0]), target.stand[0])
    optimistic_path = optimistic_path_beyond(to_go, target)
    next_segment = next_segment_of(optimistic_path, to_go, position)
    return Route(
        _pulled(roadmap, position, path),
        target,
        optimistic_path,
        next_segment,
        roadmap.blacklisted_probes,
    )


def _is_blacklisted(roadmap: StarRoadmap, places: np.ndarray) -> np.ndarray:
    """Which places of shape (n, 2) in W lie in a blacklisted disc, shape (n,)."""
    away = np.hypot(*(places[:, None] - roadmap.blacklisted_targets[:, :2]).T)
    return (away <= roadmap.blacklisted_targets[:, 2:]).any(axis=0)


def goal_approach(roadmap: StarRoadmap, now: PlannerInput) -> Approach:
    """The places at which the robot may arrive, given the hits known so far."""
    return approach(roadmap.hits, now.goal, now.goal_tolerance, now.robot_radius + now.margins.preferred)


def cost_at_robot(roadmap: StarRoadmap, now: PlannerInput) -> float:
    """The optimistic cost-to-go at the robot, m; infinity without a way. The search ends there."""
    alone = dataclasses.replace(roadmap, frontiers=Frontiers.none())
    return float(optimistic_cost(alone, now, np.zeros(0)).at(now.position[None, :])[0])


def graph_distances(roadmap: StarRoadmap, here: StarRegion, position: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Length of the shortest way from the robot to every node, shape (n,), m, and each node's predecessor or -1.

    The robot is connected to nodes whose region contains it and to nodes inside the latest region. If there are none,
    it is connected to the node whose region it is the least outside of.
    """
    first = _visible_nodes(roadmap.union, here.alone, *position)
    length = np.hypot(*(roadmap.union.center[first] - position).T)
    if not len(first):
        first = np.array([least_outside(roadmap.union, len(roadmap), *position)])
        length = np.hypot(*(roadmap.union.center[first] - position).T) + OFF_MAP_PENALTY
    return _dijkstra(len(roadmap), roadmap.edges, roadmap.lengths, first, length)


def entry_node(roadmap: StarRoadmap, distance: np.ndarray, goal: np.ndarray) -> int:
    """The node whose region contains the goal and through which the way is shortest, or -1."""
    inside = _containing(roadmap.union, goal[0], goal[1])
    if not len(inside):
        return -1
    cost = distance[inside] + np.hypot(*(roadmap.union.center[inside] - goal).T)
    best = int(np.argmin(cost))
    return int(inside[best]) if np.isfinite(cost[best]) else -1


def graph_lengths(roadmap: StarRoadmap, distance: np.ndarray) -> np.ndarray:
    """Length of the way over the nodes and across each frontier, shape (n,), m."""
    frontiers = roadmap.frontiers
    to_stand = distance[frontiers.owner] + np.hypot(*(frontiers.stand - roadmap.union.center[frontiers.owner]).T)
    return to_stand + np.hypot(*(frontiers.probe - frontiers.stand).T)


def _cheapest(
    roadmap: StarRoadmap,
    distance: np.ndarray,
    now: PlannerInput,
    goal: np.ndarray,
    current: np.ndarray | None,
    at_robot: bool,
    doubting: bool,
) -> tuple[int, float, bool, CostField]:
    """The frontier of least g + h.

    Returns:
        Its index or -1, that sum, whether the straight line leads there, and the cost-to-go.
    """
    graph = graph_lengths(roadmap, distance)
    to_go = optimistic_cost(roadmap, now, graph, at_robot, doubting)
    ahead = estimates(to_go, roadmap.frontiers, goal)
    if current is not None:
        ahead = ahead - HYSTERESIS * (np.hypot(*(roadmap.frontiers.stand - current).T) < 1e-9)
    return *cheapest_frontier(roadmap, now.position, graph, ahead), to_go


def cheapest_frontier(
    roadmap: StarRoadmap, position: np.ndarray, graph: np.ndarray, ahead: np.ndarray
) -> tuple[int, float, bool]:
    """The frontier of least cost.

    Args:
        roadmap: with n frontiers.
        position: of the robot, shape (2,), W, m.
        graph: length of the way over the nodes and across each frontier, shape (n,), m.
        ahead: cost from each frontier's probe to the goal, shape (n,), m.

    Returns:
        Its index or -1, the sum of both costs, and whether the straight line leads there.
    """
    frontiers = roadmap.frontiers
    straight = np.hypot(*(frontiers.stand - position).T) + np.hypot(*(frontiers.probe - frontiers.stand).T)
    bound = np.minimum(graph, straight) + ahead
    order = np.argsort(bound, kind="stable")
    return _cheapest_in_line(roadmap.union, *position, frontiers.stand, straight, graph, ahead, order)


@njit(cache=True)
def _cheapest_in_line(union, x, y, stand, straight, graph, ahead, order):
    """The loop of `cheapest_frontier`; the line of sight is only tested where it could still win."""
    best, best_cost, direct = -1, np.inf, False
    blocked = np.zeros(SIGHT_BEARINGS)  # how far away the last line near each bearing left the regions
    for i in order:
        if min(graph[i], straight[i]) + ahead[i] >= best_cost:
            break
        bearing = int((math.atan2(stand[i, 1] - y, stand[i, 0] - x) / (2.0 * math.pi) + 0.5) * SIGHT_BEARINGS)
        bearing %= SIGHT_BEARINGS
        at = first_gap(union, (x, y), (stand[i, 0], stand[i, 1]), blocked[bearing])
        if at >= 0.0:
            blocked[bearing] = at
        cost = (graph[i] if at >= 0.0 else min(straight[i], graph[i])) + ahead[i]
        if cost < best_cost:
            best, best_cost, direct = i, cost, at < 0.0
    return best, best_cost, direct


def optimistic_cost(
    roadmap: StarRoadmap,
    now: PlannerInput,
    cost_to_come: np.ndarray | None = None,
    at_robot: bool = True,
    doubting: bool = False,
) -> CostField:
    """The cost-to-go field.

    Args:
        roadmap: hits, closed and blocked places.
        now: robot, goal and parameters.
        cost_to_come: of the frontiers, shape (n,), m; the search ends once the cheapest of them is known.
        at_robot: whether it may also end once the cost at the robot is the least; the frontiers' costs are then lower
            bounds.
        doubting: as for `find_route`.
    """
    position, robot_radius = now.position, now.robot_radius
    goal = goal_approach(roadmap, now).goal
    border = roadmap.scans[0][0].range_max + 0.5
    corners = np.vstack((roadmap.union.center, goal[None, :]))
    low, high = corners.min(axis=0) - border, corners.max(axis=0) + border
    probes = np.vstack((roadmap.closed_places, roadmap.blacklisted_probes))
    clearance = np.full(len(probes), robot_radius + now.margins.preferred + BLACKLIST_SLACK)
    blacklist = np.column_stack(
        (
            np.vstack((probes, roadmap.stall_points)),
            np.append(clearance, np.full(len(roadmap.stall_points), np.inf)),
        )
    )
    origins = None
    if cost_to_come is not None:
        points = np.vstack((roadmap.frontiers.probe, position))
        costs = np.append(cost_to_come, 0.0 if at_robot else np.inf)
        origins = Origins(points, costs, position, HYSTERESIS)
    terrain = Terrain(robot_radius, blacklist, doubt(now) if doubting else 0.0)
    return cost_to_go(roadmap.hits, goal, low, high, terrain, origins)


def doubt(now: PlannerInput) -> float:
    """By how much the distance of a cell from the hits may be too small, m; less for a robot as small as a cell."""
    half_diagonal = math.hypot(0.5, 0.5) * now.parameters.grid_resolution
    most = now.robot_radius - STRIDE * now.parameters.grid_resolution
    return max(min(half_diagonal + MARGINS_IN_DOUBT * now.margins.least, most), 0.0)


def estimates(field: CostField, frontiers: Frontiers, goal: np.ndarray) -> np.ndarray:
    """Optimistic cost from every frontier's probe to the goal, shape (n,), m; infinity without a way."""
    return np.maximum(field.at(frontiers.probe), np.hypot(*(frontiers.probe - goal).T))


def virtual_frontier(roadmap: StarRoadmap, path: np.ndarray) -> tuple[Frontiers, np.ndarray]:
    """Where the optimistic path leaves the union of regions, as a frontier of one row, and the path up to there.

    Edge frontiers appear where the boundary of a region jumps. A gap that is seen at a slant, or is thinner than the
    fit resolves, has none although the hits leave it open. The way to a frontier over nodes may also be a detour.

    Args:
        roadmap: its regions.
        path: shape (k, 2), from the robot to the goal in small steps, W, m.
    """
    union = roadmap.union
    path = _inside_where_possible(path, 0.5 * STRIDE * roadmap.hits.resolution, union)
    last, outside = 0, 0.0  # the robot itself may stand a little outside
    for i in range(1, len(path)):
        if cover_at(union, *path[i], 0.0) >= 0:
            last, outside = i, 0.0
        else:
            outside += float(np.hypot(*(path[i] - path[i - 1])))
            if outside >= VIRTUAL_FRONTIER_LENGTH or i == len(path) - 1:
                stand, probe = path[last], path[i]
                owner = cover_at(union, *stand, 0.0) if last else len(roadmap) - 1
                frontier = Frontiers(stand[None, :].copy(), probe[None, :].copy(), np.array([owner]))
                return frontier, path[: last + 1]
    return Frontiers.none(), path[:0]


def virtual_frontier_in_sight(
    roadmap: StarRoadmap, here: StarRegion, to_go: CostField, frontier: Frontiers, path: np.ndarray
) -> tuple[Frontiers, np.ndarray]:
    """The gate, or one at the edge of the latest region if that leads farther without a detour; and the path there.

    The optimistic path cuts corners as closely as the cells allow. It may leave the regions beside the robot although
    they lead on.

    Args:
        roadmap: its retired places.
        here: region of the latest scan.
        to_go: the cost-to-go.
        frontier, path: as from `virtual_frontier`.
    """
    places = here.center + VIRTUAL_FRONTIER_INSET * (here.outline(VIRTUAL_FRONTIER_BEARINGS) - here.center)
    cost, least = to_go.at(places), float(to_go.at(frontier.stand)[0])
    known = float(np.hypot(*np.diff(path, axis=0).T).sum()) + least
    detour = np.hypot(*(places - path[0]).T) + cost - known
    cost = np.where((detour <= VIRTUAL_FRONTIER_DETOUR) & ~_is_blacklisted(roadmap, places), cost, np.inf)
    best = int(np.argmin(cost))
    if not cost[best] < least - VIRTUAL_FRONTIER_LENGTH:
        return frontier, path
    stand = places[best]
    beyond = to_go.path(stand)
    probe = beyond[min(index_along(beyond, VIRTUAL_FRONTIER_LENGTH) + 1, len(beyond) - 1)]
    owner = max(cover_at(roadmap.union, *stand, 0.0), 0)
    return Frontiers(stand[None, :].copy(), probe[None, :].copy(), np.array([owner])), stand[None, :].copy()


def node_path(roadmap: StarRoadmap, previous: np.ndarray, node: int, end: np.ndarray) -> np.ndarray:
    """Way points from the first node to `node` and on to `end`."""
    chain = [node]
    while previous[chain[-1]] >= 0:
        chain.append(int(previous[chain[-1]]))
    return np.vstack((roadmap.union.center[chain[::-1]], end[None, :]))


def _pulled(roadmap: StarRoadmap, position: np.ndarray, path: np.ndarray) -> np.ndarray:
    return path if len(path) < 2 else string_pulled(path, position, roadmap.union)


@njit(cache=True)
def _inside_where_possible(path, half_cell, union):
    """The path with each point moved to a covered place in its cell, if there is one."""
    out = path.copy()
    for i in range(len(path)):
        for k in range(9):  # the centre, then around it
            turn = 0.25 * math.pi * (k - 1)
            x = path[i, 0] + (half_cell * math.cos(turn) if k else 0.0)
            y = path[i, 1] + (half_cell * math.sin(turn) if k else 0.0)
            if cover_at(union, x, y, 0.0) >= 0:
                out[i, 0], out[i, 1] = x, y
                break
    return out


@njit(cache=True)
def _dijkstra(count, edges, lengths, first, first_length):
    """Shortest distances from the robot over an undirected graph, and predecessors (-1: the robot, or none)."""
    degree = np.zeros(count + 1, np.int64)
    for e in range(len(lengths)):
        degree[edges[e, 0] + 1] += 1
        degree[edges[e, 1] + 1] += 1
    start = np.cumsum(degree)
    fill = start[:-1].copy()
    neighbour = np.empty(2 * len(lengths), np.int64)
    weight = np.empty(2 * len(lengths))
    for e in range(len(lengths)):
        for a, b in ((edges[e, 0], edges[e, 1]), (edges[e, 1], edges[e, 0])):
            neighbour[fill[a]], weight[fill[a]] = b, lengths[e]
            fill[a] += 1
    distance = np.full(count, np.inf)
    previous = np.full(count, -1, np.int64)
    queue = [(0.0, -1)]
    queue.pop()
    for i in range(len(first)):
        distance[first[i]] = first_length[i]
        heapq.heappush(queue, (first_length[i], first[i]))
    while len(queue) > 0:
        d, node = heapq.heappop(queue)
        if d > distance[node]:
            continue
        for k in range(start[node], start[node + 1]):
            candidate = d + weight[k]
            if candidate < distance[neighbour[k]]:
                distance[neighbour[k]] = candidate
                previous[neighbour[k]] = node
                heapq.heappush(queue, (candidate, neighbour[k]))
    return distance, previous


@njit(cache=True)
def _containing(union, x, y):
    """Indices of the regions of a union that contain (x, y)."""
    center, bearing_0, values = union.center, union.bearing_0, union.values
    return np.array([k for k in range(len(center)) if covers(center, bearing_0, values, k, x, y, 0.0)], np.int64)


@njit(cache=True)
def _visible_nodes(union, here, x, y):
    """Nodes whose region contains (x, y), or whose centre the region `here` contains."""
    center, bearing_0, values = union.center, union.bearing_0, union.values
    own_center, own_bearing_0, own_values = here.center, here.bearing_0, here.values
    out = np.empty(len(center), np.int64)
    n = 0
    for k in range(len(out)):
        if covers(center, bearing_0, values, k, x, y, 0.0) or covers(
            own_center, own_bearing_0, own_values, 0, center[k, 0], center[k, 1], 0.0
        ):
            out[n] = k
            n += 1
    return out[:n].copy()
