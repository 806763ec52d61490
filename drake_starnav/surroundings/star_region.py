"""Star-shaped regions: the free space seen from one place, bounded by a distance Phi(theta) at each bearing.

Source: paper, section III-B.1, Eq. (2) to (4).
"""

import dataclasses
import math
from collections.abc import Callable, Iterable
from functools import cached_property

import numpy as np

from drake_starnav.geometry.se2 import transform_points
from drake_starnav.lidar.laser_scan import LaserScan
from drake_starnav.surroundings.bearing_hits import convert_points_to_bearings
from drake_starnav.surroundings.erosion import (
    FreeRange,
    compute_free_range,
    erode,
    make_bearing_tables,
    smooth_distances,
)
from drake_starnav.surroundings.margins import Margins
from drake_starnav.surroundings.piecewise_cubic import PiecewiseCubic, fit_piecewise_cubic
from drake_starnav.surroundings.region_union import RegionUnion
from drake_starnav.utils.snapshot import snapshot

CUT_BORDER = 0.4
"""Hits farther beyond a region than this and the robot's radius do not cut it back, in its radii."""
Fit = Callable[[np.ndarray, float], PiecewiseCubic]
"""From the free range at M bearings and the robot's radius, m, to its boundary, as `fit_piecewise_cubic`."""


@snapshot
class StarRegion:
    """A star-shaped set of free positions of the robot's centre, in the world frame W. Immutable.

    Attributes:
        center: p_ref, shape (2,), m.
        bearing_0: bearing of sample 0, rad.
        boundary: the fitted cubics.
        free_range: shape (M,), the samples that were fitted, m.
        limit: shape (M,), free range at a bearing without obstacles, m; 0 outside the field of view.
        margin: smallest clearance kept beyond the robot's radius, m.
        radius: of the robot, m.
    """

    center: np.ndarray
    bearing_0: float
    boundary: PiecewiseCubic
    free_range: np.ndarray
    limit: np.ndarray
    margin: float
    radius: float

    @cached_property
    def reach(self) -> float:
        """Largest distance from the centre to the boundary, m."""
        return float(self.boundary.values.max())

    @cached_property
    def as_union(self) -> RegionUnion:
        """This region as a union."""
        return RegionUnion.of_star(*self.row)

    @property
    def row(self) -> tuple[np.ndarray, float, np.ndarray, np.ndarray]:
        """What `RegionUnion` holds of this region."""
        return self.center, self.bearing_0, self.boundary.values, self.boundary.slopes

    def phi(self, theta: np.ndarray | float) -> np.ndarray:
        """Return the distance Phi up to which all is inside at bearings theta in W, m; shape of `theta`.

        Between two samples the smaller one counts: it bounds the free range there.
        """
        values = self.boundary.values
        share_of_turn = (np.asarray(theta, dtype=float) - self.bearing_0) / (2.0 * math.pi)
        left_sample = np.floor(share_of_turn * len(values)).astype(int) % len(values)
        return np.minimum(values[left_sample], values[(left_sample + 1) % len(values)])

    def contains(self, points: np.ndarray) -> np.ndarray:
        """Return whether points in W are inside, no farther than `phi`; shape (..., 2) -> (...), bool."""
        points = np.asarray(points, dtype=float)
        return self.as_union.contains(points.reshape(-1, 2)).reshape(points.shape[:-1])

    def transformed(self, frame: np.ndarray) -> "StarRegion":
        """Return the same region in another frame, in which this one's origin is at the pose `frame` (x, y, yaw)."""
        center = transform_points(frame, self.center[None, :])[0]
        return dataclasses.replace(self, center=center, bearing_0=self.bearing_0 + float(frame[2]))

    def outline(self, count: int | None = None) -> np.ndarray:
        """Return boundary points in W, shape (about `count`, 2), m; default all M samples."""
        step = 1 if count is None else max(1, math.ceil(len(self.boundary.values) / count))
        phi = self.boundary.values[::step]
        theta = self.bearing_0 + 2.0 * math.pi / len(self.boundary.values) * np.arange(0, len(phi) * step, step)
        return self.center + phi[:, None] * np.column_stack((np.cos(theta), np.sin(theta)))


def fit_region(profile: FreeRange, center: np.ndarray, bearing_0: float, fit: Fit = fit_piecewise_cubic) -> StarRegion:
    """Return the star-shaped region about `center` in W whose boundary fits a free range."""
    return StarRegion(
        center=np.asarray(center, dtype=float),
        bearing_0=bearing_0,
        boundary=fit(profile.values, profile.radius),
        free_range=profile.values,
        limit=profile.limit,
        margin=profile.margin,
        radius=profile.radius,
    )


def make_scan_region(
    scan: LaserScan, pose: np.ndarray, radius: float, margins: Margins, samples: int = 0
) -> StarRegion:
    """Return the star-shaped region of one scan.

    Args:
        scan: in the sensor frame S, at the robot's centre.
        pose: (x, y, yaw) of S in W when the scan was taken.
        radius: of the robot, m.
        margins: kept, and how ranges are smoothed.
        samples: M, the same for all scans of a roadmap; 0: as many as suit this one.
    """
    profile = compute_free_range(scan, smooth_distances(scan, margins.smoothing_slack), radius, margins, samples)
    return fit_region(profile, pose[:2], float(pose[2]) + scan.angle_min)


def cut_back(region: StarRegion, points: np.ndarray, gaps: np.ndarray, radius: float) -> np.ndarray:
    """Return the free range of a region, cut back where another scan has hits; shape (M,), m.

    Args:
        region: made from one scan.
        points: hits of another one, shape (n, 2), W, m.
        gaps: shape (n,), their `half_chords`, m.
        radius: of the robot with the margin that it keeps from them, m.
    """
    hit_range, samples = float(region.free_range.max()) + radius + CUT_BORDER * region.radius, len(region.free_range)
    hits = convert_points_to_bearings(points, gaps, *region.center, region.bearing_0, hit_range, samples)
    return erode(*hits, radius, region.free_range, *make_bearing_tables(samples))


def clear_region(region: StarRegion, places: np.ndarray, radius: float) -> StarRegion:
    """Return the part of a region that is farther than `radius` (m) from places (k, 2) in W."""
    if not len(places):
        return region
    values = cut_back(region, places, np.zeros(len(places)), radius)
    return region if (values == region.free_range).all() else refit_region(region, values)


def refit_region(region: StarRegion, free_range: np.ndarray) -> StarRegion:
    """Return the region with another free range, shape (M,), m."""
    boundary = fit_piecewise_cubic(free_range, region.radius)
    return dataclasses.replace(region, free_range=free_range, boundary=boundary)


def unite_regions(regions: Iterable[StarRegion]) -> RegionUnion:
    """Return the union of regions that share one number of samples M."""
    rows = [region.row for region in regions]
    return RegionUnion.of_rows(*map(np.array, zip(*rows, strict=True))) if rows else RegionUnion.none()
