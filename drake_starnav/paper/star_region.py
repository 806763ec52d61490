"""III-B.1: the traversable region about the lidar, bounded by piecewise cubics in polar coordinates.

The cubics are fitted in an abscissa scaled to [-1, 1] in each segment, as the normal equations of the printed powers of
theta are ill-conditioned; the polynomials are the same. They are read at samples of the bearing.
"""

import math

import numpy as np

from drake_starnav.geometry.compiled import kernel
from drake_starnav.lidar.laser_scan import LaserScan
from drake_starnav.paper import choices
from drake_starnav.surroundings.erosion import FreeRange, compute_free_limit, count_bearings, find_field_of_view
from drake_starnav.surroundings.piecewise_cubic import PiecewiseCubic, fit_segments
from drake_starnav.surroundings.star_region import StarRegion, fit_region


def compute_polar_coordinates(points: np.ndarray, center: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Eq. (2): theta = arctan(p_y - p_ref,y, p_x - p_ref,x),  d = |p - p_ref|.

    As printed: the arctan of two arguments is atan2. Bearings, rad, and distances, m, both shape (...), of points
    (..., 2).
    """
    offset = points - center
    return np.arctan2(offset[..., 1], offset[..., 0]), np.hypot(offset[..., 0], offset[..., 1])


def make_traversable_region(scan: LaserScan, pose: np.ndarray, radius: float) -> StarRegion:
    """Line 2 of Algorithm 1: P <- fit piecewise polynomials to L. As printed.

    Args:
        scan: L, in the sensor frame S at the robot's centre.
        pose: (x, y, yaw) of S in W.
        radius: of the robot, m, which the region does not regard.
    """
    beams = len(scan.ranges) if scan.full_circle else 0  # one sample a beam, as the slopes of others would be steps
    range_profile = make_range_profile(scan, scan.distances, radius, choices.RANGE, samples=beams)
    return fit_region(range_profile, pose[:2], pose[2] + scan.angle_min, fit_boundary)


def fit_boundary(samples: np.ndarray, radius: float = 0.0) -> PiecewiseCubic:
    """Eq. (3) and (4): phi_j(theta) = sum_i a_ij theta^i, i = 0..3;  Phi(theta) = phi_j(theta) in segment j.

    As printed, by least squares, with the abscissa scaled in each segment. Samples are of shape (M,), m; the radius is
    not used.
    """
    breaks = find_segment_breaks(samples, choices.JUMP, choices.SLOPE_CHANGE, int(choices.SHORTEST_SEGMENT))
    return fit_segments(samples, breaks, math.inf, False)


@kernel
def find_segment_breaks(samples, jump, change, shortest):
    """Section IV: "the rate of change in radial distance" determines the segments; by the rule of the authors' code.

    A segment begins where the slope angle atan2(dd, dtheta) of neighbouring samples has changed by more than `change`,
    but no sooner than `shortest` samples after the last; and where they jump. Return shape (k + 1,): the first sample
    of each segment, and M.
    """
    count = len(samples)
    step = 2.0 * math.pi / count
    breaks = np.empty(count + 1, np.int64)
    breaks[0] = 0
    n = 1
    first = math.atan2(samples[1] - samples[0], step)
    for i in range(1, count):
        slope = math.atan2(samples[i] - samples[i - 1], step)
        jumps = abs(samples[i] - samples[i - 1]) > jump
        has_turned = abs(slope - first) > change
        if jumps or (has_turned and i - breaks[n - 1] >= shortest):
            breaks[n] = i
            n += 1
        if jumps or has_turned:
            first = slope
    breaks[n] = count
    return breaks[: n + 1].copy()


def make_range_profile(
    scan: LaserScan, distance: np.ndarray, radius: float, reach: float = math.inf, samples: int = 0
) -> FreeRange:
    """Return the range of the nearest beam at every bearing, as the free range of a robot without extent.

    Args:
        scan: in the sensor frame S at the robot's centre.
        distance: shape (n,), its ranges, m.
        radius: of the robot, m.
        reach: farther ranges are cut off, m.
        samples: M; 0: as many as `count_bearings`.
    """
    samples = samples or count_bearings(scan)
    nearest_beams = np.rint(2.0 * math.pi / samples * np.arange(samples) / scan.angle_increment).astype(int)
    nearest_beams = nearest_beams % len(distance) if scan.full_circle else np.minimum(nearest_beams, len(distance) - 1)
    free_limit = compute_free_limit(find_field_of_view(scan), samples, min(scan.range_max, reach))
    return FreeRange(np.clip(distance[nearest_beams], 0.0, free_limit), free_limit, 0.0, radius)
