"""Search of the roadmap: which frontier to drive to next, and along which path."""

import dataclasses
import math
from dataclasses import dataclass, field
from enum import Enum, auto
from typing import NamedTuple

import numpy as np
from numba import njit

from drake_starnav.planning.approach import Approach, approach
from drake_starnav.planning.cost_field import CostField, Origins, Terrain, cost_to_go
from drake_starnav.planning.distance_grid import HIT_ERROR, STRIDE
from drake_starnav.planning.frontiers import Frontiers
from drake_starnav.planning.node_graph import entry_node, graph_distances, graph_lengths, node_path
from drake_starnav.planning.optimistic_path import next_segment_of, optimistic_path_beyond, virtual_frontier
from drake_starnav.planning.roadmap import StarRoadmap, is_blacklisted
from drake_starnav.planning.state import PlannerInput
from drake_starnav.planning.string_pulling import string_pulled
from drake_starnav.regions.region_union import RegionUnion, cover_at, first_gap
from drake_starnav.regions.star_region import StarRegion

HYSTERESIS = 0.5
"""Bonus of the current target, against oscillation between targets, m."""
VIRTUAL_FRONTIER_ADVANTAGE = 0.25
"""A virtual frontier is used only if the optimistic path is shorter than the way over the best frontier by this, m."""
MOST_BLACKLISTED = 4
"""Largest number of places closed in one search."""
MARGINS_IN_DOUBT = 3.0
"""Hits may err by this many times the least margin, which allows for the errors of most."""
SIGHT_BEARINGS = 60
"""Lines of sight are tested first where another one near the same of so many bearings was blocked."""


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


class Kind(Enum):
    """Of a candidate: the goal, which a region contains or known space leads to, or a frontier."""

    GOAL = auto()
    FRONTIER = auto()
    VIRTUAL = auto()


class Candidate(NamedTuple):
    """A place to drive to.

    Attributes:
        cost: of the way to it and on to the goal, m.
        kind: what it is.
        target: a frontier, one row; none if it is the goal.
        path: shape (k, 2), way points from after the robot to it, W, m.
    """

    cost: float
    kind: Kind
    target: Frontiers
    path: np.ndarray


def find_route(
    roadmap: StarRoadmap,
    here: StarRegion,
    inputs: PlannerInput,
    current: np.ndarray | None = None,
    *,
    doubting: bool = False,
) -> Route | None:
    """A route to the cheapest candidate: the goal if a region contains it, else a frontier or a virtual one.

    None if the hits leave no way to the goal even if all unknown space were free.

    For a goal beside a wall, the target is the place nearest to it that a region contains; see `approach`.

    The cost of a frontier is g + h, where g is the length in the graph from the robot to it (or the straight line,
    where it stays inside the union of regions), and h the optimistic cost-to-go from its probe to the goal. A virtual
    frontier costs what the optimistic path does, and VIRTUAL_FRONTIER_ADVANTAGE. If it is where a target was given up,
    the way that was tried in vain is still open: that place is closed, and all candidates are ranked anew.

    Args:
        roadmap: the snapshot.
        here: region of the latest scan.
        inputs: where the robot is and shall go, and the parameters.
        current: viewpoint of the present target frontier, shape (2,), which gets a bonus.
        doubting: whether gaps count as open that are too narrow only if the hits are as wrong as they can be; the
            target is then where the optimistic path leaves the regions.

    Source: paper, section III-D; ranking of frontiers: this project.
    """
    position, ways = inputs.position, graph_distances(roadmap, here, inputs.position)
    arrival = _arrival(roadmap, here, inputs, ways)
    if arrival is not None:
        return Route(_pulled(roadmap.union, position, arrival.path), arrival.target)
    if doubting:
        roadmap = dataclasses.replace(roadmap, frontiers=Frontiers.none())
    for closed in range(MOST_BLACKLISTED + 1):
        ranked, to_go = _ranked(roadmap, inputs, ways, current, doubting, closed < MOST_BLACKLISTED)
        if (
            not ranked
            or ranked[0].kind is not Kind.VIRTUAL
            or not is_blacklisted(roadmap, ranked[0].target.viewpoint)[0]
        ):
            break
        probes = np.vstack((roadmap.blacklisted_probes, ranked[0].target.probe))
        roadmap = dataclasses.replace(roadmap, blacklisted_probes=probes)
    if not ranked:
        return None
    _, kind, target, path = ranked[0]
    if kind is Kind.GOAL:
        return Route(_pulled(roadmap.union, position, path), target)
    beyond = optimistic_path_beyond(to_go, target)
    next_segment = next_segment_of(beyond, to_go, position)
    path = _pulled(here.alone if doubting else roadmap.union, position, path)
    return Route(path, target, beyond, next_segment, roadmap.blacklisted_probes)


def _arrival(
    roadmap: StarRoadmap, here: StarRegion, inputs: PlannerInput, ways: tuple[np.ndarray, np.ndarray]
) -> Candidate | None:
    """The goal, or the place nearest to it where the robot may arrive, if a region contains it."""
    distance, previous = ways
    for place in goal_approach(roadmap, inputs).places:
        path = place[None, :].copy()
        if cover_at(here.alone, *place, 0.0) >= 0:
            return Candidate(0.0, Kind.GOAL, Frontiers.none(), path)
        node = entry_node(roadmap, distance, place)
        if node >= 0:
            # Where nodes are added on the way, the way over the nodes would lead back to the one behind again and again
            if first_gap(roadmap.union, tuple(inputs.position), tuple(place), 0.0) > 0.0:
                path = node_path(roadmap, previous, node, place)
            return Candidate(0.0, Kind.GOAL, Frontiers.none(), path)
    return None


def _ranked(
    roadmap: StarRoadmap,
    inputs: PlannerInput,
    ways: tuple[np.ndarray, np.ndarray],
    current: np.ndarray | None,
    doubting: bool,
    virtual: bool,
) -> tuple[list[Candidate], CostField]:
    """The best candidate of each kind, cheapest first, and the cost-to-go.

    With `virtual`, the cost-to-go is exact only where a candidate may be the cheapest. A path to the goal that lies in
    the regions, though none of them contains the goal, comes last: noise at their edges may hide it.
    """
    to_go, frontier = _best_frontier(roadmap, inputs, ways, current, doubting, virtual)
    hoped = float(to_go.at(inputs.position[None, :])[0]) + VIRTUAL_FRONTIER_ADVANTAGE if virtual else math.inf
    if not hoped < (frontier[0].cost if frontier else math.inf):
        return frontier, to_go
    optimistic = to_go.path(inputs.position)
    target, path = virtual_frontier(roadmap, optimistic)
    if len(target):
        return [Candidate(hoped, Kind.VIRTUAL, target, path), *frontier], to_go
    to_go, frontier = _best_frontier(roadmap, inputs, ways, current, doubting, False)
    known = [Candidate(math.inf, Kind.GOAL, target, optimistic)] if len(optimistic) else []
    return [*frontier, *known], to_go


def _best_frontier(
    roadmap: StarRoadmap,
    inputs: PlannerInput,
    ways: tuple[np.ndarray, np.ndarray],
    current: np.ndarray | None,
    doubting: bool,
    at_robot: bool,
) -> tuple[CostField, list[Candidate]]:
    """The cost-to-go, and the frontier of least g + h, if any leads to the goal; arguments as for `optimistic_cost`."""
    frontiers, (distance, previous) = roadmap.frontiers, ways
    graph = graph_lengths(roadmap, distance)
    to_go = optimistic_cost(roadmap, inputs, graph, at_robot, doubting)
    ahead = estimates(to_go, frontiers, goal_approach(roadmap, inputs).goal)
    if current is not None:
        ahead = ahead - HYSTERESIS * (np.hypot(*(frontiers.viewpoint - current).T) < 1e-9)
    best, cost, direct = cheapest_frontier(roadmap, inputs.position, graph, ahead)
    if best < 0:
        return to_go, []
    target = frontiers.where(np.arange(len(frontiers)) == best)
    path = target.viewpoint if direct else node_path(roadmap, previous, int(target.owner[0]), target.viewpoint[0])
    return to_go, [Candidate(cost, Kind.FRONTIER, target, path)]


def goal_approach(roadmap: StarRoadmap, inputs: PlannerInput) -> Approach:
    """The places at which the robot may arrive, given the hits known so far."""
    return approach(roadmap.hits, inputs.goal, inputs.goal_tolerance, inputs.robot_radius + inputs.margins.preferred)


def cost_at_robot(roadmap: StarRoadmap, inputs: PlannerInput) -> float:
    """The optimistic cost-to-go at the robot, m; infinity without a way. The search ends there."""
    alone = dataclasses.replace(roadmap, frontiers=Frontiers.none())
    return float(optimistic_cost(alone, inputs, np.zeros(0)).at(inputs.position[None, :])[0])


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
    straight = np.hypot(*(frontiers.viewpoint - position).T) + np.hypot(*(frontiers.probe - frontiers.viewpoint).T)
    order = np.argsort(np.minimum(graph, straight) + ahead, kind="stable")
    return _cheapest(roadmap.union, tuple(position.tolist()), frontiers.viewpoint, order, (graph, straight, ahead))


@njit(cache=True)
def _cheapest(union, position, viewpoint, order, costs):
    """The loop of `cheapest_frontier`: lines of sight are only tested where they could still win.

    Of the viewpoints (n, 2) it takes the order of their least costs, and the lengths over the nodes and straight on to
    the probes and the costs ahead, each of shape (n,), m.
    """
    graph, straight, ahead = costs
    best, best_cost, direct = -1, np.inf, False
    blocked = np.zeros(SIGHT_BEARINGS)  # how far away the last line near each bearing left the regions
    for i in order:
        if min(graph[i], straight[i]) + ahead[i] >= best_cost:
            break
        u, v = viewpoint[i, 0], viewpoint[i, 1]
        turn = math.atan2(v - position[1], u - position[0]) / (2.0 * math.pi) + 0.5
        bearing = int(turn * SIGHT_BEARINGS) % SIGHT_BEARINGS
        gap = first_gap(union, position, (u, v), blocked[bearing])
        for k in (bearing - 1, bearing, (bearing + 1) % SIGHT_BEARINGS):
            if gap >= 0.0 and (k == bearing or blocked[k] == 0.0):
                blocked[k] = gap
        cost = (graph[i] if gap >= 0.0 else min(straight[i], graph[i])) + ahead[i]
        if cost < best_cost:
            best, best_cost, direct = i, cost, gap < 0.0
    return best, best_cost, direct


def optimistic_cost(
    roadmap: StarRoadmap,
    inputs: PlannerInput,
    cost_to_come: np.ndarray | None = None,
    at_robot: bool = True,
    doubting: bool = False,
) -> CostField:
    """The cost-to-go field.

    Args:
        roadmap: hits, closed and blocked places.
        inputs: robot, goal and parameters.
        cost_to_come: of the frontiers, shape (n,), m; the search ends once the cheapest of them is known.
        at_robot: whether it may also end once the cost at the robot is the least; the frontiers' costs are then lower
            bounds.
        doubting: as for `find_route`.
    """
    position, robot_radius = inputs.position, inputs.robot_radius
    goal = goal_approach(roadmap, inputs).goal
    known = np.vstack((roadmap.hits.bounds, roadmap.union.bounds, goal, position))
    low, high = known.min(axis=0) - 0.5, known.max(axis=0) + 0.5  # no way is shorter farther out
    probes = roadmap.blacklisted_probes
    clearance = np.full(len(probes), robot_radius + inputs.margins.preferred + HIT_ERROR)
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
    terrain = Terrain(robot_radius, blacklist, doubt(inputs) if doubting else 0.0, inputs.swept_radius)
    return cost_to_go(roadmap.hits, goal, low, high, terrain, origins)


def doubt(inputs: PlannerInput) -> float:
    """By how much the distance of a cell from the hits may be too small, m; less for a robot as small as a cell."""
    half_diagonal = math.hypot(0.5, 0.5) * inputs.parameters.grid_resolution
    most = inputs.robot_radius - STRIDE * inputs.parameters.grid_resolution
    return max(min(half_diagonal + MARGINS_IN_DOUBT * inputs.margins.least, most), 0.0)


def estimates(field: CostField, frontiers: Frontiers, goal: np.ndarray) -> np.ndarray:
    """Optimistic cost from every frontier's probe to the goal, shape (n,), m; infinity without a way."""
    return np.maximum(field.at(frontiers.probe), np.hypot(*(frontiers.probe - goal).T))


def _pulled(regions: RegionUnion, position: np.ndarray, path: np.ndarray) -> np.ndarray:
    return path if len(path) < 2 else string_pulled(path, position, regions)
