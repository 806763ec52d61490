"""A robot's trajectory: its poses over time, and metrics beside its outcome.

Metrics take samples at equal time steps. Speeds are first averaged over windows of `WINDOW`: wheel servo and contact
solver add a small ripple at every step, which derivatives would amplify.
"""

import itertools
import math
from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from drake_starnav.geometry.footprint import Footprint, find_covered_area, find_top_speed
from drake_starnav.utils.snapshot import snapshot

WINDOW = 0.1
"""Speeds are averaged over this time, s; an incomplete window at the end is dropped."""
STANDING, DRIVING = 0.02, 0.1
"""A robot stands if no point of it is faster than the first speed; if one is faster than the second it drives, m/s."""
STUCK_RADIUS, STUCK_TIME = 0.25, 5.0
"""A robot is stuck if it stays within this distance of a place for at least this time, m and s."""


@snapshot
class Motion:
    """The poses of a robot during a run.

    Attributes:
        times: shape (n,), increasing, s.
        poses: shape (n, 3): x, y, yaw in W, m and rad.
    """

    times: np.ndarray
    poses: np.ndarray

    @property
    def duration(self) -> float:
        """Time of the last pose, s."""
        return float(self.times[-1])

    def at(self, time: float) -> np.ndarray:
        """The pose at a time, shape (3,); constant before the first and after the last time."""
        turning = np.unwrap(self.poses[:, 2])
        return np.array([np.interp(time, self.times, track) for track in (*self.poses[:, :2].T, turning)])


def sample_evenly(times: np.ndarray, values: np.ndarray, period: float) -> np.ndarray:
    """Values (n, m) at times (n,), s, interpolated at the first time and every `period` after it, shape (k, m)."""
    count = int((times[-1] - times[0]) / period + 1e-9) + 1
    even = times[0] + period * np.arange(count)
    return np.column_stack([np.interp(even, times, column) for column in values.T])


def select_samples(times: np.ndarray, points: np.ndarray, tolerance: float) -> np.ndarray:
    """Return the indices of samples that suffice: what is interpolated between them is nowhere off by more, at no time.

    `times` has shape (n,), s, `points` (n, 2), m, as `tolerance`.

    Source: N. Meratnia, R. A. de By, Spatiotemporal compression techniques for moving point objects, 2004.
    """
    kept_indices, parts = {0, len(times) - 1}, [(0, len(times) - 1)]
    while parts:
        first, last = parts.pop()
        if last - first < 2:
            continue
        share = (times[first:last] - times[first]) / max(times[last] - times[first], 1e-9)
        deviation = np.hypot(*(points[first:last] - points[first] - share[:, None] * (points[last] - points[first])).T)
        if deviation.max() > tolerance:
            middle = first + int(deviation.argmax())
            kept_indices.add(middle)
            parts += [(first, middle), (middle, last)]
    return np.array(sorted(kept_indices))


def find_least_gaps(footprints: Sequence[Footprint], motions: Sequence[Motion]) -> list[float]:
    """The least distance of each robot's footprint to another one during a run, m; 0 if they overlap."""
    times = np.arange(0.0, max(motion.duration for motion in motions), 0.05)
    areas = [
        [find_covered_area(footprint, motion.at(float(t))) for t in times]
        for footprint, motion in zip(footprints, motions, strict=True)
    ]
    least = [math.inf] * len(footprints)
    for i, j in itertools.combinations(range(len(footprints)), 2):
        gap = min(a.distance(b) for a, b in zip(areas[i], areas[j], strict=True))
        least[i], least[j] = min(least[i], gap), min(least[j], gap)
    return least


@dataclass(frozen=True)
class MotionMetrics:
    """Metrics for comparing controllers; except for the clearance, smaller is better.

    Attributes:
        mean_clearance_m: distance of the hull from the nearest obstacle, mean over time; infinite without obstacles.
        jerk_mps3: root mean square of the forward speed's second derivative.
        yaw_rate_change_radps2: mean absolute derivative of the yaw rate.
        twist_energy_m2ps: integral over time of v^2 + (radius omega)^2/2, twice the kinetic energy of a disc per mass.
        stops: number of times the robot came to a stop after driving.
        stuck_s: time spent stuck.
    """

    mean_clearance_m: float
    jerk_mps3: float
    yaw_rate_change_radps2: float
    twist_energy_m2ps: float
    stops: int
    stuck_s: float


def compute_motion_metrics(
    positions: np.ndarray, twists: np.ndarray, clearances: np.ndarray, *, time_step: float, footprint: Footprint
) -> MotionMetrics:
    """All metrics of one trajectory.

    Positions are of the robot's centre, shape (n, 2), W, m; twists (v, omega), shape (n, 2), m/s and rad/s; clearances
    of its footprint, shape (n,), m; `time_step` is from sample to sample, s.
    """
    count = max(round(WINDOW / time_step), 1)
    v, omega = compute_window_means(twists[:, 0], count), compute_window_means(twists[:, 1], count)
    window = count * time_step
    jerk, yaw_rate_change = np.diff(v, 2) / window**2, np.diff(omega) / window
    return MotionMetrics(
        mean_clearance_m=float(clearances.mean()),
        jerk_mps3=float(np.sqrt(np.mean(jerk**2))) if len(jerk) else 0.0,
        yaw_rate_change_radps2=float(np.abs(yaw_rate_change).mean()) if len(yaw_rate_change) else 0.0,
        twist_energy_m2ps=float((v @ v + 0.5 * footprint.radius**2 * (omega @ omega)) * window),
        stops=count_stops(find_top_speed(v, omega, footprint.lever)),
        stuck_s=sum_time_stuck(positions[::count], window),
    )


def compute_window_means(values: np.ndarray, count: int) -> np.ndarray:
    """Means of consecutive groups of `count` values; an incomplete group at the end is dropped."""
    samples_per_window = len(values) // count
    return values[: samples_per_window * count].reshape(samples_per_window, count).mean(axis=1)


def count_stops(speed: np.ndarray) -> int:
    """Number of times the fastest point's speed (n,) fell below STANDING after it had risen above DRIVING, m/s."""
    clear = speed[(speed < STANDING) | (speed > DRIVING)]  # speeds in between change nothing
    return int(np.count_nonzero((clear[:-1] > DRIVING) & (clear[1:] < STANDING)))


def sum_time_stuck(positions: np.ndarray, time_step: float) -> float:
    """Total time of the intervals of at least STUCK_TIME in which the robot stays within STUCK_RADIUS of their start.

    An interval of the positions (n, 2) begins where the one before ended, as in Nav2's `SimpleProgressChecker`.
    """
    total, begin = 0.0, 0
    for k in range(1, len(positions) + 1):
        if k < len(positions) and math.dist(positions[begin], positions[k]) <= STUCK_RADIUS:
            continue
        stuck_time = (k - 1 - begin) * time_step
        total += stuck_time if stuck_time >= STUCK_TIME - 1e-9 else 0.0
        begin = k
    return total
