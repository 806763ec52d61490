"""A scan with its pose and its region."""

import dataclasses
import math
from dataclasses import field

import numpy as np

from drake_starnav.geometry.se2 import compose_poses, transform_points
from drake_starnav.lidar.laser_scan import LaserScan
from drake_starnav.surroundings.margins import Margins
from drake_starnav.surroundings.star_region import StarRegion, clear_region, make_scan_region
from drake_starnav.utils.snapshot import snapshot


@snapshot
class Observation:
    """One scan as the planner receives it. Immutable.

    Attributes:
        region: star-shaped region of the scan, W; None before the first scan.
        scan: polar image of all lidars about the robot's axis, in B.
        pose: (x, y, yaw) of B in W when the scan was taken.
        past_hits: of earlier scans near the robot where this one did not look, shape (k, 2), W, m; they bound the
            region, too.
    """

    region: StarRegion | None
    scan: LaserScan
    pose: np.ndarray
    past_hits: np.ndarray = field(default_factory=lambda: np.zeros((0, 2)))

    @staticmethod
    def none() -> "Observation":
        """Return the observation before the first scan."""
        return Observation(None, LaserScan.nothing(), np.zeros(3))

    @property
    def time(self) -> float:
        """When the scan was taken, s; -inf before the first."""
        return -math.inf if self.region is None else self.scan.time

    def refit(self, radius: float, margins: Margins) -> "Observation":
        """Return the same observation with the region of a robot of another radius (m) or with other margins."""
        samples = 0 if self.region is None else len(self.region.free_range)
        region = make_scan_region(self.scan, self.pose, radius, margins, samples)
        return Observation(region, self.scan, self.pose).cut_back_to_hits(self.past_hits, radius)

    def cut_back_to_hits(self, past_hits: np.ndarray, radius: float) -> "Observation":
        """Return the observation with its region cut back to past hits (k, 2), W, for a robot's radius, m."""
        region = None if self.region is None else clear_region(self.region, past_hits, radius)
        return dataclasses.replace(self, region=region, past_hits=past_hits)

    def transformed(self, frame: np.ndarray) -> "Observation":
        """Return the observation in another frame, in which this one's origin is at the pose `frame` (x, y, yaw)."""
        region = None if self.region is None else self.region.transformed(frame)
        return Observation(region, self.scan, compose_poses(frame, self.pose), transform_points(frame, self.past_hits))
