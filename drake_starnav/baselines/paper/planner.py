"""The paper's planner: from node to node to the frontier point nearest to the goal, where it looks again."""

import dataclasses
from dataclasses import field

import numpy as np
from scipy.sparse import csr_array
from scipy.sparse.csgraph import dijkstra

from drake_starnav.baselines.paper import constants
from drake_starnav.baselines.paper.frontiers import frontier_points
from drake_starnav.planning.roadmap import with_node
from drake_starnav.planning.state import EMPTY_PATH, PlannerInput, PlannerState, PlannerStatus
from drake_starnav.surroundings.observation import Observation
from drake_starnav.utils.snapshot import snapshot


@snapshot
class PaperState(PlannerState):
    """The state of the paper's planner. Immutable.

    Attributes:
        points: shape (n, 2), its frontier points, W, m. All are extendable: one that is visited becomes a node, and one
            at which the robot is stuck is deleted.
        owners: shape (n,), the node of each.
    """

    points: np.ndarray = field(default_factory=lambda: EMPTY_PATH)
    owners: np.ndarray = field(default_factory=lambda: np.zeros(0, np.int64))

    @staticmethod
    def of(state: PlannerState) -> "PaperState":
        """A planner's state as the paper's, at first without frontier points."""
        return state if isinstance(state, PaperState) else PaperState(**vars(state))

    def frontiers(self, robot_radius: float) -> np.ndarray:
        """A short line across the way to each frontier point, shape (n, 2, 2), W, m."""
        away = self.points - self.roadmap.union.center[self.owners]
        across = np.column_stack((-away[:, 1], away[:, 0])) / np.hypot(*away.T)[:, None]
        half = 0.5 * robot_radius * across
        return np.stack((self.points - half, self.points + half), axis=1)


def plan_step(state: PlannerState, inputs: PlannerInput) -> PlannerState:
    """One update of the planner; arguments as for `planning.plan_step`.

    Source: paper, algorithm 1.
    """
    observation, path = inputs.observation, state.path
    if state.status is PlannerStatus.UNREACHABLE or observation.region is None:
        return state
    if not _near(inputs.position, state.progress_position, constants.STUCK_DISTANCE):
        state = dataclasses.replace(state, progress_position=inputs.position.copy(), progress_time=inputs.time)
    stuck = inputs.time - state.progress_time > constants.STUCK_TIME
    if len(path) and not stuck:
        if not _near(inputs.position, path[0], constants.ARRIVAL):
            return state
        if len(path) > 1:  # a node, which is only a way point
            return dataclasses.replace(state, path=path[1:])
        if state.target is None:
            return state
    now = PaperState.of(state)
    if len(path):
        now = without_point(now, path[0])
    now = dataclasses.replace(
        extended(now, observation), progress_position=inputs.position.copy(), progress_time=inputs.time
    )
    return _searched(now, inputs)


def without_point(state: PaperState, place: np.ndarray) -> PaperState:
    """The state without the frontier points at a place, shape (2,), W, m."""
    others = np.hypot(*(state.points - place).T) > 1e-9
    return dataclasses.replace(state, points=state.points[others], owners=state.owners[others])


def extended(state: PaperState, observation: Observation) -> PaperState:
    """The state with a node at which a scan was taken, and its frontier points outside all other regions.

    Edges lead to the nodes whose centre its region contains, or whose region contains its centre.

    Source: paper, algorithm 1, GenRoadmap, and section III-B.3.
    """
    assert observation.region is not None
    points, roadmap = frontier_points(observation.region, observation.scan, observation.pose), state.roadmap
    for region in roadmap.regions:
        points = points[~region.contains(points).astype(bool)]
    return dataclasses.replace(
        state,
        roadmap=with_node(roadmap, observation, roadmap.hits),
        points=np.vstack((state.points, points)),
        owners=np.append(state.owners, np.full(len(points), len(roadmap))),
    )


def shortest_path(state: PaperState, goal: np.ndarray) -> tuple[np.ndarray, bool]:
    """The nodes to drive to from the newest one, shape (k, 2), W, m, and whether the last one is the goal.

    The goal is a node wherever a region contains it. Otherwise the path ends at the frontier point of least path length
    and straight line to the goal, by which the paper does not say; without a frontier point it is empty.

    Source: paper, eq. (optim_selection).
    """
    roadmap = state.roadmap
    center, count = roadmap.union.center, len(roadmap)
    lengths = np.hypot(*np.diff(center[roadmap.edges], axis=1)[:, 0].T)
    graph = csr_array((lengths, roadmap.edges.T), shape=(count, count))
    distance, previous = dijkstra(graph, directed=False, indices=count - 1, return_predecessors=True)
    inside = np.flatnonzero([bool(region.contains(goal)) for region in roadmap.regions])
    arrives = len(inside) > 0
    ends = np.repeat(goal[None, :], len(inside), axis=0) if arrives else state.points
    owner = inside if arrives else state.owners
    if not len(ends):
        return EMPTY_PATH, False
    cost = distance[owner] + np.hypot(*(ends - center[owner]).T) + np.hypot(*(ends - goal).T)
    best = int(np.argmin(cost))
    nodes, node = [], int(owner[best])
    while node != count - 1:
        nodes.append(node)
        node = int(previous[node])
    return np.vstack((center[nodes[::-1]], ends[best])), arrives


def _searched(state: PaperState, inputs: PlannerInput) -> PaperState:
    """The state with a new path. Without one the goal is unreachable."""
    path, arrives = shortest_path(state, inputs.goal)
    status = PlannerStatus.APPROACHING if arrives else PlannerStatus.EXPLORING
    return dataclasses.replace(
        state,
        status=status if len(path) else PlannerStatus.UNREACHABLE,
        path=path,
        target=None if arrives or not len(path) else np.vstack((path[-1], path[-1])),
        plans=state.plans + 1,
    )


def _near(a: np.ndarray, b: np.ndarray, distance: float) -> bool:
    """Whether two places, shape (2,), are this near to each other."""
    return bool(np.hypot(a[0] - b[0], a[1] - b[1]) < distance)
