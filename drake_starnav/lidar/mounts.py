"""Where a lidar is on its robot, and its scans in a frame that is parallel to the robot's."""

import dataclasses
import math
from collections.abc import Sequence
from typing import NamedTuple

import numpy as np

from drake_starnav.geometry.se2 import compose_poses
from drake_starnav.lidar.field_of_view import TURN, FieldOfView
from drake_starnav.lidar.laser_scan import LaserScan


class Mount(NamedTuple):
    """Pose of a sensor frame S in the robot's frame B, whose z axis is the one about which the robot turns.

    Attributes:
        x, y: m.
        yaw: bearing of S's x axis in B, rad.
        upside_down: whether S's z axis points down, so that bearings in S turn clockwise in B.
        tilt: between S's z axis and B's, up or down, rad; so small that its scans count as those of a level lidar, at
            the cost of a margin.
    """

    x: float
    y: float
    yaw: float
    upside_down: bool
    tilt: float = 0.0

    @property
    def offset(self) -> float:
        """Distance from the robot's axis, m."""
        return math.hypot(self.x, self.y)

    def find_lidar_pose(self, pose: np.ndarray) -> np.ndarray:
        """Pose of the lidar parallel to the robot, shape (3,), for the pose (x, y, yaw) of the robot, m and rad."""
        return compose_poses(pose, (self.x, self.y, 0.0)) if self.offset > 0.0 else pose

    def view(self, view: FieldOfView) -> FieldOfView:
        """The beams of a field of view in S, in a frame parallel to B."""
        if not (self.yaw or self.upside_down):
            return view
        first_bearing = self.yaw - view.angle_max if self.upside_down else self.yaw + view.angle_min
        return view._replace(angle_min=math.remainder(first_bearing, TURN))


def find_newest(scans: Sequence[LaserScan]) -> float:
    """Time of the newest of some scans that measured anything, s; -inf if there is none."""
    return max([scan.measured_at for scan in scans])


ON_AXIS = Mount(0.0, 0.0, 0.0, False)
"""On the robot's axis, unturned."""


def align_with_robot(scan: LaserScan, mount: Mount) -> LaserScan:
    """The scan in a frame at the lidar's place that is parallel to the robot's; the same object where S is."""
    if not (mount.yaw or mount.upside_down):
        return scan
    changed_fields: dict = {"angle_min": mount.view(scan.field_of_view).angle_min}
    if mount.upside_down:
        changed_fields |= {"ranges": scan.ranges[::-1], "time_increment": -scan.time_increment}
        changed_fields["motion"] = None if scan.motion is None else scan.motion[::-1].copy()
    return dataclasses.replace(scan, **changed_fields)
