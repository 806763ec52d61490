"""III-B.3: the roadmap of nodes, which hold a region each, of frontier points, and of edges."""

import dataclasses
from dataclasses import field

import numpy as np

from drake_starnav.paper import choices
from drake_starnav.paper.frontier_points import identify_frontier_points
from drake_starnav.planning.roadmap import append_node
from drake_starnav.planning.state import EMPTY_PATH, PlannerState
from drake_starnav.surroundings.observation import Observation
from drake_starnav.utils.snapshot import snapshot


@snapshot
class PaperState(PlannerState):
    """R, p_sg and the flags of Algorithm 1. Immutable. The short-term goal p_sg is the first point of `path`.

    Attributes:
        points: frontier points, shape (n, 2), W, m: all are `extendable`. One that is visited becomes a node, so that
            none is left of those that III-B.3 calls `stuck`, and line 16 deletes the others.
        owners: node of each, shape (n,).
        node: the one at which the robot was last.
        update: the flag of lines 11 and 17.
    """

    points: np.ndarray = field(default_factory=lambda: EMPTY_PATH)
    owners: np.ndarray = field(default_factory=lambda: np.zeros(0, np.int64))
    node: int = 0
    update: bool = False

    @staticmethod
    def of(state: PlannerState) -> "PaperState":
        """Return a planner's state as the paper's, at first without frontier points: line 9 of Algorithm 1."""
        return state if isinstance(state, PaperState) else PaperState(**vars(state))

    def frontiers(self, robot_radius: float) -> np.ndarray:
        """Return a short line across the way to each frontier point, shape (n, 2, 2), W, m."""
        offsets = self.points - self.roadmap.union.center[self.owners]
        side_vectors = np.column_stack((-offsets[:, 1], offsets[:, 0])) / np.hypot(*offsets.T)[:, None]
        half_lines = 0.5 * robot_radius * side_vectors
        return np.stack((self.points - half_lines, self.points + half_lines), axis=1)


def generate_roadmap(state: PaperState, observation: Observation) -> PaperState:
    """Lines 1 to 8 of Algorithm 1: GenRoadmap(p, L, R). As printed, with L for the undefined B of line 12.

    Edges are derived of the regions where they are asked for: see `short_term_goal`.
    """
    region = observation.region  # line 2, see `make_traversable_region`: perception has fitted it
    assert region is not None
    frontier_points = identify_frontier_points(region, observation.scan, observation.pose)  # line 3
    for other in state.roadmap.regions:  # III-B.3: new points within other regions are no frontier points
        frontier_points = frontier_points[~other.contains(frontier_points).astype(bool)]
    return dataclasses.replace(
        state,
        roadmap=append_node(state.roadmap, observation, state.roadmap.grid),  # lines 4 to 7
        points=np.vstack((state.points, frontier_points)),
        owners=np.append(state.owners, np.full(len(frontier_points), len(state.roadmap))),
        node=len(state.roadmap),
        update=False,
    )


def delete_point(state: PaperState, place: np.ndarray) -> PaperState:
    """Line 16 of Algorithm 1: delete p_sg in R; a node is kept, as it holds a region."""
    is_other = np.hypot(*(state.points - place).T) > 1e-9
    return dataclasses.replace(state, points=state.points[is_other], owners=state.owners[is_other])


def is_feasible(state: PaperState, observation: Observation, time: float) -> bool:
    """Line 14 of Algorithm 1: `stuck` <- check the feasibility of p_sg. What that means is not printed.

    It is infeasible if a hit of the scan lies nearer to it than `FEASIBLE_DISTANCE`, or if the robot has not moved by
    `STUCK_DISTANCE` in `STUCK_TIME`. Only the second applies to a node, where the robot was, and to the goal.
    """
    if time - state.progress.time > choices.STUCK_TIME:
        return False
    if not (state.points == state.route.path[0]).all(axis=1).any():
        return True
    hit_points = observation.scan.points(observation.pose)
    return not (np.hypot(*(hit_points - state.route.path[0]).T) < choices.FEASIBLE_DISTANCE).any()


def is_near(a: np.ndarray, b: np.ndarray, distance: float) -> bool:
    """Whether two places, shape (2,), are this near to each other, m."""
    return bool(np.hypot(a[0] - b[0], a[1] - b[1]) < distance)
