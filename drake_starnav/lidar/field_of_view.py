"""The bearings that a planar lidar measures, and the one place that says whether they are all around."""

import math
from collections.abc import Iterable
from typing import Any, NamedTuple

import numpy as np

from drake_starnav.errors import StarnavError, shown

TURN = 2.0 * math.pi
ROUNDING = 1e-4
"""Error of a turn that is given in single precision or to four decimals, rad."""
SEAM = math.radians(0.6)
"""A lidar looks all around if the gap from its last beam on to its first is wider than that between any other two by at
most this, rad: drivers round, give both ends of the turn, or stop half a degree short of it."""


class FieldOfView(NamedTuple):
    """Beams at equal steps, counter-clockwise: bearing of the first in the sensor frame S, the step, positive, rad, and
    their number."""

    angle_min: float
    angle_increment: float
    beams: int

    @property
    def span(self) -> float:
        """Angle from the first beam to the last, rad."""
        return self.angle_increment * (self.beams - 1)

    @property
    def angle_max(self) -> float:
        """Bearing of the last beam, rad."""
        return self.angle_min + self.span

    @property
    def seam(self) -> float:
        """Angle from the last beam on to its neighbour, the first, rad; infinite if they are no neighbours."""
        gap = TURN - self.span
        if abs(gap - self.angle_increment) < 1e-6:
            return self.angle_increment  # the turn is divided evenly
        return max(gap, 0.0) if gap <= self.angle_increment + SEAM else math.inf

    @property
    def full_circle(self) -> bool:
        """Whether the last beam's neighbour is the first one, wherever the seam between them lies."""
        return self.seam < math.inf

    @property
    def widest_gap(self) -> float:
        """Largest angle between two neighbouring beams, rad."""
        return max(self.angle_increment, self.seam) if self.full_circle else self.angle_increment

    def looks_at(self, bearings: np.ndarray) -> np.ndarray:
        """Whether bearings, rad, lie between its first and last beam, of the same shape."""
        return np.mod(bearings - self.angle_min, TURN) <= (TURN if self.full_circle else self.span)

    def within(self, sectors: Iterable[tuple[float, float]]) -> np.ndarray:
        """Which beams lie in sectors as of `read_sectors`, shape (beams,), bool."""
        bearings = self.angle_min + self.angle_increment * np.arange(self.beams)
        return np.any([np.mod(bearings - first, TURN) <= width for first, width in sectors], axis=0)


def read_sectors(given: Iterable[Any], name: str) -> list[tuple[float, float]]:
    """First bearing in S and width of sectors, rad, of pairs of bearings: from one counter-clockwise to the other.

    Raises a `StarnavError` that calls them by `name` if they are no such pairs.
    """
    sectors = []
    for pair in given:
        try:
            first, last = map(float, pair)
        except (TypeError, ValueError):
            first = last = math.nan
        if not (math.isfinite(first) and math.isfinite(last)):
            raise StarnavError(f"{name} has the sector {shown(pair)}; allowed: [first, last], finite bearings, rad")
        sectors.append((first, min(last - first, TURN) if last >= first else (last - first) % TURN))
    return sectors
