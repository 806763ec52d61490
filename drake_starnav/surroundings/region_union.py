"""A union of star-shaped regions as one record of arrays, and what everybody asks of it: is a place, a line free?"""

import math
from typing import NamedTuple

import numpy as np

from drake_starnav.geometry.compiled import kernel, leaf
from drake_starnav.geometry.se2 import transform_points

LINE_STEP = 0.2
"""Sample spacing on lines of sight inside a union, in radii of the robot."""
ROUGH = 0.01
"""The error of a rough bearing is less than this, in samples."""
LEAP = 16
"""Samples of a line that are first tried at once."""
OUTSIDE_SAMPLES = 10
"""How far beyond a departure a line is followed, in samples."""
ROUNDING = 1e-6
"""Far more than distances are rounded by, m."""


class RegionUnion(NamedTuple):
    """The union of n regions of M samples each, oldest first, for compiled functions. Immutable; W.

    A place is in a region if it is no farther from its centre than the smaller of the two samples beside its bearing.
    Compiled functions unpack the fields that they need before a loop: reading one costs more than what is done with it.

    Attributes:
        center: shape (n, 2), m.
        bearing_0: bearing of sample 0, shape (n,), rad.
        values, slopes: shape (n, M), Phi and Phi' at the samples, m and m/rad. Slopes of shape (n, 0): no modulation.
        reach: largest of the values of each region, shape (n,), m: no place farther from its centre is in it.
    """

    center: np.ndarray
    bearing_0: np.ndarray
    values: np.ndarray
    slopes: np.ndarray
    reach: np.ndarray

    @staticmethod
    def none() -> "RegionUnion":
        """Return a union without regions."""
        return RegionUnion(np.zeros((0, 2)), np.zeros(0), np.zeros((0, 0)), np.zeros((0, 0)), np.zeros(0))

    @staticmethod
    def of_rows(center: np.ndarray, bearing_0: np.ndarray, values: np.ndarray, slopes: np.ndarray) -> "RegionUnion":
        """Return the union of n regions, at least one; arguments as the attributes of these names."""
        return RegionUnion(center, bearing_0, values, slopes, values.max(axis=1))

    @staticmethod
    def of_star(center: np.ndarray, bearing_0: float, values: np.ndarray, slopes: np.ndarray) -> "RegionUnion":
        """Return the union of one region, whose arrays of shape (M,) it shares."""
        return RegionUnion.of_rows(center[None], np.array([bearing_0], dtype=float), values[None], slopes[None])

    @property
    def size(self) -> int:
        """Number of regions."""
        return len(self.bearing_0)

    @property
    def bounds(self) -> np.ndarray:
        """Corners of a box that holds all regions, shape (2, 2), W, m; shape (0, 2) without regions."""
        if not self.size:
            return np.zeros((0, 2))
        reach = self.reach[:, None]
        return np.stack(((self.center - reach).min(axis=0), (self.center + reach).max(axis=0)))

    def join_union(self, other: "RegionUnion") -> "RegionUnion":
        """Return the regions of both."""
        if not (self.size and other.size):
            return self if self.size else other
        return RegionUnion(*map(np.concatenate, zip(self, other, strict=True)))

    def select(self, indices: np.ndarray) -> "RegionUnion":
        """Return the regions of some indices, shape (k,)."""
        return RegionUnion(*(rows[indices] for rows in self))

    def contains(self, points: np.ndarray, slack: float = 0.0) -> np.ndarray:
        """Return whether points in W are in the union, or up to `slack` (m) beyond it; shape (n, 2) -> (n,), bool."""
        return self.covers(points, slack) >= 0

    def covers(self, points: np.ndarray, slack: float = 0.0) -> np.ndarray:
        """Return the index of a region that contains each point, as for `contains`, or -1; shape (n, 2) -> (n,)."""
        return _find_covering_regions(self, np.ascontiguousarray(points, dtype=float), slack)

    def transformed(self, frame: np.ndarray) -> "RegionUnion":
        """Return the same regions in another frame, in which this one's origin is at the pose `frame` (x, y, yaw)."""
        return self._replace(center=transform_points(frame, self.center), bearing_0=self.bearing_0 + frame[2])


@kernel
def _find_covering_regions(union, points, slack):
    """Return the loop of `RegionUnion.covers`: the region that contains a point is tried first on the next."""
    center, bearing_0, values = union.center, union.bearing_0, union.values
    found_regions = np.empty(len(points), np.int64)
    last_region = np.int64(-1)
    for n in range(len(points)):
        x, y = points[n, 0], points[n, 1]
        if last_region < 0 or not covers(center, bearing_0, values, last_region, x, y, slack):
            last_region = find_covering_region(union, x, y, slack)
        found_regions[n] = last_region
    return found_regions


@kernel
def find_covering_region(union, x, y, slack):
    """Return the index of the newest region that contains (x, y), or up to `slack` beyond its boundary, m; or -1."""
    center, bearing_0, values, reach = union.center, union.bearing_0, union.values, union.reach
    for k in range(len(bearing_0) - 1, -1, -1):
        dx, dy, farthest = x - center[k, 0], y - center[k, 1], reach[k] + slack + ROUNDING
        if dx * dx + dy * dy <= farthest * farthest and covers(center, bearing_0, values, k, x, y, slack):
            return k
    return -1


@kernel
def find_first_departure(union, start, end, guess, radius):
    """Return how far from `start` (x, y) the segment to `end` leaves a union, m, at least 1e-9; -1 if it does not.

    Samples are LINE_STEP of the robot's radius (m) apart. The one at `guess` (m, 0: none) is tried first, and within a
    gap the middle one is returned: other segments probably leave the union there, too. Of one region many samples are
    found at once.
    """
    center, bearing_0, values = union.center, union.bearing_0, union.values
    (x0, y0), (x1, y1) = start, end
    length = math.hypot(x1 - x0, y1 - y0)
    sample_count = int(length / (LINE_STEP * radius)) + 1
    if 0.0 < guess < length:
        i = int(guess / length * sample_count + 0.5)
        place = x0 + (x1 - x0) * i / sample_count, y0 + (y1 - y0) * i / sample_count
        if find_covering_region(union, place[0], place[1], 0.0) < 0:
            return max(length * i / sample_count, 1e-9)
    last_region, i, leap = np.int64(-1), 0, 1
    while i <= sample_count:
        place = x0 + (x1 - x0) * i / sample_count, y0 + (y1 - y0) * i / sample_count
        previous_region = last_region
        if last_region < 0 or not covers(center, bearing_0, values, last_region, place[0], place[1], 0.0):
            last_region = find_covering_region(union, place[0], place[1], 0.0)
        if last_region < 0:
            break
        if last_region != previous_region:
            leap = LEAP
        i += 1
        while leap > 1 and i <= sample_count:
            leap_end = min(i + leap, sample_count)
            farther_point = x0 + (x1 - x0) * leap_end / sample_count, y0 + (y1 - y0) * leap_end / sample_count
            if _covers_segment(center, bearing_0, values, last_region, place, farther_point):
                i, place, leap = leap_end + 1, farther_point, 2 * leap
            else:
                leap //= 2
    if i > sample_count:
        return -1.0
    next_index = i + 1
    while next_index <= min(sample_count, i + OUTSIDE_SAMPLES):
        place = x0 + (x1 - x0) * next_index / sample_count, y0 + (y1 - y0) * next_index / sample_count
        if find_covering_region(union, place[0], place[1], 0.0) >= 0:
            break
        next_index += 1
    return max(length * ((i + next_index - 1) // 2) / sample_count, 1e-9)


@kernel
def measure_excess(union, x, y):
    """Return how far (x, y) is beyond each region's boundary on the ray from its centre, at most 0 inside; (n,), m."""
    center, bearing_0, values = union.center, union.bearing_0, union.values
    excess_ranges = np.empty(len(center))
    for k in range(len(excess_ranges)):
        dx, dy = x - center[k, 0], y - center[k, 1]
        left_sample, right_sample = find_samples_beside(bearing_0[k], values.shape[1], dx, dy)
        excess_ranges[k] = math.hypot(dx, dy) - min(values[k, left_sample], values[k, right_sample])
    return excess_ranges


@leaf
def covers(center, bearing_0, values, k, x, y, slack):
    """Return whether region k of a union with these fields contains (x, y), or up to `slack` beyond its boundary, m."""
    dx, dy = x - center[k, 0], y - center[k, 1]
    squared = dx * dx + dy * dy
    if squared < 1e-12:  # the centre itself
        return True
    left_sample, right_sample = find_samples_beside(bearing_0[k], values.shape[1], dx, dy)
    bound = min(values[k, left_sample], values[k, right_sample]) + slack
    return squared <= bound * bound


@kernel
def _covers_segment(center, bearing_0, values, k, start, end):
    """Return whether region k surely covers a segment: its values between the bearings of the ends are large enough."""
    ax, ay, bx, by = start[0] - center[k, 0], start[1] - center[k, 1], end[0] - center[k, 0], end[1] - center[k, 1]
    if ax * ax + ay * ay < 1e-12:  # no bearing
        ax, ay = bx, by
    farthest = math.sqrt(max(ax * ax + ay * ay, bx * bx + by * by)) + 1e-9
    segment_angle = math.atan2(ax * by - ay * bx, ax * bx + ay * by)
    if not abs(segment_angle) < 3.0:
        return False
    samples = values.shape[1]
    sample_angle = 2.0 * math.pi / samples
    start_bearing = math.atan2(ay, ax) - bearing_0[k]
    low, high = min(start_bearing, start_bearing + segment_angle), max(start_bearing, start_bearing + segment_angle)
    for m in range(int(math.floor(low / sample_angle - 1e-6)), int(math.floor(high / sample_angle + 1e-6)) + 2):
        if values[k, m % samples] < farthest:
            return False
    return True


@leaf
def find_samples_beside(bearing_0, samples, dx, dy):
    """Return the indices of the two samples beside the direction (dx, dy), by a polynomial for its bearing.

    It is exact up to 2e-5 rad, and several times faster than `atan2`, which decides where a direction is too near to a
    sample.
    """
    a, b = abs(dx), abs(dy)
    z = min(a, b) / max(a, b) if a + b > 0.0 else 0.0
    s = z * z
    angle = z * (
        0.99997726 + s * (-0.33262347 + s * (0.19354346 + s * (-0.11643287 + s * (0.05265332 - s * 0.0117212))))
    )
    if b > a:
        angle = 0.5 * math.pi - angle
    if dx < 0.0:
        angle = math.pi - angle
    turn_share = ((-angle if dy < 0.0 else angle) - bearing_0) / (2.0 * math.pi)
    position = (turn_share - math.floor(turn_share)) * samples
    left_sample = int(position)
    if not ROUGH < position - left_sample < 1.0 - ROUGH:
        left_sample = int(math.floor((math.atan2(dy, dx) - bearing_0) * samples / (2.0 * math.pi))) % samples
    return left_sample, left_sample + 1 if left_sample + 1 < samples else 0
