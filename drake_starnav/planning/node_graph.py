"""Shortest ways over the nodes of a roadmap."""

import numpy as np
from numba import njit

from drake_starnav.planning.roadmap import StarRoadmap
from drake_starnav.regions.region_union import excess
from drake_starnav.regions.star_region import StarRegion


def graph_distances(roadmap: StarRoadmap, here: StarRegion, position: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Length of the shortest way from the robot to every node, shape (n,), m, and each node's predecessor or -1.

    The robot is connected to nodes whose region contains it and to nodes inside the latest region. If there are none,
    it is connected to the node whose region it is the least outside of.
    """
    beyond = excess(roadmap.union, *position)
    first = np.flatnonzero((beyond <= 0.0) | here.contains(roadmap.union.center))
    if not len(first):
        first = np.array([len(roadmap) - 1 - np.argmin(beyond[::-1])])  # of equals the newest
    distance = np.full(len(roadmap), np.inf)
    distance[first] = np.hypot(*(roadmap.union.center[first] - position).T)
    return distance, _spread(roadmap.edges, roadmap.lengths, distance)


def entry_node(roadmap: StarRoadmap, distance: np.ndarray, goal: np.ndarray) -> int:
    """The node whose region contains the goal and through which the way is shortest, or -1."""
    inside = np.flatnonzero(excess(roadmap.union, *goal) <= 0.0)
    if not len(inside):
        return -1
    cost = distance[inside] + np.hypot(*(roadmap.union.center[inside] - goal).T)
    best = int(np.argmin(cost))
    return int(inside[best]) if np.isfinite(cost[best]) else -1


def graph_lengths(roadmap: StarRoadmap, distance: np.ndarray) -> np.ndarray:
    """Length of the way over the nodes and across each frontier, shape (n,), m."""
    frontiers = roadmap.frontiers
    to_viewpoint = distance[frontiers.owner] + np.hypot(
        *(frontiers.viewpoint - roadmap.union.center[frontiers.owner]).T
    )
    return to_viewpoint + np.hypot(*(frontiers.probe - frontiers.viewpoint).T)


def node_path(roadmap: StarRoadmap, previous: np.ndarray, node: int, end: np.ndarray) -> np.ndarray:
    """Way points from the first node to `node` and on to `end`."""
    chain = [node]
    while previous[chain[-1]] >= 0:
        chain.append(int(previous[chain[-1]]))
    return np.vstack((roadmap.union.center[chain[::-1]], end[None, :]))


@njit(cache=True)
def _spread(edges, lengths, distance):
    """Lower the distances of nodes (n,) to those by way of edges (e, 2); the predecessor by which each was, or -1.

    Sweeps as of Bellman and Ford, in turn from the last edge and from the first: few, as edges are sorted by node.
    """
    previous, lowered, turned = np.full(len(distance), -1), True, False
    while lowered:
        lowered, turned = False, not turned
        for k in range(len(edges)):
            e = len(edges) - 1 - k if turned else k
            for a, b in ((edges[e, 0], edges[e, 1]), (edges[e, 1], edges[e, 0])):
                if distance[a] + lengths[e] < distance[b]:
                    distance[b], previous[b], lowered = distance[a] + lengths[e], a, True
    return previous
