"""Edges of the roadmap: which nodes the robot can drive between."""

import math

import numpy as np
from numba import njit

from drake_starnav.regions.region_union import CELL, WORD, covers, excess


@njit(cache=True)
def edges_from(union, first):
    """Edges (e, 2) from nodes of an index from `first` on to older ones, sorted by the newer node; their lengths, m.

    Of an indexed union. An edge joins two nodes if one's region contains the other's centre. Without such a node among
    the older ones, the robot has come from the region that a centre exceeds least.
    """
    center, bearing_0, values, marks = union.center, union.bearing_0, union.values, union.marks
    cell, one = np.floor(center / CELL).astype(np.int64) - union.corner, np.uint64(1)
    ends, lengths = [(0, 0)][:0], [0.0][:0]
    for j in range(first, len(center)):
        x, y, begin = center[j, 0], center[j, 1], len(ends)
        for i in range(j):
            u, v = center[i, 0], center[i, 1]
            older = marks[cell[j, 0], cell[j, 1], i // WORD] >> np.uint64(i % WORD) & one
            newer = marks[cell[i, 0], cell[i, 1], j // WORD] >> np.uint64(j % WORD) & one
            if (older and covers(center, bearing_0, values, i, x, y, 0.0)) or (
                newer and covers(center, bearing_0, values, j, u, v, 0.0)
            ):
                ends.append((i, j))
                lengths.append(math.hypot(u - x, v - y))
        if j and len(ends) == begin:
            i = j - 1 - int(np.argmin(excess(union, x, y)[:j][::-1]))  # of equals the newest
            ends.append((i, j))
            lengths.append(math.hypot(center[i, 0] - x, center[i, 1] - y))
    edges = np.empty((len(ends), 2), np.int64)
    for e in range(len(ends)):
        edges[e, 0], edges[e, 1] = ends[e]
    return edges, np.array(lengths)
