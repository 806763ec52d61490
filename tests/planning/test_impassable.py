import numpy as np
from hypothesis import given

from drake_starnav.geometry.se2 import transform_points
from drake_starnav.planning.impassable import BRIDGE_SPACING, bridge_observed_hits, find_narrowest_gap
from drake_starnav.worlds.world import World
from tests.helpers.scans import MARGINS, RADIUS, cast, observed, seeds

POSE = np.array((1.0, -0.5, 0.4))
WALL = transform_points(POSE, np.array([(0.5, 0.3), (4.9, 0.3), (4.9, 0.35), (0.5, 0.35)]))
"""Seen at a grazing angle, so that its hits are far apart."""


def test_a_wall_is_closed_between_hits_that_the_robot_does_not_fit_between() -> None:
    scan = cast(World("wall", (0, 0, 0), (0, 0), polygons=(WALL,)), POSE)
    hits, points = scan.points(POSE), bridge_observed_hits(observed(scan, POSE), MARGINS, RADIUS)
    assert len(points) > len(hits)
    start, along = WALL[0], (WALL[1] - WALL[0]) / np.hypot(*(WALL[1] - WALL[0]))
    seen, closed = (np.sort((places - start) @ along) for places in (hits, points))
    gaps = np.diff(seen)
    assert gaps.max() > 2.0 * RADIUS  # farther away the robot may fit
    for low, high in zip(seen[:-1], seen[1:], strict=True):
        inside = closed[(closed >= low - 0.02) & (closed <= high + 0.02)]
        if BRIDGE_SPACING * 2.0 * RADIUS + 0.02 < high - low < 2.0 * RADIUS - 0.02:
            assert np.diff(inside).max() <= BRIDGE_SPACING * 2.0 * RADIUS + 0.02
        elif high - low > 2.0 * RADIUS + 0.02:
            assert np.diff(inside).max() > 2.0 * RADIUS - 0.04


def crosses(p: np.ndarray, q: np.ndarray, way: np.ndarray) -> bool:
    """Whether the segment from p to q crosses a way (k, 2): both parameters of the crossing lie in [0, 1]."""
    for a, b in zip(way[:-1], way[1:], strict=True):
        t, u = np.linalg.solve(np.column_stack((q - p, a - b)), a - p)
        if 0.0 <= t <= 1.0 and 0.0 <= u <= 1.0:
            return True
    return False


@given(seeds)
def test_the_narrowest_gap_lies_between_the_nearest_points_across_the_way(seed: int) -> None:
    rng = np.random.default_rng(seed)
    points, way = rng.uniform(-1.0, 1.0, (12, 2)), rng.uniform(-1.0, 1.0, (4, 2))
    pairs = [(p, q) for k, p in enumerate(points) for q in points[:k] if crosses(p, q, way)]
    width = rng.uniform(0.2, 1.5)
    nearest = min(pairs, key=lambda pair: np.hypot(*(pair[1] - pair[0])), default=None)
    found = find_narrowest_gap(points, way, width)
    if nearest is None or np.hypot(*(nearest[1] - nearest[0])) >= width:
        assert found is None
    else:
        assert {tuple(end) for end in found} == {tuple(end) for end in nearest}
