"""Odometry held against scans: how far a robot has come by each of them. Pure functions.

A scan is aligned with one from about a radius before, and the odometry is hardly trusted meanwhile. So short a step is
seen to some hundredths, and errors of which the odometry has more in every step add up. Where scans do not tell how far
a robot has come, as along a bare corridor, the odometry is believed.
"""

import dataclasses
import math
from typing import NamedTuple

import numpy as np

from drake_starnav.geometry.se2 import compose_poses, find_pose_in_frame
from drake_starnav.lidar.deskew import deskew_scan
from drake_starnav.lidar.laser_scan import LaserScan
from drake_starnav.lidar.mounts import ON_AXIS, Mount, align_with_robot
from drake_starnav.localization.scan_matching import GOOD_SHARE, Keyframe, OdometryError, Travel, align_pose
from drake_starnav.utils.snapshot import snapshot

STEP_WAY, STEP_TURN = 1.0, 0.3
"""Two scans are compared when the robot has driven the first in between, in cover radii, or turned the second, rad."""
STEP_DEVIATION = 0.5
"""Standard deviation of the odometry within a step, as a share of it."""
LEAST_DEVIATION = 0.01
"""That of a step of no length or turn, m and rad."""
FEWEST_HITS = 20
"""Hits that a scan needs to be compared."""
KEPT_STEPS = 5
"""So many last steps are kept."""


class SeenStep(NamedTuple):
    """The times of two scans, s, and a robot's motions between them by the odometry and by the scans, each (ahead,
    aside, turned) from where it was at the first, m and rad."""

    begin: float
    end: float
    driven_motion: np.ndarray
    seen_motion: np.ndarray


class Difference(NamedTuple):
    """What some steps come to by the odometry and by the scans: ways, m, and angles, whatever their sign, rad.

    An error is that between the two sums of motions; or, if it is more, that between the sums of motions each in its
    own direction: a share of ways there and back adds up in it. The time is from the first scan to the last, s.
    """

    driven_way: float
    seen_way: float
    driven_turn: float
    seen_turn: float
    way_error: float
    turn_error: float
    time: float


@snapshot
class OdometryCheck:
    """The scan that the next ones are compared with, and the last steps, oldest first. Immutable.

    Attributes:
        keyframe: that scan, at its pose by the odometry; None: nothing was seen yet.
        latest: when the last scan was taken, s, and the pose of the sensor by the odometry.
        steps: KEPT_STEPS at most.
    """

    keyframe: Keyframe | None = None
    latest: tuple[float, np.ndarray] = (-math.inf, np.zeros(3))
    steps: tuple[SeenStep, ...] = ()

    def add_scan(
        self, scan: LaserScan, pose: np.ndarray, error: OdometryError, mount: Mount = ON_AXIS
    ) -> "OdometryCheck":
        """Return the check after a scan; of `error` only noise and body count.

        Args:
            scan: in the sensor frame.
            pose: (x, y, yaw) of the robot by its odometry when it was taken, m and rad.
            error: what is declared of the lidar, and the robot's radius.
            mount: of the lidar.
        """
        scan, sensor_pose = align_with_robot(scan, mount), mount.find_lidar_pose(pose)
        (time, earlier), key = self.latest, self.keyframe
        next_check = dataclasses.replace(self, latest=(scan.time, sensor_pose))
        driven_step = np.zeros(3) if key is None else np.array(find_pose_in_frame(key.pose, sensor_pose))
        has_moved = (
            math.hypot(driven_step[0], driven_step[1]) >= STEP_WAY * error.body or abs(driven_step[2]) >= STEP_TURN
        )
        if np.count_nonzero(scan.mappable_hits) < FEWEST_HITS or not (key is None or has_moved):
            return next_check
        if scan.time_increment and time > -math.inf:
            scan = deskew_scan(scan, earlier, time, sensor_pose)
        seen_step = None if key is None else _match_step(key, scan, driven_step, error)
        steps = (
            () if key is None or seen_step is None else (SeenStep(key.scan.time, scan.time, driven_step, seen_step),)
        )
        keyframe = Keyframe.of(scan, sensor_pose, Travel(sensor_pose), error)
        return dataclasses.replace(next_check, keyframe=keyframe, steps=(*self.steps, *steps)[-KEPT_STEPS:])

    def sum_differences(self) -> Difference:
        """Return what the kept steps come to, of which there must be one."""
        driven_steps = np.array([step.driven_motion for step in self.steps])
        seen_steps = np.array([step.seen_motion for step in self.steps])
        driven_ways, seen_ways = (steps[:, 0] + 1j * steps[:, 1] for steps in (driven_steps, seen_steps))
        way_errors, turn_errors = seen_ways - driven_ways, (seen_steps - driven_steps)[:, 2]
        # as seen in the direction of each step
        there_and_back = way_errors * np.conj(driven_ways) / np.maximum(np.abs(driven_ways), 1e-9)
        return Difference(
            driven_way=float(np.abs(driven_ways).sum()),
            seen_way=float(np.hypot(seen_steps[:, 0], seen_steps[:, 1]).sum()),
            driven_turn=float(np.abs(driven_steps[:, 2]).sum()),
            seen_turn=float(np.abs(seen_steps[:, 2]).sum()),
            way_error=float(max(abs(way_errors.sum()), abs(there_and_back.sum()))),
            turn_error=float(max(abs(turn_errors.sum()), abs((turn_errors * np.sign(driven_steps[:, 2])).sum()))),
            time=self.steps[-1].end - self.steps[0].begin,
        )


def _match_step(keyframe: Keyframe, scan: LaserScan, step: np.ndarray, error: OdometryError) -> np.ndarray | None:
    """Return how far the sensor came since a keyframe by its scan, as of `SeenStep`; None if that does not fit."""
    points = scan.points_at(scan.distances, scan.mappable_hits, (0.0, 0.0, 0.0))
    way_deviation, turn_deviation = STEP_DEVIATION * math.hypot(step[0], step[1]), STEP_DEVIATION * abs(step[2])
    deviation = np.array((way_deviation, way_deviation, turn_deviation)) + LEAST_DEVIATION
    pose, share = align_pose(keyframe, points, compose_poses(keyframe.pose, step), deviation, error)
    return np.array(find_pose_in_frame(keyframe.pose, pose)) if share >= GOOD_SHARE else None
