import numpy as np

from drake_starnav.geometry.se2 import placed
from drake_starnav.planning.impassable import BRIDGE_SPACING, impassable_points
from drake_starnav.worlds.world import World
from tests.helpers.scans import MARGINS, RADIUS, cast

POSE = np.array((1.0, -0.5, 0.4))
WALL = placed(POSE, np.array([(0.5, 0.3), (4.9, 0.3), (4.9, 0.35), (0.5, 0.35)]))
"""Seen at a grazing angle, so that its hits are far apart."""


def test_a_wall_is_closed_between_hits_that_the_robot_does_not_fit_between() -> None:
    scan = cast(World("wall", (0, 0, 0), (0, 0), polygons=(WALL,)), POSE)
    hits, points = scan.points(POSE), impassable_points(scan, POSE, MARGINS, RADIUS)
    assert len(points) > len(hits)
    start, along = WALL[0], (WALL[1] - WALL[0]) / np.hypot(*(WALL[1] - WALL[0]))
    seen, closed = (np.sort((places - start) @ along) for places in (hits, points))
    gaps = np.diff(seen)
    assert gaps.max() > 2.0 * RADIUS  # farther away the robot may fit
    for low, high in zip(seen[:-1], seen[1:], strict=True):
        inside = closed[(closed >= low - 0.02) & (closed <= high + 0.02)]
        if BRIDGE_SPACING + 0.02 < high - low < 2.0 * RADIUS - 0.02:
            assert np.diff(inside).max() <= BRIDGE_SPACING + 0.02
        elif high - low > 2.0 * RADIUS + 0.02:
            assert np.diff(inside).max() > 2.0 * RADIUS - 0.04
