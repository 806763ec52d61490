"""What stays is never taken to move, and what moves is noticed."""

import math
from collections.abc import Callable, Iterator

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from drake_starnav.lidar.field_of_view import FieldOfView
from drake_starnav.lidar.laser_scan import DYNAMIC, STATIC, UNKNOWN
from drake_starnav.moving.occupancy_history import (
    CELL,
    NEVER,
    RANGE_SLACK,
    STANDING_AFTER,
    OccupancyHistory,
    _make_extremes,
    _note_free_cells,
)
from drake_starnav.moving.parameters import DynamicObstacleParameters
from tests.helpers.scans import scattered, seeds
from tests.helpers.scenes import PERIOD, Scene, hall, moved, straight

OBSTACLES = DynamicObstacleParameters(max_speed=1.0)
NOTHING = np.zeros(360, bool)
"""No hit is on a surface too large to move."""


@settings(max_examples=15, deadline=None)
@given(seed=seeds)
def test_in_a_static_world_hardly_a_beam_moves_for_a_moving_robot_with_noise(seed: int) -> None:
    """Noise has no bound: a beam that grazes an edge may be misclassified, but fewer than one in a thousand are."""
    rng = np.random.default_rng(seed)
    world = Scene(scattered(rng), (), lambda t: np.zeros((0, 2)))
    pose, twist = np.zeros(3), np.array((rng.uniform(0.1, 0.3), rng.uniform(-1.0, 1.0)))
    grid = OccupancyHistory.make_around(pose[:2], 6.0)
    shares = []
    for k in range(60):
        scan = world.scan(k * PERIOD, pose, rng)
        shares.append(float(np.mean(grid.classify_beams(scan, pose, NOTHING, OBSTACLES).motion == DYNAMIC)))
        grid = grid.add_scan(scan, pose, NOTHING)
        pose = moved(pose, twist, PERIOD)
    assert np.mean(shares) < 1e-3


def test_what_stays_is_known_after_a_while_and_a_wall_at_once() -> None:
    scene = Scene(hall((1.5, 0.0, 0.2)), (), lambda t: np.zeros((0, 2)))
    grid = OccupancyHistory.make_around(np.zeros(2), 6.0)
    pose = np.zeros(3)
    column = np.abs(scene.scan(0.0, pose).bearings) < math.asin(0.2 / 1.5)
    for k in range(math.ceil(STANDING_AFTER / PERIOD) + 1):
        scan = scene.scan(k * PERIOD, pose)
        motion = grid.classify_beams(scan, pose, NOTHING, OBSTACLES).motion
        assert (motion[~column] == STATIC).all()
        if k * PERIOD < STANDING_AFTER:
            assert (motion[column & scan.hits] == UNKNOWN).all()
        grid = grid.add_scan(scan, pose, NOTHING)
    assert (grid.classify_beams(scene.scan((k + 1) * PERIOD, pose), pose, NOTHING, OBSTACLES).motion == STATIC).all()


def looks(
    scene: Scene, count: int, pose_at: Callable[[float], tuple[float, float, float]] = lambda _: (0.0, 0.0, 0.0)
) -> Iterator[tuple[float, np.ndarray, np.ndarray]]:
    """The time of each scan, where its beams end, shape (n, 2), W, and what the grid tells of them."""
    grid = OccupancyHistory.make_around(np.array(pose_at(0.0)[:2]), 6.0)
    for time in PERIOD * np.arange(count):
        pose = np.array(pose_at(time))
        scan = scene.scan(time, pose)
        motion = grid.classify_beams(scan, pose, NOTHING, OBSTACLES).motion
        yield time, scan.points_at(scan.distances, np.ones(len(motion), bool), pose), motion
        grid = grid.add_scan(scan, pose, NOTHING)


def on_disc(points: np.ndarray, center: np.ndarray | tuple[float, float], radius: float) -> np.ndarray:
    return np.hypot(*(points - center).T) < radius + 1e-6


@pytest.mark.parametrize("velocity", [(-0.3, 0.0), (0.0, 0.3), (0.5, -0.5)])
def test_what_moves_is_noticed(velocity: tuple[float, float]) -> None:
    scene = Scene(hall(), (0.25,), straight((1.5, 0.5), velocity))
    for time, points, motion in looks(scene, 40):
        own = on_disc(points, scene.at(time)[0], 0.25)
        if time * math.hypot(*velocity) > 0.3:  # it has left the cells where it was seen first
            assert (motion[own] == DYNAMIC).any()
        assert (motion[~own] != DYNAMIC).all()


def test_the_grid_follows_the_robot_and_forgets_nothing_near() -> None:
    scene = Scene(hall((2.0, 1.0, 0.2)), (), lambda t: np.zeros((0, 2)))
    grid = OccupancyHistory.make_around(np.zeros(2), 6.0)
    for k in range(50):
        grid = grid.add_scan(scene.scan(k * PERIOD, np.zeros(3)), np.zeros(3), NOTHING)
    pose = np.array((1.1, -1.3, 0.4))
    followed = grid.follow_robot(pose[:2])
    assert followed is not grid
    scan = scene.scan(3.0, pose)
    near = scan.distances < 3.0
    motion, moved = (each.classify_beams(scan, pose, NOTHING, OBSTACLES).motion[near] for each in (grid, followed))
    np.testing.assert_array_equal(moved, motion)
    assert (moved == STATIC).mean() > 0.9


def test_an_update_leaves_the_grid_before_it_alone() -> None:
    scene = Scene(hall(), (), lambda t: np.zeros((0, 2)))
    grid = OccupancyHistory.make_around(np.zeros(2), 6.0)
    before = grid.first_hit.copy()
    assert (grid.add_scan(scene.scan(0.0, np.zeros(3)), np.zeros(3), NOTHING).first_hit != before).any()
    np.testing.assert_array_equal(grid.first_hit, before)


def test_the_far_side_of_what_stays_stays_too_as_it_comes_into_view() -> None:
    scene = Scene(hall((2.0, 0.7, 0.3)), (), lambda t: np.zeros((0, 2)))
    looking, driving = math.ceil(STANDING_AFTER / PERIOD), round(4.0 / 0.8 / PERIOD)
    starts = (looking + 1) * PERIOD
    for time, points, motion in looks(scene, looking + driving, lambda t: (0.8 * max(t - starts, 0.0), 0.0, 0.0)):
        if time > STANDING_AFTER + 0.5 * PERIOD:
            assert (motion[on_disc(points, (2.0, 0.7), 0.3)] == STATIC).all(), f"at {time:.2f} s"


@pytest.mark.parametrize("gap", [0.02, 0.1])
def test_what_passes_close_by_what_stays_is_noticed(gap: float) -> None:
    scene = Scene(hall((1.5, 0.9, 0.3)), (0.25,), straight((0.0, 0.35 - gap), (0.5, 0.0)))
    for time, points, motion in looks(scene, 120, lambda _: (1.5, -1.0, 1.5)):
        if time > STANDING_AFTER:
            assert (motion[on_disc(points, scene.at(time)[0], 0.25)] == DYNAMIC).mean() > 0.6


def test_what_stood_and_then_goes_straight_away_is_not_taken_to_stay() -> None:
    """It goes where it has hidden the view, so that nothing there was seen free."""
    scene = Scene(hall(), (0.25,), lambda t: np.array(((1.2 + 0.5 * max(t - 2.5, 0.0), 0.0),)))
    for time, points, motion in looks(scene, 90):
        if time > 2.5 + 0.2 / 0.5:
            assert (motion[on_disc(points, scene.at(time)[0], 0.25)] != STATIC).all()


def test_what_was_seen_to_be_large_is_known_where_only_a_piece_of_it_is_in_view() -> None:
    wall, piece = Scene(hall(), (), lambda t: np.zeros((0, 2))), np.zeros(360, bool)
    scan = wall.scan(0.0, np.zeros(3))
    grid = OccupancyHistory.make_around(np.zeros(2), 6.0)
    assert (grid.classify_beams(scan, np.zeros(3), piece, OBSTACLES).may_start == scan.hits).all()
    grid = grid.add_scan(scan, np.zeros(3), scan.hits)
    assert not grid.classify_beams(wall.scan(PERIOD, np.zeros(3)), np.zeros(3), piece, OBSTACLES).may_start.any()


def test_a_cell_is_large_if_any_of_the_hits_in_it_is() -> None:
    """Close to the robot many beams end in one cell, whichever comes last."""
    scene = Scene(hall((0.45, 0.0, 0.1)), (), lambda t: np.zeros((0, 2)))
    scan = scene.scan(0.0, np.zeros(3))
    cells = np.floor(scan.points() / CELL).astype(int)
    is_large = np.zeros(360, bool)
    is_large[np.flatnonzero(scan.hits)[np.unique(cells, axis=0, return_index=True)[1]]] = True  # the first in each
    grid = OccupancyHistory.make_around(np.zeros(2), 6.0).add_scan(scan, np.zeros(3), is_large)
    assert not grid.classify_beams(scan, np.zeros(3), NOTHING, OBSTACLES).may_start.any()


def test_what_stands_where_a_large_surface_was_and_has_gone_may_start() -> None:
    standing = Scene(hall((1.5, 0.0, 0.3)), (), lambda t: np.zeros((0, 2)))
    empty = Scene(hall(), (), lambda t: np.zeros((0, 2)))
    grid = OccupancyHistory.make_around(np.zeros(2), 6.0)
    first = standing.scan(0.0, np.zeros(3))
    own = on_disc(first.points(), (1.5, 0.0), 0.3)
    beams = np.flatnonzero(first.hits)[own]
    grid = grid.add_scan(first, np.zeros(3), first.hits)
    assert not grid.classify_beams(first, np.zeros(3), NOTHING, OBSTACLES).may_start[beams].any()
    grid = grid.add_scan(empty.scan(PERIOD, np.zeros(3)), np.zeros(3), NOTHING)
    assert (
        grid.classify_beams(standing.scan(2 * PERIOD, np.zeros(3)), np.zeros(3), NOTHING, OBSTACLES)
        .may_start[beams]
        .all()
    )


@settings(max_examples=25, deadline=None)
@given(seed=seeds, full=st.booleans(), beams=st.sampled_from((5, 90, 360)))
def test_a_cell_is_free_if_all_beams_beside_it_end_beyond(seed: int, full: bool, beams: int) -> None:
    rng = np.random.default_rng(seed)
    step = 2.0 * math.pi / beams if full else rng.uniform(1.0, 6.0) / (beams - 1)
    begin, place, distance = rng.uniform(-7.0, 7.0), rng.uniform(-1.0, 1.0, 2), rng.uniform(0.0, 3.0, beams // 5 + 1)
    distance = np.repeat(distance, 5)[:beams]
    cells, half = 100, math.sqrt(0.5) * CELL
    origin = np.floor(place / CELL).astype(int) - rng.integers(30, 70, 2)
    free = rng.random((cells, cells)) < 0.3
    known, grids = free.copy(), (np.where(free, NEVER, 0.0), free, np.zeros_like(free))
    view = FieldOfView(begin, step, beams)
    _note_free_cells(*grids, origin, place, view, full, _make_extremes(distance))
    for i, j in rng.integers(0, cells, (200, 2)):
        dx, dy = (origin + (i, j) + 0.5) * CELL - place
        r = math.hypot(dx, dy)
        middle = (math.atan2(dy, dx) - begin) % (2.0 * math.pi) / step
        width = math.asin(min(half / r, 1.0)) / step + 1.0
        near = np.arange(math.floor(middle - width), math.ceil(middle + width) + 1)
        near = np.arange(beams) if len(near) > beams else near
        seen = full or (near[0] >= 0 and near[-1] < beams)
        passed = seen and (distance[near % beams] > r + half + RANGE_SLACK).all()
        assert free[i, j] == (known[i, j] or passed)
        assert grids[0][i, j] == (NEVER if free[i, j] else 0.0)
