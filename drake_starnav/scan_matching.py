"""Where the robot is, told by its scans: new ones laid upon old ones correct an odometry that drifts or jumps.

Frames: O, that of the odometry, in which the robot believes to be; and M, that of the map. M is O at the start; from
then on `ScanMap.correction` says where O lies in M. Some scans are kept as keyframes with their poses in M. A new scan
is aligned with the oldest keyframe that sees the same place, so that errors do not add up where the robot comes back.

Source: A. Censi, An ICP variant using a point-to-line metric, ICRA 2008; the odometry as a prior: this project.
"""

import math
from dataclasses import dataclass, field

import numpy as np
from numba import njit

from drake_starnav.planar import composed, inverse, now_in
from drake_starnav.scan import LaserScan

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
ITERATIONS = 15


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
        anchor, normal = _surfaces(points, scan.angle_increment, scan.full_circle, max(0.1, 8.0 * noise))
        return Keyframe(np.array(pose, dtype=float), scan, points, anchor, normal)


@dataclass(frozen=True)
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

    def __deepcopy__(self, memo: dict) -> "ScanMap":
        return self

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
    jump = error.jump if jumped else min(error.jump, UNSEEN_JUMP)
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
    pose, inliers = _aligned(
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


@njit(cache=True)
def _surfaces(points, increment, wrap, width):
    """Through each hit's neighbours on the same surface within `width`: a point of their line, and its normal."""
    n = len(points)
    anchor, normal = np.zeros((n, 2)), np.zeros((n, 2))
    for i in range(n):
        if points[i, 0] == np.inf:
            continue
        x, y = points[i]
        apart = math.hypot(x, y) * increment
        near, chord = max(width, 2.5 * apart), max(0.5 * width, 3.0 * apart)
        count, sx, sy, sxx, sxy, syy = 1, 0.0, 0.0, 0.0, 0.0, 0.0
        for side in (-1, 1):
            lx, ly = x, y
            for k in range(1, n // 4):
                j = i + side * k
                if not wrap and not 0 <= j < n:
                    break
                px, py = points[j % n]
                if px == np.inf or math.hypot(px - lx, py - ly) > chord or math.hypot(px - x, py - y) > near:
                    break
                lx, ly = px, py
                dx, dy = px - x, py - y
                count, sx, sy = count + 1, sx + dx, sy + dy
                sxx, sxy, syy = sxx + dx * dx, sxy + dx * dy, syy + dy * dy
        if count < 3:
            continue
        mx, my = sx / count, sy / count
        a, b, c = sxx / count - mx * mx, sxy / count - mx * my, syy / count - my * my
        spread = math.sqrt(0.25 * (a - c) ** 2 + b * b)
        least, most = 0.5 * (a + c) - spread, 0.5 * (a + c) + spread
        if most < 1e-12 or least > 0.15 * most:
            continue  # a corner, or a cloud
        along = 0.5 * math.atan2(2.0 * b, a - c)
        anchor[i, 0], anchor[i, 1] = x + mx, y + my
        normal[i, 0], normal[i, 1] = -math.sin(along), math.cos(along)
    return anchor, normal


@njit(cache=True)
def _aligned(points, guess, weight, known, anchor, normal, angle_min, increment, wrap, sigma, gate, last_gate):
    """The pose of points in the frame of known ones, near a guess that counts with `weight`, and how many points fit.

    Gauss-Newton over the distances from the lines of the nearest known points, with Geman-McClure's weights.
    """
    n, turn = len(known), 2.0 * math.pi / increment
    x, y, yaw = guess
    inliers = 0
    for _ in range(ITERATIONS):
        h = np.zeros((3, 3))
        g = np.zeros(3)
        h[0, 0], h[1, 1], h[2, 2] = weight
        g[0], g[1], g[2] = weight[0] * (x - guess[0]), weight[1] * (y - guess[1]), weight[2] * (yaw - guess[2])
        cosine, sine = math.cos(yaw), math.sin(yaw)
        scale = max(3.0 * sigma, 0.3 * gate) ** 2
        inliers = 0
        for i in range(len(points)):
            rx, ry = points[i, 0] * cosine - points[i, 1] * sine, points[i, 0] * sine + points[i, 1] * cosine
            px, py = x + rx, y + ry
            away = math.hypot(px, py)
            middle = int(round(((math.atan2(py, px) - angle_min) % (2.0 * math.pi)) / increment))
            if not wrap and middle > 0.5 * (n + turn):
                middle -= int(turn)  # just before the first beam
            reach = min(int(math.ceil(gate / max(away, gate) / increment)), n // 4)
            best, nearest = -1, gate * gate
            for k in range(middle - reach, middle + reach + 1):
                if not wrap and not 0 <= k < n:
                    continue
                dx, dy = known[k % n, 0] - px, known[k % n, 1] - py
                squared = dx * dx + dy * dy
                if squared < nearest:
                    best, nearest = k % n, squared
            if best < 0 or (normal[best, 0] == 0.0 and normal[best, 1] == 0.0):
                continue
            nx, ny = normal[best]
            residual = nx * (px - anchor[best, 0]) + ny * (py - anchor[best, 1])
            if abs(residual) < 3.0 * sigma:
                inliers += 1
            w = (scale / (scale + residual * residual)) ** 2 / (sigma * sigma)
            j = np.array((nx, ny, ny * rx - nx * ry))
            for a in range(3):
                g[a] += w * residual * j[a]
                for b in range(3):
                    h[a, b] += w * j[a] * j[b]
        change = np.linalg.solve(h, -g)
        x, y, yaw = x + change[0], y + change[1], yaw + change[2]
        if gate <= last_gate and max(abs(change[0]), abs(change[1]), abs(change[2])) < 1e-4:
            break
        gate = max(0.6 * gate, last_gate)
    return np.array((x, y, yaw)), inliers
