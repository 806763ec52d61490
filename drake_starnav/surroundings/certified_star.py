"""The star-shaped set of positions that the recent hits certify: a cheap sufficient test of the certificate."""

import dataclasses
import math
from functools import cached_property
from typing import NamedTuple

import numpy as np

from drake_starnav.geometry.compiled import kernel
from drake_starnav.geometry.se2 import transform_points
from drake_starnav.lidar.field_of_view import TURN
from drake_starnav.lidar.laser_scan import HIT, LOST, LaserScan, place_ends
from drake_starnav.surroundings.bearing_hits import CONNECTED_CHORD, convert_points_to_bearings
from drake_starnav.surroundings.erosion import DiscInView, erode, limit_by_moving_obstacles
from drake_starnav.surroundings.recent_hits import Hits
from drake_starnav.surroundings.region_union import RegionUnion
from drake_starnav.surroundings.view import NEAREST
from drake_starnav.utils.snapshot import snapshot

QUARTER = 0.25 * TURN
"""A disc that moves straight ahead, this far inside its view, rad, sweeps only seen space and its own place."""
NO_SLOPES = np.zeros(0)


class StarArrays(NamedTuple):
    """A star as a union of one region, for compiled functions; see `RegionUnion`.

    Attributes:
        center: shape (1, 2), W, m.
        bearing_0: shape (1,), rad.
        values: shape (1, M), m.
    """

    center: np.ndarray
    bearing_0: np.ndarray
    values: np.ndarray


@snapshot
class CertifiedStar:
    """A star-shaped set of positions of the robot's centre that the recent hits certify. Immutable; W, m.

    At every point inside, and along the straight segment from the centre to it, the distance to all hits exceeds the
    robot's radius plus the safety margin.

    Attributes:
        center: shape (2,).
        bearing_0: bearing of sample 0, rad.
        values: boundary distance at the samples, shape (M,); between two samples the smaller one counts.
        radius: distance that is kept from the hits: the robot's cover radius with the safety margin.
        field_of_view: first and last bearing, from `bearing_0` on, between which the last scan looked, rad.
        boundary: the hits that bound it, and where unknown space begins, without half chords.
    """

    center: np.ndarray
    bearing_0: float
    values: np.ndarray
    radius: float = 0.0
    field_of_view: tuple[float, float] = (0.0, TURN)
    boundary: Hits = Hits()

    @staticmethod
    def none() -> "CertifiedStar":
        """Return a star that certifies nothing."""
        return CertifiedStar(np.zeros(2), 0.0, np.zeros(4))

    @property
    def is_full_circle(self) -> bool:
        """Whether the last scan looked all around."""
        first_bearing, last_bearing = self.field_of_view
        return last_bearing - first_bearing >= TURN

    @cached_property
    def union(self) -> RegionUnion:
        """The star as a union of one region."""
        return RegionUnion.of_star(self.center, self.bearing_0, self.values, NO_SLOPES)

    @cached_property
    def seen_part(self) -> StarArrays:
        """The star for the fast test; without a full circle it is 0 within a quarter turn of the field of view's
        ends."""
        (first_bearing, last_bearing), values = self.field_of_view, self.values
        if not self.is_full_circle:
            bearing = TURN / len(values) * np.arange(len(values))
            values = np.where((first_bearing + QUARTER <= bearing) & (bearing <= last_bearing - QUARTER), values, 0.0)
        return StarArrays(self.center[None], np.array([self.bearing_0]), values[None])

    def transformed(self, frame: np.ndarray) -> "CertifiedStar":
        """Return the star in another frame, in which the origin of this one is at the pose `frame` (x, y, yaw)."""
        return dataclasses.replace(
            self,
            center=transform_points(frame, self.center[None])[0],
            bearing_0=self.bearing_0 + float(frame[2]),
            boundary=self.boundary._replace(points=transform_points(frame, self.boundary.points)),
        )


def certify_star(
    image: LaserScan,
    hits: Hits,
    robot_pose: np.ndarray,
    radius: float,
    reach: float,
    field_of_view: tuple[float, float],
) -> CertifiedStar:
    """Return the star in which a disc keeps clear of recent hits, and of what the last scans did not see.

    Args:
        image: the polar image of the last scans, in the robot's frame B.
        hits: near the robot, of the recent scans, W.
        robot_pose: (x, y, yaw) of B in W, m and rad.
        radius: of the disc with the safety margin, m.
        reach: maximum extent of the star, m.
        field_of_view: as of `CertifiedStar`.
    """
    x, y, yaw = robot_pose.tolist()
    disc, bearing_0 = DiscInView.of(image, radius, reach=reach), yaw + image.angle_min
    values, points, gaps = _certify_star(disc, hits.points, hits.half_chords, (x, y), yaw, bearing_0, reach)
    return CertifiedStar(np.array((x, y)), bearing_0, values, radius, field_of_view, Hits(points, gaps))


@kernel
def _certify_star(disc, points, gaps, center, yaw, bearing_0, reach):
    """Return values of the star, and points and half chords of its boundary; arguments as of `certify_star`."""
    beams, radius, (x, y) = disc.beams, disc.radius, center
    distances = beams.distances
    if disc.is_merged or not beams.complete:  # space behind lost beams of the last scan is not certified
        ends_early = (beams.kinds & (LOST | HIT * disc.is_merged) != 0) & (distances < beams.range_max)
        cosine, sine = math.cos(yaw), math.sin(yaw)
        edge_points = place_ends(beams.directions, np.maximum(distances, NEAREST), ends_early, x, y, cosine, sine)
        points, gaps = np.concatenate((points, edge_points)), np.concatenate((gaps, np.zeros(len(edge_points))))
    cosines, sines_squared = disc.tables
    hit_range = reach + radius + CONNECTED_CHORD * beams.cover_radius  # farther hits restrict nothing
    nearest, gap, offset = convert_points_to_bearings(points, gaps, x, y, bearing_0, hit_range, len(cosines))
    limit = limit_by_moving_obstacles(disc.limit, beams, radius)
    return erode(nearest, gap, offset, radius, limit, cosines, sines_squared), points, gaps
