"""III-C.2: the short-term goal, the first node on the shortest path through the roadmap."""

from typing import NamedTuple

import numpy as np
from scipy.sparse import csr_array
from scipy.sparse.csgraph import dijkstra

from drake_starnav.paper.roadmap import PaperState


class Sequence(NamedTuple):
    """p_f,2 to p_f,M of Eq. (6), shape (k, 2), W, m, empty where there is none; and whether the last is the goal."""

    places: np.ndarray
    reaches_goal: bool


def find_shortest_sequence(state: PaperState, position: np.ndarray, goal: np.ndarray) -> Sequence:
    """Eq. (6): min sum_i |p_f,i - p_f,i-1|  with p_f,1 = p, p_f,M = p_goal, (p_f,i, p_f,i+1) in E.

    Corrected: the sum begins at the robot, as p_f,0 is not defined. p_goal is a node only where a region contains it;
    else the sequence ends at the frontier point of least length and straight line on to the goal. Visited nodes may be
    passed. The robot p has the edges of the node at which it was last.
    """
    roadmap = state.roadmap
    centers, nodes = roadmap.union.center, len(roadmap)
    goal_nodes = np.flatnonzero([bool(region.contains(goal)) for region in roadmap.regions])
    reaches_goal = len(goal_nodes) > 0
    end_points = np.repeat(goal[None, :], len(goal_nodes), axis=0) if reaches_goal else state.points
    end_owners = goal_nodes if reaches_goal else state.owners
    if not len(end_points):
        return Sequence(np.zeros((0, 2)), False)
    places = np.vstack((position, centers, end_points))  # vertices: the robot, then nodes, then ends
    edges = np.vstack((1 + roadmap.edges, np.column_stack((1 + end_owners, 1 + nodes + np.arange(len(end_points))))))
    adjacent_edges = edges[(edges == 1 + state.node).any(axis=1)]
    own_edges = np.where(adjacent_edges == 1 + state.node, 0, adjacent_edges)
    edges = np.vstack((edges, own_edges, (0, 1 + state.node)))
    sequence = find_shortest_path(places, edges, 1 + nodes, np.hypot(*(end_points - goal).T))
    return Sequence(places[sequence], reaches_goal and len(sequence) > 0)


def find_shortest_path(places: np.ndarray, edges: np.ndarray, first_end: int, lengths_left: np.ndarray) -> list[int]:
    """Return the vertices after the first on the shortest path from it to any from `first_end` on; none without one.

    Args:
        places: of the vertices, shape (n, 2), m.
        edges: shape (e, 2), undirected.
        first_end: that vertex and all after it may be the last.
        lengths_left: what counts beside the path to each of them, m.
    """
    edge_lengths = np.hypot(*(places[edges[:, 0]] - places[edges[:, 1]]).T)
    edge_graph = csr_array((np.maximum(edge_lengths, 1e-9), edges.T), shape=(len(places), len(places)))
    distances, previous_vertices = dijkstra(edge_graph, directed=False, indices=0, return_predecessors=True)
    total_lengths = distances[first_end:] + lengths_left
    vertex, path = first_end + int(np.argmin(total_lengths)) if np.isfinite(total_lengths).any() else 0, []
    while vertex != 0:
        path.append(vertex)
        vertex = int(previous_vertices[vertex])
    return path[::-1]
