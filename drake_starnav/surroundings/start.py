"""The free disc in which a robot begins: what it must take for free, as no look has seen it."""

import math
from functools import cached_property

import numpy as np

from drake_starnav.geometry.footprint import Footprint
from drake_starnav.lidar.field_of_view import TURN
from drake_starnav.lidar.laser_scan import Beams, LaserScan
from drake_starnav.surroundings.chords import BINS, Chords, profile
from drake_starnav.utils.snapshot import snapshot

RIM = 24
"""Corners of the polygon around a disc."""


@snapshot
class Start:
    """The disc about a robot's first place within which nothing is assumed to stand but what is seen there.

    Attributes:
        free: as of `Look`, shape (BINS,), m.
    """

    free: np.ndarray

    @staticmethod
    def of(radius: float) -> "Start":
        """Of a radius, m."""
        return Start(np.full(BINS, radius))

    @cached_property
    def beams(self) -> Beams:
        """It as what a lidar saw that hit nothing."""
        far, lost = float(self.free.max()), np.full(BINS, math.nan)
        return LaserScan(0.0, 0.0, TURN / BINS, 0.0, max(far, 1e-9), lost, lost_beams=True, free=self.free).beams

    def cut(self, place: tuple[float, float, float], seen: Chords) -> "Start":
        """It, about a place (x, y, yaw) in W, without what lies at or behind the surfaces of some chords."""
        return Start(np.minimum(self.free, profile(seen.ends[seen.solid], place, float(self.free.max()))))


def start_radius(footprint: Footprint, margin: float, offset: float) -> float:
    """Radius of the disc, m: in it a robot turns, and then drives off until a lidar sees what is beside it.

    Args:
        footprint: of the robot.
        margin: kept around it, m.
        offset: of the lidar ahead of its axis, m: it may see nothing farther back.
    """
    sides = [float(np.abs(part[:, 1]).max()) for part in footprint.parts]
    beside = (max(sides, default=footprint.radius) + margin) / math.cos(0.5 * TURN / RIM)
    ahead = offset + 2.0 * TURN / BINS * beside  # a view counts by whole bins
    return max(footprint.radius + margin, math.hypot(beside, ahead))
