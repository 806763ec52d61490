"""The least clearance along many poses, most of which need not be compared with the world."""

import numpy as np

from drake_starnav.geometry.footprint import Footprint
from drake_starnav.worlds.clearance import body_clearance
from drake_starnav.worlds.world import World

STRIDE = 32
"""So many poses are between those that are compared with the world first; most of them need not be compared then."""


def least_clearance(world: World, poses: np.ndarray, footprint: Footprint, known: float) -> tuple[float, int]:
    """The least of a clearance that is known and the true shape's at poses (n, 3), m, and the index of its pose or -1.

    A pose is left out only if the robot cannot have come nearer than `known` on its way from a pose that was compared.
    """
    steps = np.diff(poses, axis=0)
    way = np.concatenate(([0.0], np.cumsum(np.hypot(*steps[:, :2].T) + footprint.lever * abs(steps[:, 2]))))
    clear, at = np.full(len(poses), np.nan), -1
    ends = np.unique(np.append(np.arange(0, len(poses), STRIDE), len(poses) - 1))
    compared, first, last = ends, ends[:-1], ends[1:]
    while True:
        clear[compared] = body_clearance(world, poses[compared], footprint)
        least = compared[np.argmin(clear[compared])]
        if clear[least] < known:
            known, at = float(clear[least]), int(least)
        near = (0.5 * (clear[first] + clear[last] - way[last] + way[first]) < known) & (last - first > 1)
        if not near.any():
            return known, at
        first, last = first[near], last[near]
        compared = (first + last) // 2
        first, last = np.concatenate((first, compared)), np.concatenate((compared, last))
