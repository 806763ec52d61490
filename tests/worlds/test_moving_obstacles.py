"""Discs on paths: where they are when, how fast, and how near."""

import numpy as np
import pytest
import shapely
from hypothesis import given
from hypothesis import strategies as st

from drake_starnav.errors import StarnavError
from drake_starnav.geometry.footprint import covered, disc, footprint
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


@given(st.floats(0.0, 7.98))
def test_velocity_is_the_derivative(time: float) -> None:
    step = 1e-3
    positions, velocities = moving_obstacle_states(MovingObstacles([0.3], (SQUARE,)), np.array([time, time + step]))
    legs = np.searchsorted(SQUARE[:, 0], [time, time + step], side="right")
    if legs[0] == legs[1]:
        assert (positions[1] - positions[0]) / step == pytest.approx(velocities[0], abs=1e-9)


def test_clearance_is_to_the_nearest_rim_at_that_time() -> None:
    poses = np.array([(0.5, 0.0, 1.0), (0.5, 0.0, 2.0), (4.0, 2.0, 0.0)])
    times = np.array([1.0, 5.0, 4.0])
    assert moving_obstacle_clearance(BOTH, poses, times) == pytest.approx([-0.3, 0.7, 0.5])
    assert moving_obstacle_clearance(MovingObstacles(), poses, times).tolist() == [np.inf] * 3


@given(st.integers(0, 2**32 - 1))
def test_clearance_of_a_footprint_is_that_of_all_its_points(seed: int) -> None:
    """Against shapely; of parts that overlap or stand apart, and of discs around a corner or inside."""
    rng = np.random.default_rng(seed)
    parts = [shapely.MultiPoint(rng.uniform(-0.5, 0.5, (6, 2))).convex_hull for _ in range(rng.integers(1, 4))]
    body = footprint(tuple(tuple(map(tuple, shapely.get_coordinates(part)[:-1].tolist())) for part in parts))
    poses, times = rng.uniform(-1.5, 1.5, (8, 3)) * (1.0, 1.0, 4.0), rng.uniform(0.0, 10.0, 8)
    places, _ = moving_obstacle_states(BOTH, times)
    found = moving_obstacle_clearance(BOTH, poses, times, body)
    for pose, near, least in zip(poses, places, found, strict=True):
        away = [covered(body, pose).distance(shapely.Point(place)) for place in near]
        expected = min(a - r for a, r in zip(away, BOTH.radii, strict=True))
        assert least == pytest.approx(expected, abs=1e-9) or (min(away) == 0.0 and least <= expected)
    np.testing.assert_allclose(
        moving_obstacle_clearance(BOTH, poses, times, disc(0.2)), moving_obstacle_clearance(BOTH, poses, times) - 0.2
    )


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
