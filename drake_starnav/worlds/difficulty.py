"""How difficult a world is, measured on its shortest path."""

import math

import numpy as np

from drake_starnav.geometry.polyline import resampled
from drake_starnav.geometry.raycast import Fan, cast_grid
from drake_starnav.worlds.view import visible_shapes
from drake_starnav.worlds.world import World

STEP = 0.1
"""The width is measured this often along the path, m."""
BEAMS = 180
"""Half of them give the directions in which it is measured: one for each 2 degrees."""
FARTHEST = 20.0
"""What is farther away does not narrow anything, m."""


def tightest_gap(world: World, path: np.ndarray) -> float:
    """The least width of the free space along a path (n, 2), m, W, outside of all obstacles: of all straight lines
    through its points, the shortest between two obstacles, m; infinite where nothing stands on both sides.

    Source: the characteristic dimension of D. Perille et al., Benchmarking metric ground navigation, 2020.
    """
    shapes, fan, least = visible_shapes(world), Fan.regular(-math.pi, 2.0 * math.pi / BEAMS, BEAMS), math.inf
    for x, y in resampled(path, STEP):
        ranges = np.full(BEAMS, np.inf)
        cast_grid(shapes, np.array((x, y, 0.0)), fan, ranges, FARTHEST)
        ranges[ranges >= FARTHEST] = np.inf
        least = min(least, float((ranges[: BEAMS // 2] + ranges[BEAMS // 2 :]).min()))
    return least
