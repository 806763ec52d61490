"""A scan with its pose and its region."""

import numpy as np

from drake_starnav.geometry.se2 import composed
from drake_starnav.lidar.laser_scan import LaserScan
from drake_starnav.regions.star_region import StarRegion
from drake_starnav.utils.snapshot import snapshot


@snapshot
class Observation:
    """One scan as the planner receives it. Immutable.

    Attributes:
        region: star-shaped region of the scan, W; None before the first scan.
        scan: in S.
        pose: (x, y, yaw) of S in W when the scan was taken.
    """

    region: StarRegion | None
    scan: LaserScan
    pose: np.ndarray

    @staticmethod
    def none() -> "Observation":
        """The observation before the first scan."""
        return Observation(None, LaserScan.nothing(), np.zeros(3))

    def moved(self, frame: np.ndarray) -> "Observation":
        """The same observation in another frame, in which this one's origin is at the pose `frame` (x, y, yaw)."""
        region = None if self.region is None else self.region.moved(frame)
        return Observation(region, self.scan, composed(frame, self.pose))
