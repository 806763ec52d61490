"""Search of a grid by a bucket queue: Dijkstra's from a goal, or A* towards a source."""

import numpy as np

from drake_starnav.geometry.compiled import kernel, leaf

UNREACHED_COST = 2**30
"""Costs are stored less this: a cell that still holds 0 was not reached."""
BUCKETS = 2**13
"""Of a queue: no open cell exceeds the least by more, as a step costs at most 14 times 255, and h falls by less."""
NEIGHBOURHOOD = 150
"""The margin by which a search reaches all 3 x 3 cells about its source, hundredths of a cell."""


@kernel
def search_buckets(weight, cost, goal, source):
    """Run Dial's bucket A* from the goal to the source, cells (i, j); Dijkstra's search without a source (-1, -1).

    It fills `cost`, which begins as zeros, in hundredths of a cell less UNREACHED_COST. It stops once every open cell's
    f = cost + estimate exceeds the cost from the source, or if that is blocked from the cells about it, by more than
    NEIGHBOURHOOD.

    Args:
        weight: what crossing each cell costs in tenths, at least 10, or 0 where it is blocked, as at the border; uint8.
        cost: same shape, int32.
        goal, source: cells.
    """
    ny = weight.shape[1]
    (gi, gj), (si, sj) = goal, source
    w, costs = weight.ravel(), cost.ravel()
    best_cost = UNREACHED_COST
    source_reach = 0 if si >= 0 and sj >= 0 and si < weight.shape[0] and sj < ny and weight[si, sj] > 0 else 1
    head = np.full(BUCKETS, -1, np.int32)
    entries = np.empty((BUCKETS, 3), np.int32)  # 8 * cell + direction of the step to it, cost less UNREACHED_COST, next
    rows, columns = np.array([1, 1, 0, -1, -1, -1, 0, 1]), np.array([0, 1, 1, 1, 0, -1, -1, -1])  # by bearing
    start = gi * ny + gj
    costs[start] = -UNREACHED_COST
    bucket = estimate_cost(gi, gj, si, sj) & (BUCKETS - 1)
    for k in range(2):  # as if reached in two opposite directions, from where its neighbours are all those of either
        entries[k, 0], entries[k, 1], entries[k, 2] = 8 * start + 4 * k, -UNREACHED_COST, k - 1
    head[bucket] = 1
    used, spare, waiting = 2, -1, 2
    while waiting > 0:
        if used + 8 > len(entries):
            larger = np.empty((2 * len(entries), 3), np.int32)
            for k in range(used):  # an assignment to a slice takes Numba 2 s to compile
                larger[k, 0], larger[k, 1], larger[k, 2] = entries[k, 0], entries[k, 1], entries[k, 2]
            entries = larger
        while waiting > 0 and used + 8 <= len(entries):  # apart: Numba would count references to what a loop replaces
            while head[bucket] < 0:
                bucket = (bucket + 1) & (BUCKETS - 1)
            e = head[bucket]
            c, incoming_direction, entry_cost = np.int64(entries[e, 0]) // 8, entries[e, 0] & 7, entries[e, 1]
            head[bucket], entries[e, 2], spare = entries[e, 2], spare, e
            waiting -= 1
            if entry_cost > costs[c]:
                continue
            i = c // ny
            j = c - i * ny
            f = entry_cost + UNREACHED_COST + estimate_cost(i, j, si, sj)
            if si >= 0 and abs(i - si) <= source_reach and abs(j - sj) <= source_reach:
                best_cost = min(best_cost, f)
            if f > best_cost + NEIGHBOURHOOD:
                return
            for turn in range(
                incoming_direction + 6, incoming_direction + 11
            ):  # from the cell before, the others are reached at less cost
                k = turn & 7
                n = c + rows[k] * ny + columns[k]
                if w[n] == 0:
                    continue
                candidate = entry_cost + w[n] * (14 if k & 1 else 10)
                if candidate < costs[n]:
                    costs[n] = candidate
                    b = (candidate + UNREACHED_COST + estimate_cost(i + rows[k], j + columns[k], si, sj)) & (
                        BUCKETS - 1
                    )
                    if spare < 0:
                        e, used = used, used + 1
                    else:
                        e, spare = spare, entries[spare, 2]
                    entries[e, 0], entries[e, 1], entries[e, 2] = 8 * n + k, candidate, head[b]
                    head[b] = e
                    waiting += 1


@leaf
def estimate_cost(i, j, si, sj):
    """Return the least cost from a cell to the source (si, sj), in hundredths of a cell; 0 without a source (-1)."""
    if si < 0:
        return 0
    di, dj = abs(i - si), abs(j - sj)
    return 100 * max(di, dj) + 40 * min(di, dj)
