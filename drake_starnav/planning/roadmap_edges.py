"""Edges of the roadmap: which nodes the robot can drive between."""

import math

import numpy as np
from numba import njit

from drake_starnav.regions.region_union import covers, least_outside

DRIVEN_EDGE_PENALTY = 0.2
"""Extra length of an edge that the robot has driven but that no region certifies as free, m."""


@njit(cache=True)
def revised_edges(before, center, number, changed, union):
    """Edges and lengths of a roadmap in which regions are new, have changed or were dropped.

    An edge joins two nodes if one's region contains the other's centre. Without such a node among the older ones, the
    robot has come from the region that a centre exceeds least.

    Args:
        before: edges and lengths of the roadmap before, each sorted by the newer node.
        center: of its nodes.
        number: of each of its nodes, its new index, or -1 if it was dropped.
        changed: shape (n,), whether the region of a node is new or has changed.
        union: of the nodes.
    """
    edges, lengths = before
    known, n = np.empty((len(edges), 2), np.int64), 0
    for e in range(len(edges)):
        a, b = edges[e]
        i, j = number[a], number[b]
        straight = math.hypot(center[a, 0] - center[b, 0], center[a, 1] - center[b, 1])
        certified = lengths[e] < straight + 0.5 * DRIVEN_EDGE_PENALTY
        if certified and i >= 0 and j >= 0 and not changed[i] and not changed[j]:
            known[n, 0], known[n, 1] = i, j
            n += 1
    return _edges_where_changed(union, known[:n], changed)


@njit(cache=True)
def _edges_where_changed(union, known, changed):
    """The known edges, sorted by their newer node, with those of changed nodes; and the lengths of all, m."""
    center, count, news = union.center, len(union.center), np.flatnonzero(changed)
    out = np.empty((len(known) + count * (len(news) + 1), 2), np.int64)
    lengths = np.empty(len(out))
    joined = np.zeros(count, np.bool_)
    n = e = 0
    for j in range(count):
        begin = n
        joined[:j] = False
        while e < len(known) and known[e, 1] == j:
            joined[known[e, 0]] = True
            e += 1
        for k in range(j if changed[j] else len(news)):
            i = k if changed[j] else news[k]
            joined[i] = joined[i] or (i < j and _edge_length(union, i, j) < np.inf)
        for i in range(j):
            if joined[i]:
                out[n, 0], out[n, 1] = i, j
                lengths[n] = math.hypot(center[i, 0] - center[j, 0], center[i, 1] - center[j, 1])
                n += 1
        if j and n == begin:
            i = least_outside(union, j, center[j, 0], center[j, 1])
            out[n, 0], out[n, 1] = i, j
            lengths[n] = math.hypot(center[i, 0] - center[j, 0], center[i, 1] - center[j, 1]) + DRIVEN_EDGE_PENALTY
            n += 1
    return out[:n].copy(), lengths[:n].copy()


@njit(cache=True)
def _edge_length(union, i, j):
    """Distance of the centres of two regions if one contains the other's, m; else infinity."""
    center, bearing_0, values = union.center, union.bearing_0, union.values
    ax, ay, bx, by = center[i, 0], center[i, 1], center[j, 0], center[j, 1]
    if covers(center, bearing_0, values, i, bx, by, 0.0) or covers(center, bearing_0, values, j, ax, ay, 0.0):
        return math.hypot(ax - bx, ay - by)
    return np.inf
