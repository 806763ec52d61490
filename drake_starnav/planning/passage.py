"""Tight passages: where hits on both sides of the path are nearer together than the robot turns."""

import math
from typing import NamedTuple

import numpy as np
from numba import njit

from drake_starnav.geometry.footprint import Footprint

AHEAD = 1.3
"""Passages are looked for so far along the path, m."""
SPACING = 0.04
"""Distance between two places of the path that are looked at, m."""
ROOMY = 0.12
"""A passage wider than the narrowest disc of the robot by this is not tight, m."""


class Passage(NamedTuple):
    """The narrowest place between two hits.

    Attributes:
        x, y: its middle, W, m.
        yaw: of its axis, in the direction of the path, rad.
        width: between the hits, m.
    """

    x: float
    y: float
    yaw: float
    width: float

    def along(self, pose: np.ndarray) -> float:
        """How far a pose is beyond the middle, along the axis, m."""
        return math.cos(self.yaw) * (pose[0] - self.x) + math.sin(self.yaw) * (pose[1] - self.y)

    def aside(self, pose: np.ndarray) -> float:
        """How far a pose is to the left of the axis, m."""
        return math.cos(self.yaw) * (pose[1] - self.y) - math.sin(self.yaw) * (pose[0] - self.x)

    def at(self, along: float) -> tuple[float, float]:
        """The place on the axis so far beyond the middle, W, m."""
        return self.x + along * math.cos(self.yaw), self.y + along * math.sin(self.yaw)


def tight_passage(
    pose: np.ndarray, path: np.ndarray, hits: np.ndarray, footprint: Footprint, margin: float
) -> Passage | None:
    """The first passage on the path that the robot enters only if it is aligned, until it is through; None without.

    Args:
        pose: (x, y, yaw) of the robot, W.
        path: shape (k, 2), way points ahead, W, m.
        hits: shape (n, 2), W, m.
        footprint: of the robot, no disc.
        margin: that the certificate keeps, m.
    """
    if not len(path) or not len(hits):
        return None
    outline = footprint.outline
    front, back = float(outline[:, 0].max()), float(outline[:, 0].min())
    near = hits[np.hypot(*(hits - pose[:2]).T) < AHEAD + footprint.radius]
    found = Passage(*_tight_passage(path, pose[0], pose[1], near, 2.0 * footprint.radius, 0.5 * (front - back)))
    narrowest = float((footprint.polygons.offsets).min())
    fits = 2.0 * (min(narrowest, footprint.narrow) + margin) < found.width < 2.0 * footprint.narrow + ROOMY
    return found if fits and found.along(pose) < -back else None


@njit(cache=True)
def _tight_passage(path, x, y, hits, wide, half):
    """The fields of the first `Passage` narrower than `wide` between hits within `half` along the path; 0 without."""
    gone = 0.0
    for k in range(len(path)):
        dx, dy = path[k, 0] - x, path[k, 1] - y
        length = math.hypot(dx, dy)
        if length < 1e-6:
            continue
        dx, dy = dx / length, dy / length
        for n in range(int(min(length, AHEAD - gone) / SPACING) + 1):
            px, py = x + dx * n * SPACING, y + dy * n * SPACING
            left, right, width = _sides(px, py, dx, dy, hits, half)
            if width >= wide:
                continue
            for _ in range(3):  # the tightest pair hereabouts
                if width < 1e-6:
                    break
                px, py = 0.5 * (hits[left, 0] + hits[right, 0]), 0.5 * (hits[left, 1] + hits[right, 1])
                dx, dy = (hits[left, 1] - hits[right, 1]) / width, (hits[right, 0] - hits[left, 0]) / width
                beside = _sides(px, py, dx, dy, hits, np.inf)
                if beside[2] == np.inf:
                    break
                left, right, width = beside
            dx, dy = hits[left, 1] - hits[right, 1], hits[right, 0] - hits[left, 0]
            px, py = 0.5 * (hits[left, 0] + hits[right, 0]), 0.5 * (hits[left, 1] + hits[right, 1])
            return px, py, math.atan2(dy, dx), width
        gone += length
        if gone > AHEAD:
            break
        x, y = path[k, 0], path[k, 1]
    return 0.0, 0.0, 0.0, 0.0


@njit(cache=True)
def _sides(x, y, dx, dy, hits, half):
    """The nearest hits left and right of a place on a line, within `half` along it, and how far apart they are, m.

    -1 without, and infinitely far apart.
    """
    left = right = -1
    left_away = right_away = np.inf
    for j in range(len(hits)):
        ex, ey = hits[j, 0] - x, hits[j, 1] - y
        aside, away = dx * ey - dy * ex, math.hypot(ex, ey)
        if abs(ex * dx + ey * dy) > half:
            continue
        if aside > 0.0 and away < left_away:
            left, left_away = j, away
        elif aside < 0.0 and away < right_away:
            right, right_away = j, away
    if left < 0 or right < 0:
        return left, right, np.inf
    return left, right, math.hypot(hits[left, 0] - hits[right, 0], hits[left, 1] - hits[right, 1])
