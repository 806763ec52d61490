"""Star-shaped regions: the free space seen from one place, as a level set of a polar boundary.

    Gamma(p) = (Phi(theta) / |p - p_ref|)^sigma,   theta = atan2 of p - p_ref

Gamma is above 1 inside, 1 on the boundary, infinite at the reference point p_ref.
Source: paper, section III-B; corrected here: theta by atan2, and the boundary's frame from Phi and Phi'.
"""

import dataclasses
import math
from collections.abc import Callable
from dataclasses import dataclass, field
from functools import cached_property

import numpy as np
from numba import njit

from drake_starnav.geometry.compiled import leaf
from drake_starnav.geometry.se2 import placed
from drake_starnav.lidar.laser_scan import LaserScan
from drake_starnav.regions.erosion import (
    SMOOTHING_BEAMS,
    FreeRange,
    bearing_count,
    bearing_tables,
    disc_range,
    field_of_view,
    moving_average,
)
from drake_starnav.regions.margins import Margins
from drake_starnav.regions.piecewise_cubic import TOLERANCE, PiecewiseCubic, adaptive_fit, fit_piecewise_cubic
from drake_starnav.utils.shared_rows import SharedRows
from drake_starnav.utils.snapshot import snapshot

ROUGH = 0.01
"""The error of a rough bearing is less than this, in samples."""
Fit = Callable[[np.ndarray], PiecewiseCubic]
"""From the free range at M bearings, m, to its boundary, as `fit_piecewise_cubic`."""
LINE_STEP = 0.05
"""Sample spacing on lines of sight inside the union of regions, m."""


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
    """

    center: np.ndarray
    bearing_0: float
    boundary: PiecewiseCubic
    free_range: np.ndarray
    limit: np.ndarray
    margin: float

    @cached_property
    def reach(self) -> float:
        """Largest distance from the centre to the boundary, m."""
        return float(self.boundary.values.max())

    @cached_property
    def undershoot(self) -> float:
        """Largest distance by which the boundary falls short of the free range, m."""
        return float(max((self.free_range - self.boundary.values).max(), 0.0))

    def phi(self, theta: np.ndarray | float) -> np.ndarray:
        """Boundary distance Phi at bearings theta in W, m; shape of `theta`."""
        return self._evaluate(theta)[0]

    def phi_prime(self, theta: np.ndarray | float) -> np.ndarray:
        """Derivative dPhi/dtheta at bearings theta in W, m/rad; shape of `theta`."""
        return self._evaluate(theta)[1]

    def gamma(self, points: np.ndarray, sigma: float = 2.0) -> np.ndarray:
        """Level-set function at points in W; shape (..., 2) -> (...)."""
        offset = np.asarray(points, dtype=float) - self.center
        distance = np.hypot(offset[..., 0], offset[..., 1])
        phi = self.phi(np.arctan2(offset[..., 1], offset[..., 0]))
        with np.errstate(divide="ignore", over="ignore", invalid="ignore"):
            return np.where(distance > 0.0, (phi / distance) ** sigma, np.inf)

    def contains(self, points: np.ndarray) -> np.ndarray:
        """Whether points in W are certainly inside; shape (..., 2) -> (...), bool.

        A point is compared with the smaller of the two neighbouring samples, which bounds the free range between them.
        """
        points = np.asarray(points, dtype=float)
        flat = points.reshape(-1, 2)
        inside = [covers(self.center, self.bearing_0, self.boundary.values, x, y) for x, y in flat]
        return np.array(inside).reshape(points.shape[:-1])

    def moved(self, frame: np.ndarray) -> "StarRegion":
        """The same region in another frame, in which this one's origin is at the pose `frame` (x, y, yaw)."""
        center = placed(frame, self.center[None, :])[0]
        return dataclasses.replace(self, center=center, bearing_0=self.bearing_0 + float(frame[2]))

    def outline(self, count: int | None = None) -> np.ndarray:
        """Boundary points in W, shape (about `count`, 2), m; default all M samples."""
        step = 1 if count is None else max(1, math.ceil(len(self.boundary.values) / count))
        phi = self.boundary.values[::step]
        theta = self.bearing_0 + 2.0 * math.pi / len(self.boundary.values) * np.arange(0, len(phi) * step, step)
        return self.center + phi[:, None] * np.column_stack((np.cos(theta), np.sin(theta)))

    def _evaluate(self, theta: np.ndarray | float) -> tuple[np.ndarray, np.ndarray]:
        fit = self.boundary
        samples = len(fit.values)
        position = np.mod((np.asarray(theta, dtype=float) - self.bearing_0) * samples / (2.0 * math.pi), samples)
        position = np.where(position < samples, position, 0.0)  # mod of a tiny negative number rounds up to M
        left = np.floor(position).astype(int)
        right = (left + 1) % samples
        segment = np.searchsorted(fit.starts, left, side="right") - 1
        first = fit.starts[segment]
        last = np.append(fit.starts[1:], samples)[segment] - 1
        half = np.where(last > first, 0.5 * (last - first), 1.0)
        s = (position - 0.5 * (first + last)) / half
        c0, c1, c2, c3 = np.moveaxis(fit.coefficients[segment], -1, 0)
        value = np.maximum(c0 + s * (c1 + s * (c2 + s * c3)), 0.0)
        slope = (c1 + s * (2.0 * c2 + 3.0 * s * c3)) * samples / (2.0 * math.pi * half)
        # no cubic spans the seam between two segments: the smaller of the two samples is the bound
        nearer = np.where(fit.values[left] <= fit.values[right], left, right)
        seam = (left == last) & (position > left)
        return np.where(seam, fit.values[nearer], value), np.where(seam, fit.slopes[nearer], slope)


def fit_region(profile: FreeRange, center: np.ndarray, bearing_0: float, fit: Fit = fit_piecewise_cubic) -> StarRegion:
    """The star-shaped region about `center` in W whose boundary fits a free range, as from `free_range`."""
    return StarRegion(
        center=np.asarray(center, dtype=float),
        bearing_0=bearing_0,
        boundary=fit(profile.values),
        free_range=profile.values,
        limit=profile.limit,
        margin=profile.margin,
    )


def scan_region(
    scan: LaserScan, pose: np.ndarray, radius: float, margins: Margins, samples: int | None = None
) -> StarRegion:
    """The star-shaped region of one scan.

    Args:
        scan: in the sensor frame S, at the robot's centre.
        pose: (x, y, yaw) of S in W when the scan was taken.
        radius: of the robot, m.
        margins: kept, and how ranges are smoothed.
        samples: M, the same for all scans of a roadmap; None: as many as suit this one.
    """
    return smoothed_scan_region(scan, pose, radius, margins, samples)[1]


def smoothed_scan_region(
    scan: LaserScan, pose: np.ndarray, radius: float, margins: Margins, samples: int | None = None
) -> tuple[np.ndarray, StarRegion]:
    """The `smoothed_distances` of a scan, and its `scan_region`: their `free_range`, then `fit_region`, in one call."""
    kept, tables = (margins.preferred, margins.least), bearing_tables(samples or bearing_count(scan))
    distance, profile, boundary = _scan_region(
        scan.beams, field_of_view(scan), radius, kept, margins.smoothing_slack, tables
    )
    center, bearing_0 = np.array(pose[:2], dtype=float), float(pose[2]) + scan.angle_min
    return distance, StarRegion(center, bearing_0, PiecewiseCubic(*boundary), *profile)


@njit(cache=True)
def _scan_region(beams, view, radius, margins, slack, tables):
    """As `disc_range`: the smoothed distances, the fields of the `FreeRange`, and those of the `PiecewiseCubic`."""
    distance = moving_average(beams, SMOOTHING_BEAMS, slack)
    profile = disc_range(beams, distance, view, radius, margins, tables)
    return distance, profile, adaptive_fit(profile[0], TOLERANCE, True)


@dataclass(frozen=True)
class RegionStack:
    """Regions in one set of arrays, oldest first, for compiled loops. Immutable; extension shares memory.

    Attributes:
        center: shape (n, 2), W, m.
        bearing_0: shape (n,), rad.
        values, slopes: shape (n, M), Phi and Phi' at the samples.
        reach: shape (n,), m.
    """

    center: np.ndarray
    bearing_0: np.ndarray
    values: np.ndarray
    slopes: np.ndarray
    reach: np.ndarray
    storage: SharedRows | None = field(default=None, repr=False, compare=False)

    @staticmethod
    def of(regions: "list[StarRegion] | tuple[StarRegion, ...]", samples: int = 0) -> "RegionStack":
        """Stack regions that share one number of samples M (`samples` when there are none)."""
        if not regions:
            return RegionStack(
                np.zeros((0, 2)), np.zeros(0), np.zeros((0, samples)), np.zeros((0, samples)), np.zeros(0)
            )
        return RegionStack(
            center=np.array([r.center for r in regions]),
            bearing_0=np.array([r.bearing_0 for r in regions]),
            values=np.array([r.boundary.values for r in regions]),
            slopes=np.array([r.boundary.slopes for r in regions]),
            reach=np.array([r.reach for r in regions]),
        )

    @staticmethod
    def alone(region: StarRegion) -> "RegionStack":
        """The stack of one region, whose arrays it shares."""
        fit = region.boundary
        return RegionStack(
            region.center[None],
            np.array([region.bearing_0]),
            fit.values[None],
            fit.slopes[None],
            np.array([region.reach]),
        )

    @staticmethod
    def _of_rows(storage: SharedRows) -> "RegionStack":
        center, bearing_0, values, slopes, reach = storage.in_use
        return RegionStack(center, bearing_0, values, slopes, reach, storage)

    def __len__(self) -> int:
        return len(self.reach)

    def appended(self, region: StarRegion) -> "RegionStack":
        """This stack with one more region; memory is shared with `self` if the row behind it is still unused."""
        fit, n = region.boundary, len(self)
        storage = self.storage or SharedRows(self.with_slopes, n)
        row = region.center, region.bearing_0, fit.values, fit.slopes, region.reach
        return RegionStack._of_rows(storage.extended(n, 1, row))

    def selected(self, rows: np.ndarray) -> "RegionStack":
        """A copy of some of the regions; rows of shape (n,). Nothing else uses its memory yet."""
        return RegionStack._of_rows(SharedRows.copied(self.with_slopes, rows))

    def moved(self, frame: np.ndarray) -> "RegionStack":
        """The same regions in another frame, in which this one's origin is at the pose `frame` (x, y, yaw)."""
        center, bearing_0 = placed(frame, self.center), self.bearing_0 + frame[2]
        return dataclasses.replace(self, center=center, bearing_0=bearing_0, storage=None)

    @property
    def arrays(self) -> tuple[np.ndarray, np.ndarray, np.ndarray, np.ndarray]:
        """Arguments of the compiled loops: center, bearing_0, values, reach."""
        return self.center, self.bearing_0, self.values, self.reach

    @property
    def with_slopes(self) -> tuple[np.ndarray, np.ndarray, np.ndarray, np.ndarray, np.ndarray]:
        """All arrays, for the modulation: center, bearing_0, values, slopes, reach."""
        return self.center, self.bearing_0, self.values, self.slopes, self.reach


@leaf
def covers(center, bearing_0, values, x, y):
    """Whether (x, y) is certainly inside the region: below the smaller of the two neighbouring samples."""
    dx, dy = x - center[0], y - center[1]
    squared = dx * dx + dy * dy
    if squared < 1e-12:  # the reference point itself
        return True
    left, right = samples_beside(bearing_0, len(values), dx, dy)
    phi = min(values[left], values[right])
    return squared <= phi * phi


@leaf
def covers_offset(bearing_0, values, k, dx, dy):
    """As `covers`, for region k of a stack and an offset from its centre; no views of arrays, which cost more."""
    squared = dx * dx + dy * dy
    if squared < 1e-12:
        return True
    left, right = samples_beside(bearing_0[k], values.shape[1], dx, dy)
    phi = min(values[k, left], values[k, right])
    return squared <= phi * phi


@leaf
def covers_nearly(center, bearing_0, values, k, dx, dy, slack):
    """As `covers_offset`, but up to `slack` beyond the boundary, m."""
    distance = math.sqrt(dx * dx + dy * dy)
    nearer = max(distance - slack, 0.0) / max(distance, 1e-9)
    dx, dy = center[k, 0] + dx * nearer - center[k, 0], center[k, 1] + dy * nearer - center[k, 1]
    return covers_offset(bearing_0, values, k, dx, dy)


@leaf
def samples_beside(bearing_0, samples, dx, dy):
    """Indices of the two samples beside the direction (dx, dy)."""
    turn = (rough_bearing(dy, dx) - bearing_0) / (2.0 * math.pi)
    position = (turn - math.floor(turn)) * samples
    left = int(position)
    if not ROUGH < position - left < 1.0 - ROUGH:  # rarely: so near to a sample, the side counts
        left = int(math.floor((math.atan2(dy, dx) - bearing_0) * samples / (2.0 * math.pi))) % samples
    return left, left + 1 if left + 1 < samples else 0


@leaf
def rough_bearing(y, x):
    """`atan2` up to 2e-5 rad, several times faster."""
    a, b = abs(x), abs(y)
    if a + b == 0.0:
        return 0.0
    z = min(a, b) / max(a, b)
    s = z * z
    angle = z * (
        0.99997726 + s * (-0.33262347 + s * (0.19354346 + s * (-0.11643287 + s * (0.05265332 - s * 0.0117212))))
    )
    if b > a:
        angle = 0.5 * math.pi - angle
    if x < 0.0:
        angle = math.pi - angle
    return -angle if y < 0.0 else angle


@njit(cache=True)
def first_cover(center, bearing_0, values, reach, x, y):
    """Index of the newest region that contains (x, y), or -1."""
    for k in range(len(reach) - 1, -1, -1):
        dx, dy = x - center[k, 0], y - center[k, 1]
        if dx * dx + dy * dy <= reach[k] * reach[k] and covers_offset(bearing_0, values, k, dx, dy):
            return k
    return -1


@njit(cache=True)
def least_outside(center, bearing_0, values, x, y):
    """Index of the region whose boundary (x, y) exceeds least, along the ray from its centre; the newest of equals."""
    best, least = -1, np.inf
    for k in range(len(center) - 1, -1, -1):
        dx, dy = x - center[k, 0], y - center[k, 1]
        left, right = samples_beside(bearing_0[k], values.shape[1], dx, dy)
        outside = math.hypot(dx, dy) - min(values[k, left], values[k, right])
        if outside < least:
            best, least = k, outside
    return best


@njit(cache=True)
def segment_covered(center, bearing_0, values, reach, x0, y0, x1, y1, step):
    """Whether the straight segment stays inside the union of the regions, sampled every `step` metres."""
    length = math.hypot(x1 - x0, y1 - y0)
    count = int(length / step) + 1
    nearby = np.empty(len(reach), np.int64)
    n = 0
    for k in range(len(reach) - 1, -1, -1):  # regions whose disc of reach touches the segment, newest first
        px, py = center[k, 0] - x0, center[k, 1] - y0
        t = 0.0
        if length > 1e-12:  # so that its square does not underflow
            t = (px * (x1 - x0) + py * (y1 - y0)) / (length * length)
            t = min(max(t, 0.0), 1.0)
        px -= t * (x1 - x0)
        py -= t * (y1 - y0)
        if px * px + py * py <= reach[k] * reach[k]:
            nearby[n] = k
            n += 1
    last = -1
    for i in range(count + 1):
        x = x0 + (x1 - x0) * i / count
        y = y0 + (y1 - y0) * i / count
        if last >= 0 and covers_offset(bearing_0, values, last, x - center[last, 0], y - center[last, 1]):
            continue
        last = -1
        for j in range(n):
            k = nearby[j]
            dx, dy = x - center[k, 0], y - center[k, 1]
            if dx * dx + dy * dy <= reach[k] * reach[k] and covers_offset(bearing_0, values, k, dx, dy):
                last = k
                break
        if last < 0:
            return False
    return True
