"""The safety star: positions of the robot's centre that are free according to the last few scans.

The hits are used as measured. If the declared noise makes the nearest hit too unreliable, they are smoothed or averaged
first.
"""

import math
from dataclasses import field

import numpy as np
from numba import njit

from drake_starnav.lidar.laser_scan import LaserScan, placed_ends
from drake_starnav.regions.bearing_hits import CONNECTED_CHORD, half_chords, points_to_bearings
from drake_starnav.regions.erosion import (
    bearing_count,
    bearing_limit,
    bearing_tables,
    erode,
    field_of_view,
    within_sight,
)
from drake_starnav.utils.snapshot import snapshot

SCAN_PATIENCE = 3.0
"""A safety star lasts so many scan periods beyond the lidar's delay; without a new scan the robot then brakes."""
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
        points: of all scans, shape (n, 2), W, m.
        half_gaps: shape (n,), half the chord from each to the neighbouring hit on the same surface, m.
        counts: number of hits of each scan.
        reach: all hits of the last scan within this distance are kept, m.
    """

    points: np.ndarray = field(default_factory=lambda: np.zeros((0, 2)))
    half_gaps: np.ndarray = field(default_factory=lambda: np.zeros(0))
    counts: tuple[int, ...] = ()
    reach: float = math.inf

    def remembered(
        self, scan: LaserScan, pose: np.ndarray, reach: float, count: int, measured: np.ndarray | None = None
    ) -> "ScanMemory":
        """The memory with one more scan and at most `count` scans.

        Args:
            scan: the latest, in S.
            pose: (x, y, yaw) of S in W when it was taken.
            reach: farther hits are dropped, m.
            count: number of scans to keep.
            measured: shape (n,), distances along its beams in place of the scan's, m.
        """
        reach = min(reach, scan.range_max)
        forgotten = max(len(self.counts) + 1 - max(count, 1), 0)
        first = sum(self.counts[:forgotten])
        beams = scan.distances if measured is None else measured, scan.hits, scan.silent
        points, gaps = _remembered(self.points, self.half_gaps, first, beams, scan.view, _place(pose), reach)
        counts = *self.counts[forgotten:], len(points) - len(self.points) + first
        return ScanMemory(points, gaps, counts, reach)


def safety_star(
    memory: ScanMemory,
    scan: LaserScan,
    distance: np.ndarray,
    pose: np.ndarray,
    radius: float,
    reach: float,
    previous: float = -math.inf,
) -> SafetyStar:
    """The safety star about the latest scan.

    Args:
        memory: the last scans, including the latest.
        scan: the latest, in the sensor frame S at the robot's centre.
        distance: shape (n,), its `smoothed_distances`, used for the near hits, m.
        pose: (x, y, yaw) of S in W when it was taken.
        radius: of the robot with the safety margin, m.
        reach: maximum extent of the star, m.
        previous: when the scan before was taken, s.
    """
    points, gaps = memory.points, memory.half_gaps
    if not scan.complete:  # space behind lost beams of the latest scan is not certified
        bounded = scan.lost & (scan.distances < scan.range_max)
        edge = scan.points_at(np.maximum(scan.distances, NEAREST), bounded, pose)
        points, gaps = np.concatenate((points, edge)), np.concatenate((gaps, np.zeros(len(edge))))
    center, bearing_0 = np.array(pose[:2], dtype=float), float(pose[2]) + scan.angle_min
    beams = scan.distances, distance, scan.hits, scan.moving
    bearings = bearing_0, *field_of_view(scan, BLIND_SIDE)
    tables = bearing_tables(bearing_count(scan))
    place = _place(pose)
    values, near = _safety_star(points, gaps, beams, scan.view, place, bearings, radius, reach, tables)
    return SafetyStar(center, bearing_0, values, near, points, gaps, True, scan.time, memory.reach, previous)


def _place(pose: np.ndarray) -> tuple[float, float, float, float]:
    """x, y, and cosine and sine of the yaw."""
    x, y, yaw = pose
    return x, y, math.cos(yaw), math.sin(yaw)


@njit(cache=True)
def _remembered(points, gaps, first, beams, view, place, reach):
    """The points and half gaps from `first` on, and those of the scan."""
    distance, hits, silent = beams
    directions, range_max, increment, wrap = view
    x, y, cosine, sine = place
    near = (distance < reach) & hits
    latest = placed_ends(directions, np.maximum(distance, NEAREST), near, x, y, cosine, sine)
    known = len(points) - first
    all_points, all_gaps = np.empty((known + len(latest), 2)), np.empty(known + len(latest))
    all_points[:known], all_points[known:] = points[first:], latest
    all_gaps[:known], all_gaps[known:] = gaps[first:], half_chords(distance, silent, range_max, increment, wrap)[near]
    return all_points, all_gaps


@njit(cache=True)
def _safety_star(points, gaps, beams, view, place, bearings, radius, reach, tables):
    """The values of the star, and the near hits."""
    measured, distance, beam_hits, moving = beams
    directions, range_max, increment, wrap = view
    x, y, cosine, sine = place
    bearing_0, first, last = bearings
    cosines, squares = tables
    within = reach + radius + CONNECTED_CHORD  # farther hits restrict nothing
    nearest, gap, offset = points_to_bearings(points, gaps, x, y, bearing_0, within, len(cosines))
    limit = bearing_limit(len(cosines), first, last, max(min(range_max, reach + radius) - radius, 0.0))
    sight = within_sight(limit, measured, moving, radius, increment, wrap)
    near = (distance < min(NEAR_HIT_RANGE, range_max)) & beam_hits
    near_hits = placed_ends(directions, distance, near, x, y, cosine, sine)
    return erode(nearest, gap, offset, radius, sight, cosines, squares), near_hits
