"""Discs on paths: where they are when, how fast, and how near."""

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from drake_starnav.errors import StarnavError
from drake_starnav.worlds.moving_obstacles import (
    MovingObstacles,
    moving_obstacle_clearance,
    moving_obstacle_states,
)

SQUARE = np.array([(0.0, 0.0, 0.0), (2.0, 1.0, 0.0), (3.0, 1.0, 1.0), (7.0, 0.0, 1.0), (8.0, 0.0, 0.0)])
LINE = np.array([(0.0, -1.0, 2.0), (5.0, 4.0, 2.0)])
BOTH = MovingObstacles([0.3, 0.5], (SQUARE, LINE))


def test_moves_evenly_between_way_points() -> None:
    positions, velocities = moving_obstacle_states(BOTH, np.array([0.0, 1.0, 2.0, 2.5, 5.0]))
    assert positions[:, 0] == pytest.approx(np.array([(0.0, 0.0), (0.5, 0.0), (1.0, 0.0), (1.0, 0.5), (0.5, 1.0)]))
    assert velocities[:, 0] == pytest.approx(np.array([(0.5, 0.0), (0.5, 0.0), (0.0, 1.0), (0.0, 1.0), (-0.25, 0.0)]))
    assert positions[3, 1] == pytest.approx((1.5, 2.0))


@given(st.floats(0.0, 7.9), st.integers(0, 50))
def test_a_path_repeats(time: float, rounds: int) -> None:
    for moving_obstacles in (MovingObstacles([0.3], (SQUARE,)), MovingObstacles([0.3], (LINE,))):
        period = moving_obstacles.paths[0][-1, 0]
        first, again = (
            moving_obstacle_states(moving_obstacles, np.array([t]))[0]
            for t in (time % period, time % period + rounds * period)
        )
        gap = np.abs(first - again).max()
        assert gap < 1e-9 or abs(time % period - period) < 1e-9 or abs(time % period) < 1e-9


def test_clearance_is_to_the_nearest_rim_at_that_time() -> None:
    poses = np.array([(0.5, 0.0, 1.0), (0.5, 0.0, 2.0), (4.0, 2.0, 0.0)])
    times = np.array([1.0, 5.0, 4.0])
    assert moving_obstacle_clearance(BOTH, poses, times) == pytest.approx([-0.3, 0.7, 0.5])
    assert moving_obstacle_clearance(MovingObstacles(), poses, times).tolist() == [np.inf] * 3


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
