"""The free disc in which a robot begins: what it must take for free, as no look has seen it."""

import math
from functools import cached_property

import numpy as np

from drake_starnav.lidar.field_of_view import TURN
from drake_starnav.lidar.laser_scan import Beams, LaserScan
from drake_starnav.surroundings.chords import BINS, Chords, profile
from drake_starnav.utils.snapshot import snapshot


@snapshot
class Start:
    """The disc about a robot's first place within which nothing is assumed to stand but what is seen there.

    Attributes:
        free: as of `Look`, shape (BINS,), m.
    """

    free: np.ndarray

    @staticmethod
    def of(radius: float) -> "Start":
        """A start disc of this radius, m."""
        return Start(np.full(BINS, radius))

    @cached_property
    def beams(self) -> Beams:
        """The disc as the beams of a lidar that hit nothing."""
        far, lost = float(self.free.max()), np.full(BINS, math.nan)
        return LaserScan(0.0, 0.0, TURN / BINS, 0.0, max(far, 1e-9), lost, lost_beams=True, free=self.free).beams

    def cut(self, place: tuple[float, float, float], seen: Chords) -> "Start":
        """The disc about a place (x, y, yaw) in W, without what lies at or behind the surfaces among some chords."""
        return Start(np.minimum(self.free, profile(seen.ends[seen.solid], place, float(self.free.max()))))
