import math
from unittest.mock import patch

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from scipy.sparse import coo_array
from scipy.sparse.csgraph import dijkstra

from drake_starnav.planning import cost_field
from drake_starnav.planning.cost_field import BLOCKED_SLACK, SOFT_ZONE, Origins, Terrain, cost_to_go
from drake_starnav.planning.distance_grid import STRIDE, DistanceGrid
from tests.helpers.scans import RADIUS, seeds

RESOLUTION = 0.05
CELL = RESOLUTION * STRIDE
CORNERS = 0.5 * RESOLUTION * np.array([(-1.0, -1.0), (-1.0, 1.0), (1.0, -1.0), (1.0, 1.0)])
"""From the centre of a cell of the cost-to-go to the centres of the memory's cells in it, m."""
LOW, HIGH = np.array((-3.0, -3.0)), np.array((3.0, 3.0))


def memory(points: np.ndarray, parts: int = 1) -> DistanceGrid:
    out = DistanceGrid.empty(RESOLUTION, RADIUS)
    for part in np.array_split(points, parts):
        out = out.stamped(part)
    return out


def line(a: tuple[float, float], b: tuple[float, float]) -> np.ndarray:
    a, b = np.array(a), np.array(b)
    return a + (b - a) * np.linspace(0.0, 1.0, int(np.hypot(*(b - a)) / 0.02) + 1)[:, None]


def reference_cost(grid: DistanceGrid, goal: np.ndarray, near_wall_cost: float) -> tuple[np.ndarray, np.ndarray]:
    """Cells and their cost to the goal's cell by SciPy, over the same eight-connected graph."""
    first, (nx, ny) = grid.box(LOW, HIGH)
    middle = (first + 0.5 * (STRIDE - 1)) * RESOLUTION  # of the first cell
    cells = middle + CELL * np.stack(np.indices((nx, ny)), axis=-1)
    distance = grid.coarse(cells.reshape(-1, 2))[1].max(axis=1).reshape(nx, ny)
    blocked, soft = RADIUS - BLOCKED_SLACK, RADIUS + SOFT_ZONE
    factor = 1.0 + near_wall_cost * np.clip((soft - distance) / (soft - blocked), 0.0, 1.0)
    weight = np.where(distance < np.float32(blocked), np.inf, np.floor(10.0 * factor) / 10.0)
    number = np.arange(nx * ny).reshape(nx, ny)
    rows, columns, lengths = [], [], []
    for di, dj in ((0, 1), (1, 0), (1, 1), (1, -1), (0, -1), (-1, 0), (-1, -1), (-1, 1)):
        a = number[max(-di, 0) : nx - max(di, 0), max(-dj, 0) : ny - max(dj, 0)]
        b = number[max(di, 0) : nx - max(-di, 0), max(dj, 0) : ny - max(-dj, 0)]
        length = (1.4 if di and dj else 1.0) * CELL * weight.ravel()[b]  # entering a cell costs that cell's weight
        passable = np.isfinite(length)
        rows.append(a[passable])
        columns.append(b[passable])
        lengths.append(length[passable])
    graph = coo_array(
        (np.concatenate(lengths), (np.concatenate(rows), np.concatenate(columns))), shape=(nx * ny, nx * ny)
    )
    i, j = np.rint((goal - middle) / CELL).astype(int)
    cost = dijkstra(graph.tocsr(), indices=number[i, j])
    return cells.reshape(-1, 2), cost


@settings(max_examples=8)
@given(seeds, st.sampled_from([0.0, 1.0, 3.0]))
def test_cost_to_go_equals_scipy_on_the_same_grid(seed, near_wall_cost):
    rng = np.random.default_rng(seed)
    grid = memory(rng.uniform(-3.0, 3.0, (40, 2)))
    goal = rng.uniform(-2.5, 2.5, 2)
    cells, expected = reference_cost(grid, goal, near_wall_cost)
    with patch.object(cost_field, "NEAR_WALL_COST", near_wall_cost):
        cost = cost_to_go(grid, goal, LOW, HIGH, Terrain(RADIUS)).at(cells)
    # the cost of a point is the least over its own and the eight cells around it, and the way there
    away = np.hypot(*np.moveaxis(cells[:, None] - cells, -1, 0))
    best = np.where(away < 1.5 * CELL, away + expected, np.inf).min(axis=1)
    assert np.isfinite(best).any()
    np.testing.assert_allclose(cost, best, atol=0.02 * max(1.0, near_wall_cost))


@settings(max_examples=20)
@given(seeds)
def test_in_an_empty_world_cost_to_go_is_the_distance_within_the_octile_error(seed):
    rng = np.random.default_rng(seed)
    goal, points = rng.uniform(-2.5, 2.5, 2), rng.uniform(-2.9, 2.9, (100, 2))
    cost = cost_to_go(DistanceGrid.empty(RESOLUTION, RADIUS), goal, LOW, HIGH, Terrain(RADIUS)).at(points)
    straight = np.hypot(*(points - goal).T)
    assert (cost < 1.083 * straight + 1.5 * CELL).all() and (cost > 0.98 * straight - 1.5 * CELL).all()


def test_walls_are_gone_around_through_gaps_that_the_robot_fits():
    wall = np.vstack((line((0.0, -3.5), (0.0, 1.0)), line((0.0, 1.9), (0.0, 3.5))))
    points, goal = np.array(((-1.0, -1.0),)), np.array((1.0, -1.0))
    detour = 2.0 * math.hypot(1.0, 2.45)
    cost = cost_to_go(memory(wall), goal, LOW, HIGH, Terrain(RADIUS)).at(points)[0]
    assert 0.9 * detour < cost < 1.25 * detour
    narrow = np.vstack((line((0.0, -3.5), (0.0, 1.0)), line((0.0, 1.4), (0.0, 3.5))))
    assert cost_to_go(memory(narrow), goal, LOW, HIGH, Terrain(RADIUS)).at(points)[0] == np.inf


def test_what_is_closed_closes_what_is_narrow_around_it():
    wall = memory(np.vstack((line((0.0, -3.5), (0.0, 1.0)), line((0.0, 1.8), (0.0, 3.5)))))
    points, goal = np.array(((-1.0, -1.0),)), np.array((1.0, -1.0))

    def cost(place: tuple[float, float], clearance: float) -> float:
        blacklist = np.array(((*place, clearance),))
        return float(cost_to_go(wall, goal, LOW, HIGH, Terrain(RADIUS, blacklist)).at(points)[0])

    corner = (0.0, 1.32)
    assert cost(corner, math.inf) == math.inf
    assert cost(corner, RADIUS + 0.2) == math.inf
    without = cost((2.9, 2.9), math.inf)
    assert without < cost(corner, RADIUS + 0.05) < without + 0.5  # past the corner, with more room


def test_a_walled_in_goal_or_point_and_places_outside_of_the_box_are_infinitely_far():
    corners = [(-1.0, -1.0), (1.0, -1.0), (1.0, 1.0), (-1.0, 1.0)]
    box = memory(np.vstack([line(a, b) for a, b in zip(corners, corners[1:] + corners[:1], strict=True)]))
    inside, outside, far = np.zeros(2), np.array((2.5, 2.5)), np.array((30.0, 0.0))
    points = np.array((inside, outside, far))
    cost = cost_to_go(box, inside, LOW, HIGH, Terrain(RADIUS)).at(points)
    assert cost[0] < CELL and cost[1] == np.inf and cost[2] == np.inf
    assert cost_to_go(box, outside, LOW, HIGH, Terrain(RADIUS)).at(inside[None])[0] == np.inf


@settings(max_examples=30)
@given(seeds)
def test_a_search_that_ends_early_has_the_same_winner(seed):
    rng = np.random.default_rng(seed)
    grid = memory(rng.uniform(-3.0, 3.0, (40, 2)))
    goal, points = rng.uniform(-2.5, 2.5, 2), rng.uniform(-2.9, 2.9, (30, 2))
    cost_to_come = rng.uniform(0.0, 6.0, 30)
    full = cost_to_go(grid, goal, LOW, HIGH, Terrain(RADIUS)).at(points)
    early = cost_to_go(grid, goal, LOW, HIGH, Terrain(RADIUS), Origins(points, cost_to_come)).at(points)
    if np.isfinite(full).any():
        best = np.argmin(full + cost_to_come)
        assert early[best] == pytest.approx(full[best], abs=1e-9)
        assert (early + cost_to_come).min() == pytest.approx((full + cost_to_come)[best], abs=1e-9)


@settings(max_examples=60)
@given(seeds, st.floats(0.0, 1.0))
def test_a_search_towards_the_robot_has_the_same_winners(seed, margin):
    rng = np.random.default_rng(seed)
    grid = memory(rng.uniform(-3.0, 3.0, (40, 2)))
    goal, points = rng.uniform(-2.5, 2.5, 2), rng.uniform(-2.9, 2.9, (30, 2))
    robot = points[-1]
    cost_to_come = np.hypot(*(points - robot).T) * rng.uniform(1.0, 2.0, 30)
    full = cost_to_go(grid, goal, LOW, HIGH, Terrain(RADIUS)).at(points)
    origins = Origins(points, cost_to_come, robot, margin)
    early = cost_to_go(grid, goal, LOW, HIGH, Terrain(RADIUS), origins).at(points)
    if np.isfinite(full).any():
        sums = full + cost_to_come
        near = sums <= sums.min() + margin
        np.testing.assert_allclose(early[near], full[near], atol=1e-9)
        assert (early + cost_to_come)[~near].min(initial=np.inf) >= sums.min()


def test_a_search_ends_at_a_robot_in_a_blocked_cell():
    grid = memory(line((-2.0, -1.0), (-2.0, 1.0)))
    robot, goal = np.array((-2.0 + RADIUS - 0.1, 0.0)), np.zeros(2)
    origins = Origins(robot[None], np.zeros(1), robot)
    early, full = (cost_to_go(grid, goal, LOW, HIGH, Terrain(RADIUS), end) for end in (origins, None))
    place = tuple(np.rint((robot - full.origin) / full.cell).astype(int) + 1)
    assert full.weight[place] == 0  # the robot touches the wall, but for the cells around it
    assert early.at(robot[None])[0] == full.at(robot[None])[0] < np.inf
    assert (early.cost < 0).sum() < 0.5 * (full.cost < 0).sum()


@settings(max_examples=20)
@given(seeds)
def test_the_path_leads_over_free_cells_to_the_goal_and_is_as_long_as_its_cost(seed):
    rng = np.random.default_rng(seed)
    grid = memory(rng.uniform(-3.0, 3.0, (20, 2)))
    goal, start = rng.uniform(-2.5, 2.5, (2, 2))
    field = cost_to_go(grid, goal, LOW, HIGH, Terrain(RADIUS))
    cost, path = field.at(start[None])[0], field.path(start)
    assert len(path) > 0 or not cost < np.inf
    if len(path):
        steps = np.hypot(*np.diff(path, axis=0).T)
        # two points of neighbouring cells, each up to a quarter of a cell off its centre along both axes
        assert (steps < 1.5 * math.sqrt(2.0) * CELL + 1e-9).all() and np.hypot(*(path[-1] - goal)) < CELL
        assert (grid.distance(path[:-1]) > RADIUS - BLOCKED_SLACK - 1e-6).all()
        assert steps.sum() == pytest.approx(cost, abs=1.5 * CELL + 0.05 * cost)


@pytest.mark.parametrize("shift", np.arange(0.0, 2.0 * CELL, 0.25 * RESOLUTION))
def test_a_passage_that_the_robot_just_fits_lies_between_no_cells(shift):
    """Wherever it lies on the grid, at both of the hits' errors; a passage too narrow by a cell's size stays shut."""
    goal, points = np.array((1.0, shift)), np.array(((-1.0, shift),))

    def cost(half: float) -> float:
        wall = [line((0.0, -3.5), (0.0, shift - half)), line((0.0, shift + half), (0.0, 3.5))]
        return float(cost_to_go(memory(np.vstack(wall)), goal, LOW, HIGH, Terrain(RADIUS)).at(points)[0])

    assert cost(RADIUS + 0.5 * RESOLUTION) < 2.3
    assert cost(RADIUS - BLOCKED_SLACK - 0.75 * RESOLUTION) == math.inf
