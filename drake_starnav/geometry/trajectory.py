"""A robot's trajectory: its poses over time."""

import itertools
import math
from collections.abc import Sequence

import numpy as np

from drake_starnav.geometry.footprint import Footprint, covered
from drake_starnav.utils.snapshot import snapshot

GAP_PERIOD = 0.05
"""Gaps between robots are measured at equal steps of this length, s."""


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


def evenly_sampled(times: np.ndarray, values: np.ndarray, period: float) -> np.ndarray:
    """Values at equal steps of time, interpolated linearly.

    Args:
        times: of the values, shape (n,), increasing, s.
        values: shape (n, m).
        period: between two samples, s.

    Returns:
        Shape (k, m): at the first time and every `period` after it, up to the last time.
    """
    count = int((times[-1] - times[0]) / period + 1e-9) + 1
    even = times[0] + period * np.arange(count)
    return np.column_stack([np.interp(even, times, column) for column in values.T])


def least_gaps(footprints: Sequence[Footprint], motions: Sequence[Motion]) -> list[float]:
    """The least distance of each robot's footprint to another one during a run, m; 0 if they overlap.

    Args:
        footprints: of the robots.
        motions: of each.
    """
    times = np.arange(0.0, max(motion.duration for motion in motions), GAP_PERIOD)
    areas = [
        [covered(footprint, motion.at(float(t))) for t in times]
        for footprint, motion in zip(footprints, motions, strict=True)
    ]
    least = [math.inf] * len(footprints)
    for i, j in itertools.combinations(range(len(footprints)), 2):
        gap = min(a.distance(b) for a, b in zip(areas[i], areas[j], strict=True))
        least[i], least[j] = min(least[i], gap), min(least[j], gap)
    return least
