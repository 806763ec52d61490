"""The interface from any planner to the controller."""

from collections.abc import Sequence
from dataclasses import field

import numpy as np

from drake_starnav.errors import StarnavError
from drake_starnav.geometry.se2 import transform_points
from drake_starnav.surroundings.region_union import RegionUnion
from drake_starnav.surroundings.star_region import StarRegion, unite_regions
from drake_starnav.utils.snapshot import snapshot

PASSED_DISTANCE = 0.24
"""A waypoint this near has been passed, in radii of the robot."""


@snapshot
class Guidance:
    """A planner's output for the controller. Immutable; W, m.

    Attributes:
        path: shape (k, 2), waypoints ahead; the first is the short-term goal. Empty: stop.
        arrives: whether the last waypoint is the goal, at which the robot stops.
        regions: star-shaped regions of the roadmap, for the modulation.
        poses: shape (k, 4), of a manoeuvre to drive instead of following the path: x, y, yaw in W, and the gear: 0
            turns on the spot, 1 drives forwards, -1 backwards.
    """

    path: np.ndarray
    arrives: bool
    regions: RegionUnion
    poses: np.ndarray = field(default_factory=lambda: np.zeros((0, 4)))

    @staticmethod
    def none() -> "Guidance":
        """Return guidance that stops the robot."""
        return Guidance(np.zeros((0, 2)), False, RegionUnion.none())

    @staticmethod
    def along(path: np.ndarray, regions: Sequence[StarRegion] = ()) -> "Guidance":
        """Return guidance along a path from another planner, to stop at its end.

        Args:
            path: shape (k, 2), waypoints ahead, W, m.
            regions: regions around the robot, for the modulation; without them it drives straight to the next waypoint.

        Raises:
            StarnavError: the path has another shape or is not finite.
        """
        way = np.array(path, dtype=float)
        if way.size == 0:
            way = np.zeros((0, 2))
        if way.ndim != 2 or way.shape[1] != 2 or not np.isfinite(way).all():
            raise StarnavError(f"guidance: path has shape {way.shape}; allowed: (k, 2), finite x and y")
        return Guidance(way, True, unite_regions(regions))

    def transformed(self, frame: np.ndarray) -> "Guidance":
        """Return the same guidance in another frame, in which this one's origin is at the pose `frame` (x, y, yaw)."""
        poses = np.column_stack((transform_points(frame, self.poses), self.poses[:, 2] + frame[2], self.poses[:, 3]))
        return Guidance(transform_points(frame, self.path), self.arrives, self.regions.transformed(frame), poses)
