"""Which regions cover the edge frontiers of which nodes: a revision looks only at those whose region has changed."""

from dataclasses import dataclass, field

import numpy as np
from numba import njit

from drake_starnav.planning.frontiers import Frontiers
from drake_starnav.regions.region_union import RegionUnion, covers, newest_cover
from drake_starnav.utils.shared_rows import SharedRows

UNCOVERED, UNKNOWN = -1, -2


@dataclass(frozen=True)
class EdgeCoverage:
    """The edge frontiers of all nodes in turn, and for each a region that covers its probe. Immutable.

    Attributes:
        rows: shape (N, 4), stand and probe, W, m.
        owner: shape (N,), index of the node.
        covered_by: shape (N,), index of a region that covers the probe, or UNCOVERED.
        open: shape (m,), indices into the others of those that no region covers.
    """

    rows: np.ndarray
    owner: np.ndarray
    covered_by: np.ndarray
    open: np.ndarray
    storage: SharedRows = field(repr=False, compare=False)

    @staticmethod
    def of(rows: np.ndarray, owner: np.ndarray, covered_by: np.ndarray, still_open: np.ndarray) -> "EdgeCoverage":
        """With these arrays, which nothing else uses."""
        return EdgeCoverage(rows, owner, covered_by, still_open, SharedRows((rows, owner), len(rows)))

    @staticmethod
    def none() -> "EdgeCoverage":
        """Without nodes."""
        nothing = np.zeros(0, np.int64)
        return EdgeCoverage.of(np.zeros((0, 4)), nothing, np.zeros(0, np.int32), nothing)

    @property
    def arrays(self) -> tuple[np.ndarray, np.ndarray, np.ndarray, np.ndarray]:
        """Arguments of the compiled loops: rows, owner, covered_by, open."""
        return self.rows, self.owner, self.covered_by, self.open

    @property
    def frontiers(self) -> Frontiers:
        """Those that no region covers."""
        rows = self.rows[self.open]
        return Frontiers(rows[:, :2].copy(), rows[:, 2:].copy(), self.owner[self.open])


def with_newest(before: EdgeCoverage, rows: np.ndarray, union: RegionUnion, slack: float) -> EdgeCoverage:
    """The coverage after a node was added.

    Args:
        before: of the older nodes.
        rows: of the new node.
        union: of all regions, with the new one.
        slack: probes up to this far beyond a region's boundary count as covered, m.
    """
    storage = before.storage.extended(len(before.rows), len(rows), (rows, union.size - 1))
    all_rows, owner = storage.in_use
    covered_by, still_open = _with_newest(all_rows, before.covered_by, before.open, union, slack)
    return EdgeCoverage(all_rows, owner, covered_by, still_open, storage)


def revised(
    before: EdgeCoverage,
    number: np.ndarray,
    changed: np.ndarray,
    fresh: EdgeCoverage,
    union: RegionUnion,
    slack: float,
) -> EdgeCoverage:
    """The coverage after regions were changed or dropped.

    Args:
        before: of all nodes.
        number: of each of them, its new index, or -1 if it was dropped.
        changed: shape (n,), whether the region of a node that remains has changed.
        fresh: the edge frontiers of the changed nodes, with their new indices, and all UNKNOWN.
        union: of the nodes that remain.
        slack: as in `with_newest`.
    """
    return EdgeCoverage.of(*_revised(before.arrays, number, changed, fresh.arrays, union, slack))


@njit(cache=True)
def _with_newest(rows, covered_before, open_before, union, slack):
    """What covers each row after a node was added, and which are open."""
    center, bearing_0, values, marks, corner = union.center, union.bearing_0, union.values, union.marks, union.corner
    known, newest = len(covered_before), len(center) - 1
    covered_by, still_open = np.empty(len(rows), np.int32), np.empty(len(open_before) + len(rows) - known, np.int64)
    covered_by[:known] = covered_before
    n = 0
    for k in open_before:
        if covers(center, bearing_0, values, newest, rows[k, 2], rows[k, 3], slack):
            covered_by[k] = newest
        else:
            still_open[n] = k
            n += 1
    last = -1
    for k in range(known, len(rows)):
        x, y = rows[k, 2], rows[k, 3]
        if last < 0 or not covers(center, bearing_0, values, last, x, y, slack):
            last = newest_cover(center, bearing_0, values, marks, corner, (x, y), slack)
        covered_by[k] = last
        if last < 0:
            still_open[n] = k
            n += 1
    return covered_by, still_open[:n]


@njit(cache=True)
def _revised(before, number, changed, fresh, union, slack):
    """Rows, owners, what covers each row, and which are open, after regions were changed or dropped; as `revised`."""
    center, bearing_0, values, marks, corner = union.center, union.bearing_0, union.values, union.marks, union.corner
    old_owner, new_owner = before[1], fresh[1]
    most, news = len(old_owner) + len(new_owner), np.flatnonzero(changed)[::-1]
    rows, owner = np.empty((most, 4)), np.empty(most, np.int64)
    covered_by, still_open = np.empty(most, np.int32), np.empty(most, np.int64)
    n = m = old_end = new_end = 0
    last = -1
    for old in range(len(number)):
        node, old_begin, new_begin = number[old], old_end, new_end
        while old_end < len(old_owner) and old_owner[old_end] == old:
            old_end += 1
        if node < 0:
            continue
        while new_end < len(new_owner) and new_owner[new_end] == node:
            new_end += 1
        source, begin, end = (fresh, new_begin, new_end) if changed[node] else (before, old_begin, old_end)
        source_rows, source_covered_by = source[0], source[2]
        for k in range(begin, end):
            x, y, by = source_rows[k, 2], source_rows[k, 3], source_covered_by[k]
            new = number[by] if by >= 0 else -1
            if by == UNCOVERED:  # only the changed regions can cover it now
                for other in news:
                    if covers(center, bearing_0, values, other, x, y, slack):
                        by = other
                        break
            elif new >= 0 and not changed[new]:
                by = new
            else:
                by = new if new >= 0 else last  # it probably does
                if by < 0 or not covers(center, bearing_0, values, by, x, y, slack):
                    by = newest_cover(center, bearing_0, values, marks, corner, (x, y), slack)
                last = by
            rows[n, 0], rows[n, 1], rows[n, 2], rows[n, 3] = source_rows[k, 0], source_rows[k, 1], x, y
            owner[n], covered_by[n] = node, by
            if by < 0:
                still_open[m] = n
                m += 1
            n += 1
    return rows[:n], owner[:n], covered_by[:n], still_open[:m]
