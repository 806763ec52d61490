"""The fastest path keeps clear of walls, prefers room to short cuts, and gives up narrow places that do not work."""

import math

import numpy as np
import pytest
from hypothesis import given, settings

from drake_starnav.planning.cost_field import DistanceGrid
from drake_starnav.planning.fastest_path import (
    PATH_LENGTH,
    PATIENCE,
    SPARE,
    ProgressMonitor,
    fastest_path,
    narrowest_place,
)
from drake_starnav.robot import RobotParameters
from tests.helpers.scans import seeds

ROBOT = RobotParameters(radius=0.334, max_speed=2.0, close_speed=0.8, speed_per_clearance=4.0)
CELL = 0.03
START, GOAL = np.array((0.0, 0.0)), np.array((3.0, 0.0))
NONE = np.zeros((0, 2))


def memory(*points: np.ndarray) -> DistanceGrid:
    return DistanceGrid.empty(CELL, ROBOT.radius, 0.3).stamped(np.vstack((NONE, *points)))


def wall(x: float, y0: float, y1: float) -> np.ndarray:
    y = np.arange(y0, y1, 0.02)
    return np.column_stack((np.full(len(y), x), y))


def path_of(
    hits: DistanceGrid, stall_points: np.ndarray = NONE, robot: RobotParameters = ROBOT
) -> tuple[np.ndarray, float]:
    return fastest_path(hits, START, GOAL, np.minimum(START, GOAL), np.maximum(START, GOAL), stall_points, robot)


def test_where_nothing_is_known_it_is_the_straight_line():
    path, to_go = path_of(memory())
    assert to_go == pytest.approx(3.0, abs=CELL)
    assert np.abs(path[:, 1]).max() <= CELL
    assert np.hypot(*(path[-1] - GOAL)) <= CELL


def test_it_is_only_made_as_long_as_needed():
    path, to_go = fastest_path(memory(), START, np.array((9.0, 0.0)), START, np.array((9.0, 0.0)), NONE, ROBOT)
    assert to_go == pytest.approx(9.0, abs=CELL)
    assert np.hypot(*np.diff(path, axis=0).T).sum() <= 1.5 * PATH_LENGTH
    assert path[-1, 0] > 0.9 * PATH_LENGTH


@settings(max_examples=25)
@given(seeds)
def test_the_robot_touches_no_hit_along_it(seed):
    rng = np.random.default_rng(seed)
    hits = rng.uniform((-1.0, -2.0), (4.0, 2.0), (25, 2))
    hits = hits[(np.hypot(*(hits - START).T) > 0.5) & (np.hypot(*(hits - GOAL).T) > 0.5)]
    path, to_go = path_of(memory(hits))
    assert len(path) and to_go >= 3.0 - 2 * CELL
    away = np.hypot(*np.moveaxis(path[:, None] - hits, -1, 0)).min()
    assert away >= ROBOT.radius + SPARE - 1e-6
    assert np.hypot(*np.diff(path, axis=0).T).max() <= 1.5 * CELL


@pytest.mark.parametrize(("gap", "passes"), [(2 * 0.334 - 0.02, False), (2 * 0.334 + 0.06, True)])
def test_it_takes_the_gap_that_the_robot_fits_through(gap, passes):
    barrier = memory(wall(1.5, -2.0, -gap / 2), wall(1.5, gap / 2, 2.0))
    path, to_go = path_of(barrier)
    assert (np.abs(path[:, 1]).max() < 0.2) == passes
    assert (to_go < 4.5) == passes


def test_a_wide_detour_beats_a_narrow_short_cut_where_clearance_limits_the_speed():
    barrier = memory(wall(1.5, -0.7, -0.35), wall(1.5, 0.35, 0.7))
    straight, _ = path_of(barrier, robot=RobotParameters(radius=0.334, max_speed=2.0))
    fast, to_go = path_of(barrier)
    assert np.abs(straight[:, 1]).max() < 0.2
    assert to_go > 3.0
    slow = RobotParameters(radius=0.334, max_speed=2.0, close_speed=0.1, speed_per_clearance=6.0)
    assert np.abs(path_of(barrier, robot=slow)[0][:, 1]).max() > 0.7


def test_a_goal_behind_walls_has_no_path():
    ring = GOAL + 0.6 * np.column_stack((np.cos(np.arange(0, 6.3, 0.05)), np.sin(np.arange(0, 6.3, 0.05))))
    path, to_go = path_of(memory(ring))
    assert not len(path) and to_go == math.inf


def test_a_goal_too_near_a_wall_is_approached():
    path, _ = path_of(memory(wall(3.2, -0.5, 0.5)))
    assert 0.1 < np.hypot(*(path[-1] - GOAL)) < 0.25


def test_a_shut_place_is_avoided():
    barrier = memory(wall(1.5, -2.0, -0.4), wall(1.5, 0.4, 2.0))
    straight, _ = path_of(barrier)
    place = narrowest_place(barrier, straight[10:], ROBOT.radius)
    assert place is None, "it is more than NARROWEST_WITHIN ahead"
    near = straight[np.hypot(*(straight - (1.3, 0.0)).T) < 0.5]
    tight = memory(wall(1.5, -2.0, -0.36), wall(1.5, 0.36, 2.0))
    place = narrowest_place(tight, near, ROBOT.radius)
    np.testing.assert_allclose(place, (1.5, 0.0), atol=2 * CELL)
    round_about, _ = path_of(barrier, stall_points=place[None])
    assert np.abs(round_about[:, 1]).max() > 0.4


def test_progress_is_missed_only_after_a_while():
    watch, stalled = ProgressMonitor().watched(5.0, 0.0)
    assert not stalled
    for time in (0.5, 1.0, PATIENCE):
        watch, stalled = watch.watched(4.95, time)
        assert not stalled
    watch, stalled = watch.watched(4.95, PATIENCE + 0.01)
    assert stalled
    watch, stalled = watch.watched(4.95, PATIENCE + 0.02)
    assert not stalled and watch.best == 4.95, "the next one has the same time"
    watch, stalled = watch.watched(9.0, 5.0)
    assert not stalled and watch.best == 9.0, "a new way is no standstill"
