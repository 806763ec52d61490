"""The safety star: positions of the robot's centre that are free according to the last few scans.

The hits are used as measured. If the declared noise makes the nearest hit too unreliable, they are smoothed or averaged
first.
"""

import math
from dataclasses import field

import numpy as np

from drake_starnav.lidar.laser_scan import LaserScan
from drake_starnav.regions.bearing_hits import CONNECTED_CHORD, half_gaps, point_hits
from drake_starnav.regions.erosion import bearing_count, eroded_range, free_limit, sight_limit
from drake_starnav.regions.parameters import StarParameters
from drake_starnav.utils.snapshot import snapshot

NEAR_HIT_RANGE = 1.0
"""Hits nearer than this enter the near-wall term, m."""
BLIND_SIDE = math.radians(60.0)
"""No motion is certified towards bearings nearer than this to an edge of the field of view: there, the disc would sweep
unobserved space by more than 0.155 of its radius from where it stood."""
NEAREST = 0.001
"""A hit that is too close to be measured is placed at this distance along its beam, to give it a direction, m."""


@snapshot
class SafetyStar:
    """A star-shaped set of positions of the robot's centre that the last scans certify. Immutable; W, m.

    At every point inside, and along the straight segment from the centre to it, the distance to all hits exceeds the
    robot's radius plus the safety margin.

    Attributes:
        center: where the last scan was taken, shape (2,).
        bearing_0: bearing of sample 0, rad.
        values: shape (M,), boundary distance at the samples; between two samples the smaller one counts.
        near_hits: shape (k, 2), the planner's smoothed hits close to the robot.
        hits: shape (n, 2), all hits of the remembered scans, as used by the certificate.
        half_gaps: shape (n,), half the chord from each hit to its neighbour on the same surface, m.
        seen: whether `hits` come from scans; if not, they certify no motion.
        time: when the last scan was taken, s.
        reach: `hits` is complete for the last scan within this distance of `center`, m; farther hits are unknown.
        previous: when the scan before the last was taken, s; its pose also serves to de-skew a rolling scan.
    """

    center: np.ndarray
    bearing_0: float
    values: np.ndarray
    near_hits: np.ndarray
    hits: np.ndarray = field(default_factory=lambda: np.zeros((0, 2)))
    half_gaps: np.ndarray = field(default_factory=lambda: np.zeros(0))
    seen: bool = False
    time: float = -math.inf
    reach: float = math.inf
    previous: float = -math.inf

    @staticmethod
    def none() -> "SafetyStar":
        """Before any scan: no motion can be certified."""
        return SafetyStar(np.zeros(2), 0.0, np.zeros(4), np.zeros((0, 2)))


@snapshot
class ScanMemory:
    """The hits of the last scans near the robot, oldest first. Immutable.

    Attributes:
        points: per scan, shape (n, 2), W, m.
        half_gaps: per scan, shape (n,), half the chord to the neighbouring hit on the same surface, m.
        reach: all hits of the last scan within this distance are kept, m.
    """

    points: tuple[np.ndarray, ...] = ()
    half_gaps: tuple[np.ndarray, ...] = ()
    reach: float = math.inf

    def remembered(self, scan: LaserScan, pose: np.ndarray, reach: float, count: int) -> "ScanMemory":
        """The memory with one more scan and at most `count` scans.

        Args:
            scan: the latest, in S.
            pose: (x, y, yaw) of S in W when it was taken.
            reach: farther hits are dropped, m.
            count: number of scans to keep.
        """
        distance = scan.distances
        gap = half_gaps(scan, distance)
        reach = min(reach, scan.range_max)
        near = (distance < reach) & scan.hits
        points = scan.points_at(np.maximum(distance, NEAREST), near, pose)
        kept = slice(max(len(self.points) - max(count - 1, 0), 0), None)
        return ScanMemory(
            (*self.points[kept], points),
            (*self.half_gaps[kept], gap[near]),
            reach,
        )


def safety_star(
    memory: ScanMemory,
    scan: LaserScan,
    distance: np.ndarray,
    pose: np.ndarray,
    radius: float,
    reach: float,
    parameters: StarParameters,
) -> SafetyStar:
    """The safety star about the latest scan.

    Args:
        memory: the last scans, including the latest.
        scan: the latest, in the sensor frame S at the robot's centre.
        distance: shape (n,), its `smoothed_distances`, used for the near hits, m.
        pose: (x, y, yaw) of S in W when it was taken.
        radius: of the robot with the safety margin, m.
        reach: maximum extent of the star, m.
        parameters: number of bearings.
    """
    samples = bearing_count(scan, parameters)
    bearing_0 = float(pose[2]) + scan.angle_min
    center = np.array(pose[:2], dtype=float)
    within = reach + radius + CONNECTED_CHORD  # farther hits restrict nothing
    points, gaps = np.concatenate(memory.points), np.concatenate(memory.half_gaps)
    if not scan.complete:  # space behind lost beams of the latest scan is not certified
        bounded = scan.lost & (scan.distances < scan.range_max)
        edge = scan.points_at(np.maximum(scan.distances, NEAREST), bounded, pose)
        points, gaps = np.concatenate((points, edge)), np.concatenate((gaps, np.zeros(len(edge))))
    hits = point_hits(points, gaps, center, bearing_0, within, samples)
    limit = free_limit(scan, samples, min(scan.range_max, reach + radius), radius, BLIND_SIDE)
    near = (distance < min(NEAR_HIT_RANGE, scan.range_max)) & scan.hits
    near_hits = scan.points_at(distance, near, pose)
    values = eroded_range(hits, radius, sight_limit(scan, limit, radius))
    return SafetyStar(center, bearing_0, values, near_hits, points, gaps, seen=True, time=scan.time, reach=memory.reach)
