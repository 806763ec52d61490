"""Hits near the robot, of the last scans together."""

from typing import NamedTuple

import numpy as np

from drake_starnav.geometry.se2 import transform_points
from drake_starnav.utils.snapshot import snapshot

RECENT_SCANS = 5
"""Number of scans whose hits bound the certified star."""
NO_POINTS = np.zeros((0, 2))


class Hits(NamedTuple):
    """Points on surfaces.

    Attributes:
        points: shape (n, 2), m.
        half_chords: half the chord from each point to its neighbour on the same surface, shape (n,), m.
    """

    points: np.ndarray = NO_POINTS
    half_chords: np.ndarray = np.zeros(0)


@snapshot
class RecentHits:
    """Hits near the robot of the last RECENT_SCANS scans, oldest first. Immutable; W, m.

    Attributes:
        hits: of all scans.
        counts: number of hits of each scan.
    """

    hits: Hits = Hits()
    counts: tuple[int, ...] = ()

    def transformed(self, frame: np.ndarray) -> "RecentHits":
        """Return the hits in another frame, in which the origin of this one is at the pose `frame` (x, y, yaw)."""
        return RecentHits(self.hits._replace(points=transform_points(frame, self.hits.points)), self.counts)

    def forget_oldest(self) -> "RecentHits":
        """Return the hits without those of the oldest scans, so that there is room for one more scan."""
        forgotten = len(self.counts) - (RECENT_SCANS - 1)
        if forgotten <= 0:
            return self
        first, (points, gaps) = sum(self.counts[:forgotten]), self.hits
        return RecentHits(Hits(points[first:], gaps[first:]), self.counts[forgotten:])

    def add_scan(self, hits: Hits) -> "RecentHits":
        """Return these hits and those of one more scan."""
        points, gaps = (np.concatenate(both) for both in zip(self.hits, hits, strict=True))
        return RecentHits(Hits(points, gaps), (*self.counts, len(hits.points)))
