"""From one scan to the next: static obstacles, moving ones, and their motion."""

import dataclasses
from dataclasses import field

import numpy as np

from drake_starnav.lidar.deskew import taken_at_once
from drake_starnav.lidar.laser_scan import MOVES, STAYS, LaserScan
from drake_starnav.tracking.kalman_tracks import Tracks, updated
from drake_starnav.tracking.occupancy_history import MotionGrid
from drake_starnav.tracking.parameters import MoverParameters
from drake_starnav.tracking.surfaces import on_large_surfaces
from drake_starnav.utils.snapshot import snapshot

_BLIND = LaserScan(0.0, -1.0, 1.0, 0.0, 1.0, np.full(3, np.nan), lost_beams=True)
"""A scan of lost beams only, which carries no information."""


@snapshot
class Tracked:
    """The tracker's state after a scan. Immutable.

    Attributes:
        grid: when the cells around the robot were hit and seen free; None before the first scan.
        tracks: the moving obstacles.
        scan: the latest, de-skewed, with the motion state of each hit.
        pose: (x, y, yaw) of the sensor frame S in W when it was taken, m and rad.
    """

    grid: MotionGrid | None = None
    tracks: Tracks = field(default_factory=Tracks)
    scan: LaserScan = _BLIND
    pose: np.ndarray = field(default_factory=lambda: np.zeros(3))


def track(before: Tracked, scan: LaserScan, pose: np.ndarray, parameters: MoverParameters) -> Tracked:
    """The state after one more scan.

    Args:
        before: the state until then; it is not changed.
        scan: the latest, in the sensor frame S; a rolling one is de-skewed.
        pose: (x, y, yaw) of S in W when it was taken.
        parameters: of the tracker.
    """
    if scan.time_increment > 0.0 and before.grid is not None:
        scan = taken_at_once(scan, before.pose, before.scan.time, pose)
    grid = before.grid or MotionGrid.about(pose[:2], parameters.cell)
    motion = grid.told(scan, pose, parameters)
    large = on_large_surfaces(scan, 2.0 * parameters.max_radius)
    may_start = grid.may_start(scan, pose, large) & parameters.guarded
    walls = np.vstack((grid.walls(scan.time), scan.points_at(scan.distances, scan.hits & (motion == STAYS), pose)))
    tracks = updated(before.tracks, scan, motion, may_start, pose, parameters, walls)
    told = motion.copy()
    told[np.flatnonzero(motion != STAYS)[(tracks.owner >= 0) & _counted(tracks)]] = MOVES
    return Tracked(
        grid.updated(scan, pose, large & (motion != MOVES)), tracks, dataclasses.replace(scan, motion=told), pose
    )


def _counted(tracks: Tracks) -> np.ndarray:
    """Which of the hits belong to tracks that count."""
    return tracks.counted[tracks.owner] if len(tracks) else np.zeros(len(tracks.owner), bool)
