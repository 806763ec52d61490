"""Scan matching: new scans are aligned with old ones to correct an odometry that drifts or jumps.

Frames: O is the odometry frame, M the map frame. Both coincide at the start; from then on `ScanMap.correction` is the
pose of O in M. Some scans are kept as keyframes with their poses in M. A new scan is aligned with the oldest keyframe
that sees the same place, so that errors do not accumulate where the robot returns.

Source: this project; the alignment, point-to-line ICP with a prior: A. Censi, An ICP variant using a point-to-line
metric, ICRA 2008; the prior: this project.
"""

import math
from collections.abc import Sequence
from dataclasses import dataclass, field
from typing import NamedTuple

import numpy as np

from drake_starnav.geometry.compiled import kernel
from drake_starnav.geometry.se2 import Place, compose_poses, find_pose_in_frame, invert_pose
from drake_starnav.lidar.laser_scan import USUAL_COVER_RADIUS, LaserScan
from drake_starnav.utils.snapshot import replace_fields, snapshot

UNOBSERVABLE_WEIGHT = 1e12
"""Inverse variance of the guess in an unobservable direction, 1/m^2."""
STILL_DISTANCE, STILL_HEADING = 0.08, 0.02
"""A scan is not aligned if the robot has moved and turned, rad, by less than this since the last alignment; this and
the other lengths here are in cover radii of the robot."""
REACH = 4.0
"""A keyframe is compared with scans taken within this distance."""
SPACING, LEAST_SPACING = 2.0, 0.4
"""A scan this far from all keyframes in view becomes a keyframe; one that fits none, from the second on."""
GOOD_SHARE, POOR_SHARE = 0.6, 0.3
"""Share of a scan's hits on the surfaces of a keyframe from which it fits well, and below which it does not fit."""
RETURN_ERROR, RETURN_TURN = 0.4, 0.05
"""Standard deviation between the map's latest part and an older part to which the robot returns, and of its heading,
rad."""
UNSEEN_JUMP = 0.08
"""A step of the pose that deviates by more than this from the one predicted by the robot's speed is a jump."""
WIDEST_GATE, NARROWEST_GATE = 1.6, 0.4
"""A hit is compared with surfaces up to this distance, in the first and in the last iterations."""
SURFACE_WIDTH, SURFACE_ERROR = 0.4, 0.02
"""A hit's line is fitted to its neighbours up to the first; between hits a surface deviates from it by the second."""


class Surfaces(NamedTuple):
    """A scan as points with lines through them, one per beam; in the sensor frame.

    Attributes:
        points: shape (n, 2), end points of the beams, m; infinity without a hit.
        anchor, normal: shape (n, 2), a line through the hits around each one; the normal is 0 if there is none.
        angle_min, increment: bearing of the first beam and step between beams, rad.
        wrap: whether the last beam's neighbour is the first one.
    """

    points: np.ndarray
    anchor: np.ndarray
    normal: np.ndarray
    angle_min: float
    increment: float
    wrap: bool

    @staticmethod
    def of(scan: LaserScan, width: float) -> "Surfaces":
        """Those of a scan's static hits; for the width see `_fit_lines`."""
        end_points = np.full((len(scan.ranges), 2), np.inf)
        end_points[scan.mappable_hits] = scan.points_at(scan.distances, scan.mappable_hits, (0.0, 0.0, 0.0))
        anchor, normal = _fit_lines(end_points, scan.angle_increment, scan.full_circle, width)
        return Surfaces(end_points, anchor, normal, scan.angle_min, scan.angle_increment, scan.full_circle)


@kernel
def _fit_lines(points, increment, wrap, width):
    """Lines through each point's neighbours on one surface, an anchor point and a normal each, (n, 2), 0 without one.

    Args:
        points: shape (n, 2), end points of the beams of a scan, m; infinity without a hit.
        increment, wrap: as of `Surfaces`.
        width: neighbours are at most this far off, or a few times the distance between beams, m.
    """
    n = len(points)
    anchor, normal = np.zeros((n, 2)), np.zeros((n, 2))
    for i in range(n):
        if points[i, 0] == np.inf:
            continue
        x, y = points[i]
        beam_spacing = math.hypot(x, y) * increment
        near_distance, chord = max(width, 2.5 * beam_spacing), max(0.5 * width, 3.0 * beam_spacing)
        count, sx, sy, sxx, sxy, syy = 1, 0.0, 0.0, 0.0, 0.0, 0.0
        for side in (-1, 1):
            lx, ly = x, y
            for k in range(1, n // 4):
                j = i + side * k
                if not wrap and not 0 <= j < n:
                    break
                px, py = points[j % n]
                if px == np.inf:
                    continue  # a lost beam: whether the surface goes on is told by the next hit
                if math.hypot(px - lx, py - ly) > chord or math.hypot(px - x, py - y) > near_distance:
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
        least, greatest_spread = 0.5 * (a + c) - spread, 0.5 * (a + c) + spread
        if greatest_spread < 1e-12 or least > 0.15 * greatest_spread:
            continue  # a corner or a cloud
        line_direction = 0.5 * math.atan2(2.0 * b, a - c)
        anchor[i, 0], anchor[i, 1] = x + mx, y + my
        normal[i, 0], normal[i, 1] = -math.sin(line_direction), math.cos(line_direction)
    return anchor, normal


@kernel
def align_points(points, guess, weight, surfaces, sigma, gate, last_gate):
    """The pose (x, y, yaw) of points (k, 2) in the frame of known surfaces, near a guess, and the number of inliers.

    Gauss-Newton on the distances to the lines of the nearest known points, with Geman-McClure weights. Where all lines
    are parallel, as in a corridor, the guess is kept along them.

    Args:
        points, guess: m, and m and rad.
        weight: shape (3,), inverse variances of the guess.
        surfaces: `Surfaces`.
        sigma: standard deviation of a point's distance from its line, m; an inlier is within three of them.
        gate, last_gate: points farther than this from all known points are ignored, at first and in the end, m.
    """
    pose = guess.copy()
    inliers = 0
    for _ in range(15):
        h, g = np.diag(weight), weight * (pose - guess)
        inliers = _add_points(h, g, points, pose, surfaces, sigma, gate)
        # The smallest eigenvalue belongs to the direction along the lines. Where the normals have less than a twentieth
        # of their weight in it, it is unobservable: their noise would always suggest zero motion.
        a, b, c = h[0, 0] - weight[0], h[0, 1], h[1, 1] - weight[1]
        if 0.5 * (a + c) - math.sqrt(0.25 * (a - c) ** 2 + b * b) < 0.05 * (a + c):
            line_direction, pose_error = 0.5 * math.atan2(2.0 * b, a - c) + 0.5 * math.pi, pose - guess
            u = np.array((math.cos(line_direction), math.sin(line_direction), 0.0))
            g += UNOBSERVABLE_WEIGHT * (u[0] * pose_error[0] + u[1] * pose_error[1]) * u
            h += np.outer(UNOBSERVABLE_WEIGHT * u, u)
        change = np.linalg.solve(h, -g)
        pose += change
        if gate <= last_gate and np.abs(change).max() < 1e-4:
            break
        gate = max(0.6 * gate, last_gate)
    return pose, inliers


@kernel
def _add_points(h, g, points, pose, surfaces, sigma, gate):
    """Add the points' distances to their lines to the matrix (3, 3) and the gradient (3,); the number of inliers."""
    inliers = 0
    cosine, sine = math.cos(pose[2]), math.sin(pose[2])
    scale = max(3.0 * sigma, 0.3 * gate) ** 2
    for i in range(len(points)):
        rx, ry = points[i, 0] * cosine - points[i, 1] * sine, points[i, 0] * sine + points[i, 1] * cosine
        px, py = pose[0] + rx, pose[1] + ry
        best = _find_nearest(surfaces, px, py, gate)
        if best < 0 or (surfaces.normal[best, 0] == 0.0 and surfaces.normal[best, 1] == 0.0):
            continue
        nx, ny = surfaces.normal[best]
        residual = nx * (px - surfaces.anchor[best, 0]) + ny * (py - surfaces.anchor[best, 1])
        inliers += abs(residual) < 3.0 * sigma
        w = (scale / (scale + residual * residual)) ** 2 / (sigma * sigma)
        j = nx, ny, ny * rx - nx * ry
        for a in range(3):
            g[a] += w * residual * j[a]
            for b in range(3):
                h[a, b] += w * j[a] * j[b]
    return inliers


@kernel
def _find_nearest(surfaces, x, y, gate):
    """The known point nearest to a place, found by its beam, or -1 if none is within the gate."""
    n, turn, points, wrap = len(surfaces.points), 2.0 * math.pi / surfaces.increment, surfaces.points, surfaces.wrap
    bearing = math.atan2(y, x) - surfaces.angle_min
    if not 0.0 <= bearing < 2.0 * math.pi:
        bearing %= 2.0 * math.pi  # which takes longer than the rest
    middle = int(round(bearing / surfaces.increment))
    if not wrap and middle > 0.5 * (n + turn):
        middle -= int(turn)  # just before the first beam
    reach = min(int(math.ceil(gate / max(math.hypot(x, y), gate) / surfaces.increment)), n // 4)
    first, last = middle - reach, middle + reach
    first, last = (first, last) if wrap else (max(first, 0), min(last, n - 1))
    best, nearest = -1, gate * gate
    for k in range(first, last + 1):
        i = k - n if k >= n else k + n if k < 0 else k
        dx, dy = points[i, 0] - x, points[i, 1] - y
        squared = dx * dx + dy * dy
        if squared < nearest:
            best, nearest = i, squared
    return best


@dataclass(frozen=True)
class OdometryError:
    """Declared errors: drift as a share of a step's length and angle, the largest jump, m, and that of ranges, m; and
    the robot's cover radius, m."""

    drift: float
    jump: float
    noise: float
    body: float = USUAL_COVER_RADIUS


@dataclass(frozen=True)
class Travel:
    """The odometry of a drive, and by how much it may err. Immutable.

    Attributes:
        pose: (x, y, yaw) in O.
        way: driven so far, m.
        shift, turn: greatest sum of the declared errors of all steps so far, m and rad.
    """

    pose: np.ndarray
    way: float = 0.0
    shift: float = 0.0
    turn: float = 0.0

    def extend(self, pose: np.ndarray, drift: float, jump: float) -> "Travel":
        """Return the odometry after a step to another pose, with a declared drift and a jump on the way, m."""
        x, y, yaw = find_pose_in_frame(self.pose, pose)
        way = math.hypot(x, y)
        shift, turn = self.shift + drift * way + jump, self.turn + drift * abs(yaw)
        return Travel(np.array(pose, dtype=float), self.way + way, shift, turn)

    def can_have_made(self, earlier: "Travel", step: Place, slack: np.ndarray) -> bool:
        """Return whether the robot may have made a step (x, y, yaw) since an earlier time; `slack` (3,), m and rad."""
        x, y, yaw = find_pose_in_frame(np.array(find_pose_in_frame(earlier.pose, self.pose)), np.array(step))
        turn = self.turn - earlier.turn
        shift = self.shift - earlier.shift + turn * (self.way - earlier.way)
        return math.hypot(x, y) <= shift + slack[0] and abs(math.remainder(yaw, 2.0 * math.pi)) <= turn + slack[2]


@dataclass(frozen=True)
class Keyframe:
    """A scan in the sensor frame S, and as surfaces for the alignment of others. Immutable.

    Attributes:
        pose: (x, y, yaw) in M at which it was taken.
        scan, surfaces: what was seen.
        travel: the odometry then.
    """

    pose: np.ndarray
    scan: LaserScan
    surfaces: Surfaces
    travel: "Travel"

    @staticmethod
    def of(scan: LaserScan, pose: np.ndarray, travel: "Travel", error: OdometryError) -> "Keyframe":
        """Return the keyframe of a scan taken at a pose (x, y, yaw) in M."""
        surface_width = max(SURFACE_WIDTH * error.body, 8.0 * error.noise)
        return Keyframe(np.array(pose, dtype=float), scan, Surfaces.of(scan, surface_width), travel)


@snapshot
class ScanMap:
    """The keyframes and the pose of O in M. Immutable.

    Attributes:
        keyframes: oldest first.
        places: shape (n, 2), positions of the keyframes, M, m.
        correction: (x, y, yaw) of O in M.
        travel: the odometry when the last aligned scan was taken.
        time: when that scan was taken, s.
        speed: shape (2,), forward and lateral, from odometry between the last two aligned scans, m/s; NaN if unknown.
        last: index of the keyframe with which that scan was aligned.
    """

    keyframes: tuple[Keyframe, ...] = ()
    places: np.ndarray = field(default_factory=lambda: np.zeros((0, 2)))
    correction: np.ndarray = field(default_factory=lambda: np.zeros(3))
    travel: Travel = Travel(np.zeros(3))
    time: float = -math.inf
    speed: np.ndarray = field(default_factory=lambda: np.full(2, np.nan))
    last: int = 0

    def correct_pose(self, pose: np.ndarray) -> np.ndarray:
        """A pose (x, y, yaw) in O as one in M, shape (3,)."""
        return compose_poses(self.correction, pose)


def match_scan(scan_map: ScanMap, scan: LaserScan, odometry: np.ndarray, error: OdometryError) -> ScanMap:
    """The map with its correction updated by a new scan, and with the scan as a keyframe if it shows a new place.

    If no keyframe fits, the odometry is trusted.

    The scan is in S, which was at the pose `odometry` (x, y, yaw) in O when it was taken.
    """
    if not scan_map.keyframes:
        return _begin_map(scan_map, scan, odometry, error)
    step = find_pose_in_frame(scan_map.travel.pose, odometry)
    if _is_still(step, error.body) or np.count_nonzero(scan.mappable_hits) < 20:
        return scan_map
    speed, jump = _find_jump(scan_map, step, scan.time - scan_map.time, error)
    travel = scan_map.travel.extend(odometry, error.drift, jump)
    predicted_pose = scan_map.correct_pose(odometry)
    keyframes_in_view = _select_keyframes_in_view(scan_map, scan, predicted_pose, error.body)
    match = _align_with_keyframes(
        scan_map, scan, travel, predicted_pose, keyframes_in_view, _estimate_deviation(step, jump, error), error
    )
    pose = match.pose if match.share >= POOR_SHARE else predicted_pose
    next_map = replace_fields(
        scan_map,
        correction=compose_poses(pose, invert_pose(odometry)),
        travel=travel,
        time=scan.time,
        speed=speed,
        last=match.keyframe_index,
    )
    place_distance = np.hypot(*(scan_map.places - pose[:2]).T)
    if (place_distance[keyframes_in_view] > SPACING * error.body).all() or (
        match.share < GOOD_SHARE and place_distance[-1] > LEAST_SPACING * error.body
    ):
        next_map = _add_keyframe(next_map, Keyframe.of(scan, pose, travel, error), match.share < GOOD_SHARE)
    return next_map


def _begin_map(scan_map: ScanMap, scan: LaserScan, odometry: np.ndarray, error: OdometryError) -> ScanMap:
    """Return the map with its first keyframe; arguments as of `match_scan`."""
    travel = Travel(np.array(odometry, dtype=float))
    keyframe = Keyframe.of(scan, scan_map.correct_pose(odometry), travel, error)
    return _add_keyframe(replace_fields(scan_map, travel=travel, time=scan.time), keyframe, True)


def _add_keyframe(scan_map: ScanMap, keyframe: Keyframe, is_last: bool) -> ScanMap:
    """Return the map with one more keyframe, which may be the one with which the last scan was aligned."""
    keyframes, places = (*scan_map.keyframes, keyframe), np.vstack((scan_map.places, keyframe.pose[:2]))
    last = len(keyframes) - 1 if is_last else scan_map.last
    return replace_fields(scan_map, keyframes=keyframes, places=places, last=last)


def _is_still(step: Place, body: float) -> bool:
    """Return whether a step of the odometry is too short for an alignment, of a robot with this cover radius, m."""
    return math.hypot(step[0], step[1]) < STILL_DISTANCE * body and abs(step[2]) < STILL_HEADING


def _find_jump(scan_map: ScanMap, step: Place, duration: float, error: OdometryError) -> tuple[np.ndarray, float]:
    """The robot's speed by a step of the odometry, which takes a duration, s, and how far that may have jumped, m."""
    speed = np.array(step[:2]) / max(duration, 1e-9)
    unseen_jump = UNSEEN_JUMP * error.body
    has_jumped = error.jump > 0.0 and np.hypot(*(speed - scan_map.speed)) * duration > unseen_jump
    jump = error.jump if has_jumped or error.jump <= unseen_jump else 0.0
    return scan_map.speed if has_jumped else speed, jump


def _estimate_deviation(step: Place, jump: float, error: OdometryError) -> np.ndarray:
    """Standard deviations of the odometry after a step, shape (3,), m and rad; 0.0005 without faults."""
    drift = 2.0 * error.drift  # more than once, as drift is no noise but has the same sign each time
    way = math.hypot(step[0], step[1])
    return np.array((drift * way + jump, drift * way + jump, drift * abs(step[2]))) + 0.0005


class _Match(NamedTuple):
    """How a scan fits a keyframe: the scan's pose in M by that fit, the share of its hits that do, and the keyframe's
    index."""

    pose: np.ndarray
    share: float
    keyframe_index: int


def _align_with_keyframes(
    scan_map: ScanMap,
    scan: LaserScan,
    travel: Travel,
    predicted_pose: np.ndarray,
    keyframes_in_view: Sequence[int],
    deviation: np.ndarray,
    error: OdometryError,
) -> _Match:
    """The match with the first keyframe that a scan fits well, else with the one that it fits best."""
    best_match = _Match(predicted_pose, 0.0, scan_map.last)
    points = scan.points_at(scan.distances, scan.mappable_hits, (0.0, 0.0, 0.0))
    return_error = np.array((RETURN_ERROR * error.body, RETURN_ERROR * error.body, RETURN_TURN))
    # the oldest in view are tried before the last one used
    for index in dict.fromkeys((*keyframes_in_view[:2], scan_map.last)):
        keyframe = scan_map.keyframes[index]
        index_deviation = deviation + (index < scan_map.last) * return_error
        pose, share = align_pose(keyframe, points, predicted_pose, index_deviation, error)
        if not travel.can_have_made(keyframe.travel, find_pose_in_frame(keyframe.pose, pose), return_error):
            continue
        if share > best_match.share:
            best_match = _Match(pose, share, index)
        if share >= GOOD_SHARE:
            break
    return best_match


def _select_keyframes_in_view(scan_map: ScanMap, scan: LaserScan, pose: np.ndarray, unit: float) -> list[int]:
    """Keyframes within REACH of a pose and not occluded in the scan taken there, oldest first; `unit` is in m."""
    place_distance, beams = scan.polar(scan_map.places, pose)
    near_places = np.flatnonzero(place_distance <= REACH * unit)
    nearest_beams = np.rint(beams[near_places]).astype(np.int64)
    if scan.full_circle:
        nearest_beams %= len(scan.ranges)
    in_view = nearest_beams < len(scan.ranges)
    is_occluded = in_view & (place_distance[near_places] >= 0.5 * SPACING * unit)
    is_occluded &= scan.distances[np.where(in_view, nearest_beams, 0)] <= place_distance[near_places]
    return near_places[~is_occluded].tolist()


def align_pose(
    keyframe: Keyframe, points: np.ndarray, guess: np.ndarray, deviation: np.ndarray, error: OdometryError
) -> tuple[np.ndarray, float]:
    """Pose in M at which a scan fits a keyframe best, near the pose predicted by odometry, and its share of inliers.

    The scan has hits (k, 2) in S; `deviation` (3,) are standard deviations of the prediction, m and rad.
    """
    narrowest_gate = NARROWEST_GATE * error.body
    pose, inliers = align_points(
        points,
        np.array(find_pose_in_frame(keyframe.pose, guess)),
        1.0 / deviation**2,
        keyframe.surfaces,
        math.hypot(error.noise, SURFACE_ERROR * error.body),
        min(narrowest_gate + 3.0 * float(deviation[0]), WIDEST_GATE * error.body),
        narrowest_gate,
    )
    return compose_poses(keyframe.pose, pose), inliers / len(points)
