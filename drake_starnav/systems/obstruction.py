"""Why a robot that stands is not certified to drive: where it is blind, or what is too near."""

import math

import numpy as np

from drake_starnav.geometry.footprint import Footprint, measure_point_distance
from drake_starnav.geometry.se2 import invert_pose, transform_points
from drake_starnav.lidar.field_of_view import TURN
from drake_starnav.lidar.laser_scan import LaserScan
from drake_starnav.planning.planner import AVOIDED_WITHIN
from drake_starnav.surroundings.certified_star import CertifiedStar
from drake_starnav.surroundings.erosion import find_field_of_view
from drake_starnav.surroundings.surroundings import Surroundings

SHORTEST_WAY = 0.2
"""Nothing that stands obstructs a robot that is certified to drive farther than this, in its cover radii."""


def describe_obstruction(
    surroundings: Surroundings, scan: LaserScan, path_bearing: float, shape: Footprint, pose: np.ndarray
) -> str:
    """Return in words what keeps a robot from driving towards a bearing: where it is blind, what is too near; or "".

    Args:
        surroundings: of the robot; nothing may be known yet.
        scan: polar image of the last scans, in B.
        path_bearing: of the path in B, rad.
        shape: of the robot.
        pose: of the robot: x, y, yaw, W.
    """
    if not surroundings.has_views:
        return ""
    star, cover_radius = surroundings.certified_star, shape.cover_radius
    if not shape.is_disc and len(star.boundary.points):
        nearest_text = _describe_hit_beside(star, scan, shape, pose)
        if nearest_text:
            return nearest_text
    turn_angle = (path_bearing - scan.angle_min) % TURN
    sample = int(turn_angle * len(star.values) / TURN) % len(star.values)
    if min(star.values[sample], star.values[(sample + 1) % len(star.values)]) > SHORTEST_WAY * cover_radius:
        return _describe_moving_obstacle(scan, cover_radius)
    first_bearing, last_bearing = find_field_of_view(scan)
    if not first_bearing <= turn_angle <= last_bearing:
        return (
            f"blind: the lidar looks from {math.degrees(scan.angle_min):.0f} to {math.degrees(scan.angle_max):.0f} "
            f"degrees; the way leads towards {math.degrees(math.remainder(path_bearing, TURN)):.0f} degrees"
        )
    hit = _find_hit_ahead(star, turn_angle, cover_radius)
    return (
        _describe_moving_obstacle(scan, cover_radius) if hit < 0 else _describe_hit_ahead(star, hit, scan, cover_radius)
    )


def _find_hit_ahead(star: CertifiedStar, turn_angle: float, cover_radius: float) -> int:
    """Return which hit on the star's boundary ends the way at an angle from its first bearing, rad; -1: none does."""
    distance, bearing = _find_polar(star, star.boundary.points)
    bearing_offset = np.mod(bearing - turn_angle + math.pi, TURN) - math.pi
    kept_distance = np.hypot(star.radius, star.boundary.half_chords)
    across = distance * np.abs(np.sin(bearing_offset))
    is_ahead = (across < kept_distance) & (np.abs(bearing_offset) < 0.5 * math.pi)
    way = distance * np.cos(bearing_offset) - np.sqrt(np.maximum(kept_distance**2 - across**2, 0.0))
    is_ahead &= way < SHORTEST_WAY * cover_radius + kept_distance * TURN / len(star.values)
    return int(np.argmin(np.where(is_ahead, np.abs(bearing_offset), math.inf))) if is_ahead.any() else -1


def _find_polar(star: CertifiedStar, points: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Return how far points (n, 2), W, are from a star's centre, m, and their bearings from its first, rad."""
    offset = points - star.center
    return np.hypot(*offset.T), np.arctan2(offset[:, 1], offset[:, 0]) - star.bearing_0


def _describe_hit_ahead(star: CertifiedStar, hit: int, scan: LaserScan, cover_radius: float) -> str:
    """Return what is said of a hit on the star's boundary, or of the lost beams that it stands for."""
    (distance,), (bearing,) = _find_polar(star, star.boundary.points[hit : hit + 1])
    where = _describe_direction(float(bearing) + scan.angle_min)
    beam = round(float(bearing % TURN) / scan.angle_increment) % len(scan.ranges)
    if scan.lost[beam]:
        return f"blind: {int(scan.lost.sum())} of {len(scan.lost)} beams are lost, also {where}"
    beam_text = "" if scan.merged else f" of beam {beam}"
    is_measured, kept_distance = distance >= scan.range_min, math.hypot(star.radius, star.boundary.half_chords[hit])
    distance_text = f"at {distance:.3f} m" if is_measured else f"nearer than lidar.range_min {scan.range_min:g} m"
    return (
        f"too near: a hit{beam_text} {distance_text}, {where}; robot.radius {cover_radius:g} m with a safety margin of "
        f"{star.radius - cover_radius:.3g} m keeps {kept_distance:.3f} m from it"
    )


def _describe_hit_beside(star: CertifiedStar, scan: LaserScan, shape: Footprint, pose: np.ndarray) -> str:
    """Return the hit that is nearest to a footprint, if the robot cannot come nearer; lost beams tell nothing."""
    points, margin = star.boundary.points, star.radius - shape.cover_radius
    hits, offset = transform_points(invert_pose(pose), points), points - star.center
    turn = np.mod(np.arctan2(offset[:, 1], offset[:, 0]) - star.bearing_0, TURN) / scan.angle_increment
    is_lost = scan.lost[np.rint(turn).astype(int) % len(scan.ranges)]
    gaps = [
        math.inf if unseen else measure_point_distance(*hit, shape.body)
        for hit, unseen in zip(hits, is_lost, strict=True)
    ]
    hit = int(np.argmin(gaps))
    if gaps[hit] > margin + SHORTEST_WAY * shape.cover_radius:
        return ""
    return (
        f"too near: a hit {gaps[hit]:.3f} m from the footprint, "
        f"{_describe_direction(math.atan2(*hits[hit, ::-1]))}; the robot "
        f"keeps a safety margin of {margin:.3g} m, or comes no nearer"
    )


def _describe_moving_obstacle(scan: LaserScan, cover_radius: float) -> str:
    """Return where the nearest obstacle that moves is, if any is near."""
    if not (scan.distances[scan.moving] <= AVOIDED_WITHIN * cover_radius).any():
        return ""
    return f"too near: an obstacle that moves, {describe_nearest(scan, scan.moving)}"


def describe_nearest(scan: LaserScan, beams: np.ndarray) -> str:
    """Return where the nearest is that some beams (n,), bool, have hit: its distance, m, and its bearing in S."""
    beam = int(np.argmin(np.where(beams, scan.distances, math.inf)))
    return f"at {scan.distances[beam]:.2f} m, {_describe_direction(scan.bearings[beam])}"


def _describe_direction(bearing: float) -> str:
    degrees = math.degrees(math.remainder(bearing, TURN))
    return f"{abs(degrees):.0f} degrees to the {'left' if degrees >= 0.0 else 'right'}"
