"""Discs on paths: where they are when, how fast, and how near."""

import numpy as np
import pytest

from drake_starnav.errors import StarnavError
from drake_starnav.worlds.moving_obstacles import MovingObstacles, moving_obstacle_states

SQUARE = np.array([(0.0, 0.0, 0.0), (2.0, 1.0, 0.0), (3.0, 1.0, 1.0), (7.0, 0.0, 1.0), (8.0, 0.0, 0.0)])
LINE = np.array([(0.0, -1.0, 2.0), (5.0, 4.0, 2.0)])
BOTH = MovingObstacles([0.3, 0.5], (SQUARE, LINE))


def test_moves_evenly_between_way_points() -> None:
    positions, velocities = moving_obstacle_states(BOTH, np.array([0.0, 1.0, 2.0, 2.5, 5.0]))
    assert positions[:, 0] == pytest.approx(np.array([(0.0, 0.0), (0.5, 0.0), (1.0, 0.0), (1.0, 0.5), (0.5, 1.0)]))
    assert velocities[:, 0] == pytest.approx(np.array([(0.5, 0.0), (0.5, 0.0), (0.0, 1.0), (0.0, 1.0), (-0.25, 0.0)]))
    assert positions[3, 1] == pytest.approx((1.5, 2.0))


def test_top_speed() -> None:
    assert BOTH.max_speed == pytest.approx(1.0)
    assert MovingObstacles().max_speed == 0.0


@pytest.mark.parametrize(
    ("radii", "paths", "message"),
    [
        ([0.3], (), "1 radii for 0 paths; allowed: one for each"),
        ([0.0], (LINE,), r"radii\[0\] is 0; allowed: 0 < x m"),
        ([0.3, np.nan], (LINE, LINE), r"radii\[1\] is nan"),
        ([0.3], (LINE[:1],), r"paths\[0\] is .* two or more finite \[time, x, y\]"),
        ([0.3], (LINE + (0.0, np.nan, 0.0),), r"paths\[0\] is"),
        ([0.3], (LINE + (1.0, 0.0, 0.0),), r"the times of paths\[0\] are \[1.0, 6.0\]; allowed: 0, then more"),
        ([0.3], (LINE * (0.0, 1.0, 1.0),), "allowed: 0, then more"),
    ],
)
def test_nonsense_is_refused(radii, paths, message: str) -> None:
    with pytest.raises(StarnavError, match=message):
        MovingObstacles(radii, paths)
