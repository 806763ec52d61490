"""The paper's perception: the scan itself bounds the star, by cubics through its samples."""

import math
from collections.abc import Sequence

import numpy as np

from drake_starnav.baselines.paper import constants
from drake_starnav.lidar.laser_scan import LaserScan
from drake_starnav.lidar.outlier_filter import HitHistory
from drake_starnav.surroundings.erosion import FreeRange, bearing_count, field_of_view, free_limit
from drake_starnav.surroundings.observation import Observation
from drake_starnav.surroundings.perception import LastScan, Perceived, PerceptionSettings
from drake_starnav.surroundings.piecewise_cubic import PiecewiseCubic, fit_piecewise_cubic
from drake_starnav.surroundings.safe_region import CertifiedRegion
from drake_starnav.surroundings.star_region import fit_region

TOLERANCE = 0.4
"""Largest overshoot plus undershoot of a cubic, in radii of the robot: large enough that noise makes no segments."""


def perceive(
    before: Perceived, scans: Sequence[LaserScan], pose: np.ndarray, settings: PerceptionSettings
) -> Perceived:
    """Process a new scan; arguments as for `surroundings.perception.perceive`, of one lidar on the axis.

    Nothing is certified: of the certified region there are only the time and the hits.
    """
    (scan,) = scans
    profile = sight_range(scan, scan.distances, settings.footprint.narrow, constants.RANGE)
    region = fit_region(profile, pose[:2], pose[2] + scan.angle_min, fit_scan)
    safety = CertifiedRegion(
        center=np.array(pose[:2], dtype=float),
        bearing_0=region.bearing_0,
        values=np.zeros(len(profile.values)),
        near_hits=scan.points_at(scan.distances, scan.hits & (scan.distances < constants.RANGE), pose),
        time=scan.time,
        previous=before.safety.time,
    )
    return Perceived(
        Observation(region, scan, pose), safety, before.memory, (LastScan(scan, scan, pose, HitHistory()),)
    )


def sight_range(
    scan: LaserScan, distance: np.ndarray, radius: float, reach: float = math.inf, less: float = 0.0
) -> FreeRange:
    """The range of the nearest beam at every bearing, as the free range of a robot without extent.

    Args:
        scan: in the sensor frame S at the robot's centre.
        distance: shape (n,), its ranges, m.
        radius: of the robot, m.
        reach, less: farther ranges are cut off, and this is taken off all, m.
    """
    samples = bearing_count(scan)
    beam = np.rint(2.0 * math.pi / samples * np.arange(samples) / scan.angle_increment).astype(int)
    beam = beam % len(distance) if scan.full_circle else np.minimum(beam, len(distance) - 1)
    limit = free_limit(field_of_view(scan), samples, max(min(scan.range_max, reach) - less, 0.0))
    return FreeRange(np.clip(distance[beam] - less, 0.0, limit), limit, 0.0, radius)


def fit_scan(samples: np.ndarray, radius: float) -> PiecewiseCubic:
    """Least-squares cubics through the samples, with the segments of `fit_piecewise_cubic`; arguments as there.

    Of these the paper says only that the rate of change of the range determines them.

    Source: paper, section III-B.1 and IV.
    """
    return fit_piecewise_cubic(samples, radius, TOLERANCE, one_sided=False)
