"""The paper's perception: the smoothed scan itself bounds the star, by cubics through its samples."""

import math

import numpy as np
from numba import njit
from scipy.ndimage import gaussian_filter1d

from drake_starnav.lidar.laser_scan import LaserScan
from drake_starnav.regions.erosion import FreeRange, bearing_count, free_limit
from drake_starnav.regions.observation import Observation
from drake_starnav.regions.perception import Perceived, PerceptionSettings
from drake_starnav.regions.piecewise_cubic import JUMP, PiecewiseCubic, fit_segments
from drake_starnav.regions.safe_region import NEAR_HIT_RANGE, SafetyStar
from drake_starnav.regions.star_region import fit_region
from drake_starnav.utils.stopwatch import Stopwatch

RANGE = 2.0
"""Ranges beyond this count as no return, m. Source: paper, section IV."""
GAUSSIAN_SAMPLES = 10
"""Width of the Gaussian filter. The standard deviation is a quarter of it: 10 samples hold 95 %."""
SLOPE_CHANGE = 0.02 * math.pi
"""Change of the boundary's direction that begins a new cubic, rad. Source: paper, section III-A."""
SHORTEST_SEGMENT = 4
"""Samples before a change of direction begins a new cubic: as many as determine one."""


def perceive(
    before: Perceived,
    scan: LaserScan,
    pose: np.ndarray,
    settings: PerceptionSettings,
    stopwatch: Stopwatch | None = None,
) -> Perceived:
    """Process a new scan; arguments as for `regions.perception.perceive`.

    Nothing is certified: of the safety star there are only the time and the hits near the robot.
    """
    stopwatch = stopwatch or Stopwatch()
    with stopwatch.measure("scan"):
        distance = smoothed_distances(scan)
        profile = sight_range(scan, distance, RANGE)
        region = fit_region(profile, pose[:2], pose[2] + scan.angle_min, fit_slopes)
        near = (distance < min(NEAR_HIT_RANGE, scan.range_max)) & scan.hits
        safety = SafetyStar(
            center=np.array(pose[:2], dtype=float),
            bearing_0=region.bearing_0,
            values=np.zeros(len(profile.values)),
            near_hits=scan.points_at(distance, near, pose),
            time=scan.time,
            previous=before.safety.time,
        )
    return Perceived(Observation(region, scan, pose), safety, before.memory, before.history)


def smoothed_distances(scan: LaserScan) -> np.ndarray:
    """Ranges up to RANGE smoothed across all surfaces, shape (n,), m; farther ones are the lidar's largest."""
    distance = scan.distances
    if scan.range_max > RANGE:
        distance = np.where(distance > RANGE, scan.range_max, distance)
    clipped = np.minimum(distance, RANGE)
    smooth = gaussian_filter1d(clipped, GAUSSIAN_SAMPLES / 4, mode="wrap" if scan.full_circle else "nearest")
    return np.where(distance >= min(scan.range_max, RANGE), distance, smooth)


def sight_range(scan: LaserScan, distance: np.ndarray, reach: float = math.inf, radius: float = 0.0) -> FreeRange:
    """The range of the nearest beam at every bearing, as the free range of a robot without extent.

    Args:
        scan: in the sensor frame S at the robot's centre.
        distance: shape (n,), its smoothed ranges, m.
        reach: farther ranges are cut off, m.
        radius: taken off all ranges, m.
    """
    samples = bearing_count(scan)
    beam = np.rint(2.0 * math.pi / samples * np.arange(samples) / scan.angle_increment).astype(int)
    beam = beam % len(distance) if scan.full_circle else np.minimum(beam, len(distance) - 1)
    limit = free_limit(scan, samples, min(scan.range_max, reach), radius)
    return FreeRange(np.clip(distance[beam] - radius, 0.0, limit), limit, 0.0)


def fit_slopes(samples: np.ndarray, one_sided: bool = False) -> PiecewiseCubic:
    """Least-squares cubics, each of which begins where the boundary jumps or its direction has changed.

    Arguments as for `fit_piecewise_cubic`.

    Source: paper, section III-A.
    """
    return fit_segments(samples, _slope_breaks(samples, JUMP, SLOPE_CHANGE), math.inf, one_sided)


@njit(cache=True)
def _slope_breaks(samples, jump, change):
    """A new segment begins where the boundary's direction has turned by more than `change`."""
    count = len(samples)
    step = 2.0 * math.pi / count
    breaks = np.empty(count + 1, np.int64)
    breaks[0] = 0
    n = 1
    first = math.atan2(samples[1] - samples[0], step)
    for i in range(1, count):
        slope = math.atan2(samples[i] - samples[i - 1], step)
        jumps = abs(samples[i] - samples[i - 1]) > jump
        turns = abs(slope - first) > change
        if jumps or (turns and i - breaks[n - 1] >= SHORTEST_SEGMENT):
            breaks[n] = i
            n += 1
        if jumps or turns:
            first = slope
    breaks[n] = count
    return breaks[: n + 1].copy()
