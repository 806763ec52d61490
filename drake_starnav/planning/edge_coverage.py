"""Which regions cover the edge frontiers of which nodes: a revision looks only at those whose region has changed."""

from collections.abc import Sequence
from typing import NamedTuple

import numpy as np

from drake_starnav.planning.frontiers import Frontiers, uncovered
from drake_starnav.planning.region_index import IndexedRegions, selection, some_near

UNCOVERED, UNKNOWN = -1, -2


class EdgeCoverage(NamedTuple):
    """The edge frontiers of all nodes, and for each a region that covers its probe. Immutable.

    Attributes:
        rows: per node, shape (n, 4): stand and probe, W, m.
        covered_by: shape (N,), of all nodes in turn, the index of another region that covers the probe, or UNCOVERED.
        open: shape (m,), indices into `covered_by` of those that no region covers.
        open_rows: shape (m, 4), their rows.
    """

    rows: tuple[np.ndarray, ...] = ()
    covered_by: np.ndarray = np.zeros(0, np.int32)
    open: np.ndarray = np.zeros(0, np.int64)
    open_rows: np.ndarray = np.zeros((0, 4))

    @property
    def frontiers(self) -> Frontiers:
        """Those that no region covers."""
        starts = np.cumsum([len(rows) for rows in self.rows])
        owner = np.searchsorted(starts, self.open, side="right")
        return Frontiers(self.open_rows[:, :2].copy(), self.open_rows[:, 2:].copy(), owner)

    @property
    def newest_frontiers(self) -> Frontiers:
        """Those of the newest node that no region covers."""
        newest = len(self.rows) - 1
        rows = self.open_rows[np.searchsorted(self.open, len(self.covered_by) - len(self.rows[newest])) :]
        return Frontiers(rows[:, :2].copy(), rows[:, 2:].copy(), np.full(len(rows), newest))


def with_newest(before: EdgeCoverage, rows: np.ndarray, regions: IndexedRegions, slack: float) -> EdgeCoverage:
    """The coverage after a node was added.

    Args:
        before: of the older nodes.
        rows: of the new node.
        regions: all, with the new one.
        slack: probes up to this far beyond a region's boundary count as covered, m.
    """
    newest = len(regions.reach) - 1
    alone = tuple(array[newest:] for array in regions[:4])
    still = uncovered(before.open_rows[:, 2:], alone, slack=slack)
    by = some_near(regions, rows[:, 2:], slack, np.full(len(rows), newest), regions.every)
    covered_by = np.concatenate((before.covered_by, by))
    covered_by[before.open[~still]] = newest
    return EdgeCoverage(
        (*before.rows, rows),
        covered_by,
        np.concatenate((before.open[still], len(before.covered_by) + np.flatnonzero(by < 0))),
        np.vstack((before.open_rows[still], rows[by < 0])),
    )


def revised(
    before: EdgeCoverage,
    kept: np.ndarray,
    changed: np.ndarray,
    fresh: Sequence[np.ndarray],
    regions: IndexedRegions,
    slack: float,
) -> EdgeCoverage:
    """The coverage after regions were changed or dropped.

    Args:
        before: of all nodes.
        kept: shape (n,), indices of the nodes that remain.
        changed: shape (n,), whether the region of such a node has changed.
        fresh: rows of the changed nodes.
        regions: of the nodes that remain.
        slack: as in `with_newest`.
    """
    counts = np.array([len(rows) for rows in before.rows])
    starts = np.concatenate(([0], np.cumsum(counts)))
    number = np.full(len(counts) + 1, UNKNOWN, np.int32)  # the last is of UNCOVERED
    number[kept[~changed]] = np.flatnonzero(~changed)
    number[-1] = UNCOVERED
    known = number[before.covered_by]
    rows, parts, ahead = [], [], iter(fresh)
    for old, new in zip(kept.tolist(), changed.tolist(), strict=True):
        rows.append(next(ahead) if new else before.rows[old])
        parts.append(np.full(len(rows[-1]), UNKNOWN, np.int32) if new else known[starts[old] : starts[old + 1]])
    covered_by = np.concatenate(parts) if parts else np.zeros(0, np.int32)
    pending = np.flatnonzero(covered_by < 0)
    first = np.concatenate(([0], np.cumsum([len(each) for each in rows])))
    node = np.searchsorted(first[1:], pending, side="right")
    places = np.concatenate(rows)[pending] if rows else np.zeros((0, 4))
    unknown = covered_by[pending] == UNKNOWN  # what was uncovered is compared with the changed regions alone
    for members, among in ((unknown, regions.every), (~unknown, selection(changed))):
        points, own = places[members, 2:], node[members]
        covered_by[pending[members]] = some_near(regions, points, slack, own, among)
    still = covered_by[pending] < 0
    return EdgeCoverage(tuple(rows), covered_by, pending[still], places[still])
