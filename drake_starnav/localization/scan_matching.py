"""Scan matching: new scans are aligned with old ones to correct an odometry that drifts or jumps.

Frames: O is the odometry frame, M the map frame. Both coincide at the start; from then on `ScanMap.correction` is the
pose of O in M. Some scans are kept as keyframes with their poses in M. A new scan is aligned with the oldest keyframe
that sees the same place, so that errors do not accumulate where the robot returns.

Source: this project; for the alignment see `icp`.
"""

import math
from dataclasses import dataclass, field

import numpy as np

from drake_starnav.geometry.se2 import composed, inverse, now_in
from drake_starnav.lidar.laser_scan import LaserScan
from drake_starnav.localization.icp import Surfaces, aligned
from drake_starnav.utils.snapshot import snapshot

STILL = 0.02
"""A scan is not aligned if the robot has moved and turned by less than this since the last alignment, m and rad."""
REACH = 1.0
"""A keyframe is compared with scans taken within this distance, m."""
SPACING = 0.5
"""A scan this far from all keyframes in view becomes a keyframe, m."""
GOOD_SHARE, POOR_SHARE = 0.6, 0.3
"""Share of a scan's hits on the surfaces of a keyframe from which it fits well, and below which it does not fit."""
RETURN_ERROR = 0.1, 0.05
"""Standard deviation between the map's latest part and an older part to which the robot returns, m and rad."""
UNSEEN_JUMP = 0.02
"""A step of the pose that deviates by more than this from the one predicted by the robot's speed is a jump, m."""
WIDEST_GATE, NARROWEST_GATE = 0.4, 0.1
"""A hit is compared with surfaces up to this distance, in the first and in the last iterations, m."""


@dataclass(frozen=True)
class OdometryError:
    """Declared errors: drift as a share of a step's length and angle, the largest jump, m, and that of ranges, m."""

    drift: float
    jump: float
    noise: float


@dataclass(frozen=True)
class Keyframe:
    """A scan in the sensor frame S with its pose (x, y, yaw) in M, and as surfaces for the alignment of others.
    Immutable."""

    pose: np.ndarray
    scan: LaserScan
    surfaces: Surfaces

    @staticmethod
    def of(scan: LaserScan, pose: np.ndarray, noise: float) -> "Keyframe":
        """The keyframe of a scan taken at a pose (x, y, yaw) in M, for a range noise in m."""
        return Keyframe(np.array(pose, dtype=float), scan, Surfaces.of(scan, max(0.1, 8.0 * noise)))


@snapshot
class ScanMap:
    """The keyframes and the pose of O in M. Immutable.

    Attributes:
        keyframes: oldest first.
        places: shape (n, 2), positions of the keyframes, M, m.
        correction: (x, y, yaw) of O in M.
        odometry: (x, y, yaw) in O when the last aligned scan was taken.
        time: when that scan was taken, s.
        speed: shape (2,), forward and lateral, from odometry between the last two aligned scans, m/s; NaN if unknown.
        last: index of the keyframe with which that scan was aligned.
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
    """The map with its correction updated by a new scan, and with the scan as a keyframe if it shows a new place.

    If no keyframe fits, the odometry is trusted.

    Args:
        known: the map before.
        scan: in S.
        odometry: (x, y, yaw) of S in O when the scan was taken.
        error: errors of odometry and lidar.
    """
    hit = scan.mappable_hits
    if not known.keyframes:
        first = Keyframe.of(scan, composed(known.correction, odometry), error.noise)
        return ScanMap((first,), first.pose[None, :2], known.correction, np.array(odometry, dtype=float), scan.time)
    step = now_in(known.odometry, odometry)
    way = math.hypot(step[0], step[1])
    if (way < STILL and abs(step[2]) < STILL) or hit.sum() < 20:
        return known
    speed = np.array(step[:2]) / max(scan.time - known.time, 1e-9)
    jumped = error.jump > 0.0 and np.hypot(*(speed - known.speed)) * (scan.time - known.time) > UNSEEN_JUMP
    jump = error.jump if jumped or error.jump <= UNSEEN_JUMP else 0.0
    speed = known.speed if jumped else speed
    drift = 2.0 * error.drift  # more than once, as drift is no noise but has the same sign each time
    # m and rad; 0.0005 without faults
    deviation = np.array((drift * way + jump, drift * way + jump, drift * abs(step[2]))) + 0.0005
    predicted = composed(known.correction, odometry)
    points = scan.points_at(scan.distances, hit, (0.0, 0.0, 0.0))
    pose, share, used = predicted, 0.0, known.last
    near = _in_view(known, scan, predicted)
    for index in dict.fromkeys((*near[:2], known.last)):  # the oldest in view are tried before the last one used
        returning = np.array((RETURN_ERROR[0], *RETURN_ERROR)) if index < known.last else 0.0
        found, fits = _fitted(known.keyframes[index], points, predicted, deviation + returning, error)
        if fits > share:
            pose, share, used = found, fits, index
        if fits >= GOOD_SHARE:
            break
    if share < POOR_SHARE:
        pose = predicted
    keyframes, places = known.keyframes, known.places
    away = np.hypot(*(places - pose[:2]).T)
    if (away[near] > SPACING).all() or (share < GOOD_SHARE and away[-1] > 0.1):
        keyframes, places = (*keyframes, Keyframe.of(scan, pose, error.noise)), np.vstack((places, pose[:2]))
        used = used if share >= GOOD_SHARE else len(keyframes) - 1
    correction = composed(pose, inverse(odometry))
    return ScanMap(keyframes, places, correction, np.array(odometry, dtype=float), scan.time, speed, used)


def _in_view(known: ScanMap, scan: LaserScan, pose: np.ndarray) -> list[int]:
    """Keyframes within REACH of a pose and not occluded in the scan taken there, oldest first."""
    away, beams = scan.polar(known.places, pose)
    near = np.flatnonzero(away <= REACH)
    beam = np.rint(beams[near]).astype(np.int64)
    if scan.full_circle:
        beam %= len(scan.ranges)
    in_view = beam < len(scan.ranges)
    occluded = in_view & (scan.distances[np.where(in_view, beam, 0)] <= away[near]) & (away[near] >= 0.5 * SPACING)
    return near[~occluded].tolist()


def _fitted(
    keyframe: Keyframe, points: np.ndarray, predicted: np.ndarray, deviation: np.ndarray, error: OdometryError
) -> tuple[np.ndarray, float]:
    """Pose in M at which a scan fits a keyframe best, near the pose predicted by odometry, and its share of inliers.

    The scan has hits (k, 2) in S; `deviation` (3,) are standard deviations of the prediction, m and rad.
    """
    pose, inliers = aligned(
        points,
        np.array(now_in(keyframe.pose, predicted)),
        1.0 / deviation**2,
        keyframe.surfaces,
        math.hypot(error.noise, 0.005),  # that of a surface between its hits, m
        min(NARROWEST_GATE + 3.0 * float(deviation[0]), WIDEST_GATE),
        NARROWEST_GATE,
    )
    return composed(keyframe.pose, pose), inliers / len(points)
