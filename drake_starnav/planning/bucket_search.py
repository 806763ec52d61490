"""Search of a grid by a bucket queue: Dijkstra's from a goal, or A* towards a source."""

import numpy as np
from numba import njit

from drake_starnav.geometry.compiled import largest

UNREACHED = 2**30
"""Costs are stored less this, so that 0, of which memory is full at no cost, stands for what was not reached."""
NEIGHBOURHOOD = 150
"""The margin of a search that reaches all 3 x 3 cells about a point, hundredths of a cell."""


@njit(cache=True)
def bucket_dijkstra(weight, cost, gi, gj, cost_to_come_grid, margin=NEIGHBOURHOOD, si=-1, sj=-1):
    """Dial's bucket-queue A* from the goal (gi, gj) to the source (si, sj); Dijkstra's search without a source (-1).

    It fills `cost`, which begins as zeros. It stops once every open cell's f = cost_to_go + heuristic exceeds the best
    cost_to_go + cost_to_come by more than `margin`, and returns that f, else -1; cells not reached by then have a
    cost_to_go of at least f - heuristic. All costs are in hundredths of a cell, in both grids less UNREACHED.
    """
    ny = weight.shape[1]
    w, costs = weight.ravel(), cost.ravel()
    cost_to_come = cost_to_come_grid.ravel()
    best = UNREACHED
    buckets = 1
    while buckets <= 28 * np.int64(largest(w)) + 1:
        buckets *= 2
    head = np.full(buckets, -1, np.int32)
    entries = np.empty((buckets, 3), np.int32)  # cell, cost less UNREACHED, next entry
    rows, columns = np.array([1, -1, 0, 0, 1, 1, -1, -1]), np.array([0, 0, 1, -1, 1, -1, 1, -1])
    lengths = np.array([10, 10, 10, 10, 14, 14, 14, 14])
    start = gi * ny + gj
    costs[start] = -UNREACHED
    entries[0, 0], entries[0, 1], entries[0, 2] = start, -UNREACHED, -1
    bucket = heuristic(gi, gj, si, sj) & (buckets - 1)
    head[bucket] = 0
    used = 1
    waiting = 1
    while waiting > 0:
        if used + 8 > len(entries):
            larger = np.empty((2 * len(entries), 3), np.int32)
            larger[:used] = entries[:used]
            entries = larger
        while waiting > 0 and used + 8 <= len(entries):  # apart: Numba would count references to what a loop replaces
            while head[bucket] < 0:
                bucket = (bucket + 1) & (buckets - 1)
            e = head[bucket]
            head[bucket] = entries[e, 2]
            waiting -= 1
            c, reached = entries[e, 0], entries[e, 1]
            if reached > costs[c]:
                continue
            cost_to_go = reached + UNREACHED
            if cost_to_come[c] < 0:
                best = min(best, cost_to_go + cost_to_come[c] + UNREACHED)
            i = np.int64(c) // ny
            j = c - i * ny
            f = cost_to_go + heuristic(i, j, si, sj)
            if f > best + margin:
                return f
            for k in range(8):
                n = c + rows[k] * ny + columns[k]
                if w[n] == 0:
                    continue
                candidate = reached + w[n] * lengths[k]
                if candidate < costs[n]:
                    costs[n] = candidate
                    b = (candidate + UNREACHED + heuristic(i + rows[k], j + columns[k], si, sj)) & (buckets - 1)
                    entries[used, 0], entries[used, 1], entries[used, 2] = n, candidate, head[b]
                    head[b] = used
                    used += 1
                    waiting += 1
    return -1


@njit(cache=True)
def heuristic(i, j, si, sj):
    """A lower bound of the cost from the source (si, sj), in hundredths of a cell; 0 without a source (-1).

    It is no more than the straight line, which is no more than the way from cell to cell.
    """
    if si < 0:
        return 0
    di, dj = abs(i - si), abs(j - sj)
    return (100 * max(di, dj) + 40 * min(di, dj)) * 12 // 13
