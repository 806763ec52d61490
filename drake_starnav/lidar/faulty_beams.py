"""Beams that err for good, by what they alone hit wherever the robot turns. Pure functions."""

import math

import numpy as np

from drake_starnav.lidar.laser_scan import LaserScan
from drake_starnav.lidar.mounts import Mount, align_with_robot
from drake_starnav.lidar.outlier_filter import NEIGHBOUR_BEAMS, SAME_SURFACE, lose_beams
from drake_starnav.utils.snapshot import snapshot

FEWEST_SCANS, LEAST_TURN, LEAST_WAY = 20, 0.5, 0.1
"""A beam errs that alone hits something in so many successive scans, in which the lidar turns by the second, rad, and
the hit moves by the third, m: a thing that is so thin would stay where it is, or be hit by another beam."""


@snapshot
class FaultyBeams:
    """Which beams of a lidar err, and since when each has hit something alone. Immutable.

    Attributes:
        faulty: whether a beam errs, shape (n,).
        scans: in how many successive scans a beam has hit something nearer than all that the beams beside it see,
            shape (n,); scans in which it was lost do not count.
        places, yaws: its hit in the first of these, shape (n, 2), and the lidar's yaw then, shape (n,), m and rad.
    """

    faulty: np.ndarray
    scans: np.ndarray
    places: np.ndarray
    yaws: np.ndarray

    @staticmethod
    def none(count: int = 0) -> "FaultyBeams":
        """Return what is known of so many beams before their first scan."""
        return FaultyBeams(np.zeros(count, bool), np.zeros(count, int), np.zeros((count, 2)), np.zeros(count))

    def after(self, scan: LaserScan, pose: np.ndarray, mount: Mount) -> tuple["FaultyBeams", LaserScan]:
        """Return the state after a scan, and the scan in which lone hits of faulty beams are lost.

        Args:
            scan: in the sensor frame; if it has another number of beams than the last one, nothing is known of them.
            pose: (x, y, yaw) of the robot by its odometry when the scan was taken, m and rad.
            mount: of the lidar.
        """
        count, yaw = len(scan.ranges), float(pose[2])
        known_state = self if len(self.scans) == count else FaultyBeams.none(count)
        is_lone = _find_lone_hits(scan)
        lone_counts = np.where(is_lone, known_state.scans + 1, np.where(np.isnan(scan.ranges), known_state.scans, 0))
        beam_order = slice(None, None, -1 if mount.upside_down else 1)
        ranges, every_beam = np.where(is_lone, scan.ranges, 0.0)[beam_order], np.ones(count, bool)
        hits = align_with_robot(scan, mount).points_at(ranges, every_beam, mount.find_lidar_pose(pose))[beam_order]
        places = np.where((lone_counts == 1)[:, None], hits, known_state.places)
        yaws = np.where(lone_counts == 1, yaw, known_state.yaws)
        moved_distance = np.hypot(*(hits - places).T)
        turned_angle = np.abs((yaw - yaws + math.pi) % (2.0 * math.pi) - math.pi)
        errs = is_lone & (lone_counts >= FEWEST_SCANS) & (turned_angle >= LEAST_TURN) & (moved_distance >= LEAST_WAY)
        next_state = FaultyBeams(known_state.faulty | errs, lone_counts, places, yaws)
        return next_state, lose_beams(scan, np.flatnonzero(next_state.faulty & is_lone))


def _find_lone_hits(scan: LaserScan) -> np.ndarray:
    """Return which beams hit something nearer than all that NEIGHBOUR_BEAMS to each side see, shape (n,)."""
    ranges = np.pad(
        np.where(np.isnan(scan.ranges), math.inf, scan.ranges),
        NEIGHBOUR_BEAMS,
        **({"mode": "wrap"} if scan.full_circle else {"constant_values": math.inf}),
    )
    windows = np.lib.stride_tricks.sliding_window_view(ranges, 2 * NEIGHBOUR_BEAMS + 1)
    nearest_neighbour = np.delete(windows, NEIGHBOUR_BEAMS, axis=1).min(axis=1)
    return scan.ranges + SAME_SURFACE < nearest_neighbour
