"""Where the robot is, told by its scans: new ones laid upon old ones correct an odometry that drifts or jumps.

Frames: O, that of the odometry, in which the robot believes to be; and M, that of the map. M is O at the start; from
then on `ScanMap.correction` says where O lies in M. Some scans are kept as keyframes with their poses in M. A new scan
is aligned with the oldest keyframe that sees the same place, so that errors do not add up where the robot comes back.

Source: this project; for the alignment see `icp`.
"""

import math
from dataclasses import dataclass, field

import numpy as np

from drake_starnav.geometry.se2 import composed, inverse, now_in
from drake_starnav.lidar.laser_scan import LaserScan
from drake_starnav.localization.icp import aligned, surfaces
from drake_starnav.utils.snapshot import snapshot

STILL = 0.02
"""A robot that has moved or turned by less since the last scan was aligned waits for the next one, m and rad."""
REACH = 1.0
"""A keyframe is compared with scans taken at most this far from it, m."""
SPACING = 0.5
"""Keyframes are at least this far from what is known otherwise, m."""
LEAST_SPACING = 0.1
"""... or this far from the last one, where little of what is seen now is known, m."""
GOOD_SHARE, POOR_SHARE = 0.6, 0.3
"""A scan of whose hits this share lies on the surfaces of a keyframe fits it; with less than the other it does not."""
OLDEST_TRIED = 2
"""So many of the oldest keyframes in view are tried before the last one that was used."""
LEAST_HITS = 20
"""A scan with fewer hits says nothing."""
STEP_ERROR = 0.0005
"""Of an odometry without faults, from scan to scan, m and rad."""
DRIFT_SHARE = 2.0
"""The declared drift counts so many times as a standard deviation: it is no noise, it goes the same way each time."""
RETURN_ERROR = 0.1, 0.05
"""By so much the map may disagree with an older part of itself to which the robot returns, m and rad."""
UNSEEN_JUMP = 0.02
"""A step of the pose that differs by more than this from what the robot's speed makes of it is taken for a jump, m."""
SURFACE_ERROR = 0.005
"""Of a surface between its hits, beside the noise, m."""
WIDEST_GATE, NARROWEST_GATE = 0.4, 0.1
"""A hit is compared with a surface at most so far from it, at first and in the end, m."""


@dataclass(frozen=True)
class OdometryError:
    """What is known about the errors of odometry and lidar.

    Attributes:
        drift: error of a step as a share of its length, and of the angle turned.
        jump: how far the position may jump at times, m.
        noise: standard deviation of the ranges, m.
    """

    drift: float
    jump: float
    noise: float


@dataclass(frozen=True)
class Keyframe:
    """A scan as surfaces to lay others upon, one a beam. Immutable.

    Attributes:
        pose: (x, y, yaw) of the sensor frame S in M.
        scan: in S.
        points: shape (n, 2), where the beams ended, S, m; infinity where nothing was hit.
        anchor, normal: shape (n, 2), line through the hits about each one, S; its normal is 0 where there is none.
    """

    pose: np.ndarray
    scan: LaserScan
    points: np.ndarray
    anchor: np.ndarray
    normal: np.ndarray

    @staticmethod
    def of(scan: LaserScan, pose: np.ndarray, noise: float) -> "Keyframe":
        """The keyframe of a scan taken at a pose (x, y, yaw) in M, with range noise in m."""
        points = np.full((len(scan.ranges), 2), np.inf)
        hit = _lasting_hits(scan)
        points[hit] = scan.points_at(scan.distances, hit, (0.0, 0.0, 0.0))
        anchor, normal = surfaces(points, scan.angle_increment, scan.full_circle, max(0.1, 8.0 * noise))
        return Keyframe(np.array(pose, dtype=float), scan, points, anchor, normal)


@snapshot
class ScanMap:
    """The keyframes and where O lies in M. Immutable.

    Attributes:
        keyframes: oldest first.
        places: shape (n, 2), of the keyframes, M, m.
        correction: (x, y, yaw) of O in M.
        odometry: (x, y, yaw) in O where the last scan was aligned.
        time: of that scan, s.
        speed: shape (2,), along and across the robot, by the odometry between the last two, m/s; NaN if unknown.
        last: index of the keyframe with which it was aligned.
    """

    keyframes: tuple[Keyframe, ...] = ()
    places: np.ndarray = field(default_factory=lambda: np.zeros((0, 2)))
    correction: np.ndarray = field(default_factory=lambda: np.zeros(3))
    odometry: np.ndarray = field(default_factory=lambda: np.zeros(3))
    time: float = -math.inf
    speed: np.ndarray = field(default_factory=lambda: np.full(2, np.nan))
    last: int = 0

    def corrected(self, pose: np.ndarray) -> np.ndarray:
        """A pose (x, y, yaw) in O as one in M, shape (3,)."""
        return composed(self.correction, pose)


def matched(known: ScanMap, scan: LaserScan, odometry: np.ndarray, error: OdometryError) -> ScanMap:
    """The map with the correction that a new scan calls for, and with the scan as a keyframe if it shows much news.

    Where no keyframe fits, the odometry is believed.

    Args:
        known: before.
        scan: in S.
        odometry: (x, y, yaw) of S in O when the scan was taken.
        error: of odometry and lidar.
    """
    hit = _lasting_hits(scan)
    if not known.keyframes:
        first = Keyframe.of(scan, composed(known.correction, odometry), error.noise)
        return ScanMap((first,), first.pose[None, :2], known.correction, np.array(odometry, dtype=float), scan.time)
    step = now_in(known.odometry, odometry)
    way = math.hypot(step[0], step[1])
    if (way < STILL and abs(step[2]) < STILL) or hit.sum() < LEAST_HITS:
        return known
    speed = np.array(step[:2]) / max(scan.time - known.time, 1e-9)
    jumped = error.jump > 0.0 and np.hypot(*(speed - known.speed)) * (scan.time - known.time) > UNSEEN_JUMP
    jump = error.jump if jumped or error.jump <= UNSEEN_JUMP else 0.0
    speed = known.speed if jumped else speed
    drift = DRIFT_SHARE * error.drift
    deviation = np.array((drift * way + jump, drift * way + jump, drift * abs(step[2]))) + STEP_ERROR
    predicted = composed(known.correction, odometry)
    points = scan.points_at(scan.distances, hit, (0.0, 0.0, 0.0))
    pose, share, used = predicted, 0.0, known.last
    near = _in_view(known, scan, predicted)
    for index in dict.fromkeys((*near[:OLDEST_TRIED], known.last)):
        returning = np.array((RETURN_ERROR[0], *RETURN_ERROR)) if index < known.last else 0.0
        found, fits = _laid_upon(known.keyframes[index], points, predicted, deviation + returning, error)
        if fits > share:
            pose, share, used = found, fits, index
        if fits >= GOOD_SHARE:
            break
    if share < POOR_SHARE:
        pose = predicted
    keyframes, places = known.keyframes, known.places
    away = np.hypot(*(places - pose[:2]).T)
    if (away[near] > SPACING).all() or (share < GOOD_SHARE and away[-1] > LEAST_SPACING):
        keyframes, places = (*keyframes, Keyframe.of(scan, pose, error.noise)), np.vstack((places, pose[:2]))
        used = used if share >= GOOD_SHARE else len(keyframes) - 1
    correction = composed(pose, inverse(odometry))
    return ScanMap(keyframes, places, correction, np.array(odometry, dtype=float), scan.time, speed, used)


def _lasting_hits(scan: LaserScan) -> np.ndarray:
    return scan.hits & scan.lasting


def _in_view(known: ScanMap, scan: LaserScan, pose: np.ndarray) -> list[int]:
    """The keyframes within REACH of a pose whose places the scan taken there does not hide, oldest first."""
    away = np.hypot(*(known.places - pose[:2]).T)
    near = np.flatnonzero(away <= REACH)
    offset = known.places[near] - pose[:2]
    bearing = np.mod(np.arctan2(offset[:, 1], offset[:, 0]) - pose[2] - scan.angle_min, 2.0 * math.pi)
    beam = np.rint(bearing / scan.angle_increment).astype(np.int64)
    if scan.full_circle:
        beam %= len(scan.ranges)
    looked = beam < len(scan.ranges)
    hidden = looked & (scan.distances[np.where(looked, beam, 0)] <= away[near]) & (away[near] >= 0.5 * SPACING)
    return near[~hidden].tolist()


def _laid_upon(
    keyframe: Keyframe, points: np.ndarray, predicted: np.ndarray, deviation: np.ndarray, error: OdometryError
) -> tuple[np.ndarray, float]:
    """Where in M a scan fits a keyframe best, given where it was taken by the odometry, and the share that fits.

    Args:
        keyframe: with its surfaces.
        points: shape (k, 2), the scan's hits in S.
        predicted: (x, y, yaw) of S in M.
        deviation: shape (3,), standard deviations of that, m and rad.
        error: of the lidar.
    """
    scan = keyframe.scan
    pose, inliers = aligned(
        points,
        np.array(now_in(keyframe.pose, predicted)),
        1.0 / deviation**2,
        keyframe.points,
        keyframe.anchor,
        keyframe.normal,
        scan.angle_min,
        scan.angle_increment,
        scan.full_circle,
        math.hypot(error.noise, SURFACE_ERROR),
        min(NARROWEST_GATE + 3.0 * float(deviation[0]), WIDEST_GATE),
        NARROWEST_GATE,
    )
    return composed(keyframe.pose, pose), inliers / len(points)
