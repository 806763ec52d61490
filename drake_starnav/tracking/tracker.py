"""From one scan to the next: static obstacles, moving ones, and their motion."""

import dataclasses
from dataclasses import field
from typing import NamedTuple

import numpy as np

from drake_starnav.lidar.deskew import deskewed
from drake_starnav.lidar.laser_scan import DYNAMIC, STATIC, LaserScan
from drake_starnav.tracking.kalman_tracks import Judged, Tracks, updated
from drake_starnav.tracking.occupancy_history import OccupancyHistory
from drake_starnav.tracking.parameters import DynamicObstacleParameters
from drake_starnav.tracking.prediction import PREDICTED, predicted_trajectories
from drake_starnav.tracking.surfaces import on_large_surfaces
from drake_starnav.utils.snapshot import snapshot

_BLIND = LaserScan(0.0, -1.0, 1.0, 0.0, 1.0, np.full(3, np.nan), lost_beams=True)
"""A scan of lost beams only, which carries no information."""


class TrackedObstacles(NamedTuple):
    """The moving obstacles as of the last scan.

    Attributes:
        tracks: of the last scan.
        age: time since that scan, s.
        parameters: what is declared about moving obstacles.
    """

    tracks: Tracks
    age: float
    parameters: DynamicObstacleParameters


@snapshot
class Tracked:
    """The tracker's state after a scan: the latest, de-skewed, with the motion of each hit, and the pose of S in W.
    Immutable.

    The grid, of when the cells around the robot were hit and seen free, is None before the first scan.
    """

    grid: OccupancyHistory | None = None
    tracks: Tracks = field(default_factory=Tracks)
    scan: LaserScan = _BLIND
    pose: np.ndarray = field(default_factory=lambda: np.zeros(3))


def track(
    before: Tracked,
    scan: LaserScan,
    pose: np.ndarray,
    parameters: DynamicObstacleParameters,
    range_deviation: float = 0.0,
) -> Tracked:
    """The state after one more scan.

    Args:
        before: the state until then; it is not changed.
        scan: the latest, in the sensor frame S; a rolling one is de-skewed.
        pose: (x, y, yaw) of S in W when it was taken.
        range_deviation: declared standard deviation of the range error, m.
    """
    if scan.time_increment and before.grid is not None:
        scan = deskewed(scan, before.pose, before.scan.time, pose)
    grid = before.grid or OccupancyHistory.about(pose[:2])
    motion, came = grid.classified(scan, pose, parameters)
    large = on_large_surfaces(scan, 2.0 * parameters.max_radius, range_deviation)
    may_start = grid.may_start(scan, pose, large)
    tracks, reported = updated(before.tracks, scan, Judged(motion, came, may_start), pose, parameters)
    reach = tracks.radius + np.hypot(*tracks.expected_velocity.T) * PREDICTED
    standing = scan.points_at(scan.distances, scan.hits & (motion == STATIC), pose)
    walls = np.vstack((grid.walls(scan.time, tracks.position, reach), standing))
    ways = predicted_trajectories(tracks.position, tracks.expected_velocity, tracks.radius, walls)
    tracks = dataclasses.replace(tracks, predicted_trajectories=ways)
    scan = dataclasses.replace(scan, motion=reported)
    return Tracked(grid.updated(scan, pose, large & (motion != DYNAMIC)), tracks, scan, pose)
