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
CELL = 0.4
"""Size of a cell of the index, m: numerics, as it only decides how soon an answer is found."""
WORD = 64
"""Regions in a word of the index."""


class RegionUnion(NamedTuple):
    """The union of n regions of M samples each, oldest first, for compiled functions. Immutable; W.

    A place is in a region if it is no farther from its centre than the smaller of the two samples beside its bearing.
    Compiled functions unpack the fields that they need before a loop: reading one costs more than what is done with it.

    Attributes:
        center: shape (n, 2), m.
        bearing_0: bearing of sample 0, shape (n,), rad.
        values, slopes: shape (n, M), Phi and Phi' at the samples, m and m/rad. Slopes of shape (n, 0): no modulation.
        marks: index, shape (nx, ny, w), uint64: bit k % 64 of word k // 64 is set in each cell that region k touches;
            see `region_index`. Shape (0, 0, 1): no index, as does for up to 200 regions.
        corner: number of the cell of W that comes first, shape (2,), for both axes.
    """

    center: np.ndarray
    bearing_0: np.ndarray
    values: np.ndarray
    slopes: np.ndarray
    marks: np.ndarray = np.zeros((0, 0, 1), np.uint64)
    corner: np.ndarray = np.zeros(2, np.int64)

    @staticmethod
    def none() -> "RegionUnion":
        """Return a union without regions."""
        return RegionUnion(np.zeros((0, 2)), np.zeros(0), np.zeros((0, 0)), np.zeros((0, 0)))

    @staticmethod
    def of_star(center: np.ndarray, bearing_0: float, values: np.ndarray, slopes: np.ndarray) -> "RegionUnion":
        """Return the union of one region, whose arrays of shape (M,) it shares."""
        return RegionUnion(center[None], np.array([bearing_0], dtype=float), values[None], slopes[None])

    @property
    def size(self) -> int:
        """Number of regions."""
        return len(self.bearing_0)

    @property
    def rows(self) -> tuple[np.ndarray, np.ndarray, np.ndarray, np.ndarray]:
        """The fields that have a row for each region."""
        return self.center, self.bearing_0, self.values, self.slopes

    @property
    def bounds(self) -> np.ndarray:
        """Corners of a box that holds the regions of an indexed union, shape (2, 2), W, m."""
        return CELL * np.vstack((self.corner, self.corner + self.marks.shape[:2]))

    def join_union(self, other: "RegionUnion") -> "RegionUnion":
        """Return the regions of both, without an index."""
        if not (self.size and other.size):
            return RegionUnion(*(self if self.size else other).rows)
        return RegionUnion(*(np.concatenate(both) for both in zip(self.rows, other.rows, strict=True)))

    def contains(self, points: np.ndarray, slack: float = 0.0) -> np.ndarray:
        """Return whether points in W are in the union, or up to `slack` (m) beyond it; shape (n, 2) -> (n,), bool."""
        return self.covers(points, slack) >= 0

    def covers(self, points: np.ndarray, slack: float = 0.0) -> np.ndarray:
        """Return the index of a region that contains each point, as for `contains`, or -1; shape (n, 2) -> (n,)."""
        return _find_covering_regions(self, np.ascontiguousarray(points, dtype=float), slack)

    def transformed(self, frame: np.ndarray) -> "RegionUnion":
        """Return the same regions in another frame, in which this one's origin is at the pose `frame` (x, y, yaw)."""
        return RegionUnion(transform_points(frame, self.center), self.bearing_0 + frame[2], self.values, self.slopes)


@kernel
def _find_covering_regions(union, points, slack):
    """Return the loop of `RegionUnion.covers`: the region that contains a point is tried first on the next."""
    center, bearing_0, values = union.center, union.bearing_0, union.values
    found_regions = np.empty(len(points), np.int64)
    last_region = np.int64(-1)  # a literal would compile its callees twice
    for n in range(len(points)):
        x, y = points[n, 0], points[n, 1]
        if last_region < 0 or not covers(center, bearing_0, values, last_region, x, y, slack):
            last_region = find_covering_region(union, x, y, slack)
        found_regions[n] = last_region
    return found_regions


@kernel
def find_covering_region(union, x, y, slack):
    """Return the index of the newest region that contains (x, y), or up to `slack` beyond its boundary, m; or -1."""
    center = union.center
    bearing_0 = union.bearing_0
    values = union.values
    cell_marks = union.marks
    corner = union.corner
    if cell_marks.shape[0] == 0:
        for k in range(len(bearing_0) - 1, -1, -1):
            if covers(center, bearing_0, values, k, x, y, slack):
                return k
        return -1
    newest_cover = -1
    for i in range(math.floor((x - slack) / CELL) - corner[0], math.floor((x + slack) / CELL) - corner[0] + 1):
        for j in range(math.floor((y - slack) / CELL) - corner[1], math.floor((y + slack) / CELL) - corner[1] + 1):
            newest_cover = max(
                newest_cover, find_newest_covering_region(center, bearing_0, values, cell_marks, (i, j), (x, y, slack))
            )
    return newest_cover


@leaf
def find_newest_covering_region(center, bearing_0, values, cell_marks, cell, place):
    """Return the newest region of a cell (i, j) of the index that covers a place (x, y) with its slack, or -1."""
    (i, j), (x, y, slack) = cell, place
    if not (0 <= i < cell_marks.shape[0] and 0 <= j < cell_marks.shape[1]):
        return -1
    for w in range(cell_marks.shape[2] - 1, -1, -1):
        word = cell_marks[i, j, w]
        while word != 0:
            k = w * WORD + find_highest_bit(word)
            if covers(center, bearing_0, values, k, x, y, slack):
                return k
            word ^= np.uint64(1) << np.uint64(k % WORD)
    return -1


@leaf
def find_highest_bit(word):
    """Return the number of the highest bit that is set in a word, uint64."""
    k = 0
    for shift in (32, 16, 8, 4, 2, 1):
        if word >> np.uint64(shift):
            word >>= np.uint64(shift)
            k += shift
    return k


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
