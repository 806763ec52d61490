import dataclasses
import math
from unittest.mock import patch

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from scipy.sparse import coo_array
from scipy.sparse.csgraph import dijkstra

from drake_starnav.planning import cost_field
from drake_starnav.planning.bucket_search import UNREACHED_COST
from drake_starnav.planning.cost_field import BLOCKED_SLACK, SOFT_ZONE, CostField, CostmapParams, compute_cost_to_go
from drake_starnav.planning.grid import OFF, STRIDE, Coverage, Grid
from drake_starnav.planning.roadmap import CLOSURE_RADIUS
from tests.helpers.scans import RADIUS, seeds, wandered

RESOLUTION = 0.05
CELL = RESOLUTION * STRIDE
LOW, HIGH = np.array((-3.0, -3.0)), np.array((3.0, 3.0))


def memory(points: np.ndarray, parts: int = 1) -> Grid:
    out = Grid.empty(RESOLUTION, RADIUS)
    for part in np.array_split(points, parts):
        out = out.add_hits(part)
    return out


def line(a: tuple[float, float], b: tuple[float, float]) -> np.ndarray:
    a, b = np.array(a), np.array(b)
    return a + (b - a) * np.linspace(0.0, 1.0, int(np.hypot(*(b - a)) / 0.02) + 1)[:, None]


def at(field: CostField, points: np.ndarray) -> np.ndarray:
    """The least cost over the 3 x 3 cells about each point, and the way there, shape (n,), m; infinity without any."""
    cells = np.rint(points / field.cell - field.first_middle).astype(int) + 1
    out = np.full(len(points), np.inf)
    for di in (-1, 0, 1):
        for dj in (-1, 0, 1):
            i, j = np.clip(cells + (di, dj), 0, np.array(field.cost.shape) - 1).T
            near = np.abs(cells + (di, dj) - np.stack((i, j), axis=-1)).max(axis=1) == 0
            cost = (field.cost[i, j] + UNREACHED_COST) * (field.cell / 100.0) + field.cell * math.hypot(di, dj)
            out = np.minimum(out, np.where(near & (field.cost[i, j] < 0), cost, np.inf))
    return out


def reference_cost(grid: Grid, goal: np.ndarray, near_wall_cost: float) -> tuple[np.ndarray, np.ndarray]:
    """Cells and their cost to the goal's cell by SciPy, over the same eight-connected graph."""
    first, (nx, ny) = grid.box(LOW, HIGH)
    cells = CELL * (first + OFF + np.stack(np.indices((nx, ny)), axis=-1))
    distance = grid.coarse(cells.reshape(-1, 2))[1].max(axis=1).reshape(nx, ny)
    blocked, soft = RADIUS - BLOCKED_SLACK * RADIUS, RADIUS + SOFT_ZONE * RADIUS
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
    i, j = np.rint(goal / CELL - first - OFF).astype(int)
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
        cost = at(compute_cost_to_go(grid, goal, LOW, HIGH, CostmapParams(RADIUS)), cells)
    # the cost of a point is the least over its own and the eight cells around it, and the way there
    away = np.hypot(*np.moveaxis(cells[:, None] - cells, -1, 0))
    best = np.where(away < 1.5 * CELL, away + expected, np.inf).min(axis=1)
    assert np.isfinite(best).any()
    np.testing.assert_allclose(cost, best, atol=0.02 * max(1.0, near_wall_cost))


def test_a_closure_closes_its_disc_and_nothing_else():
    wall = memory(np.vstack((line((0.0, -3.5), (0.0, 1.0)), line((0.0, 1.8), (0.0, 3.5)))))
    start, goal = np.array((-1.0, -1.0)), np.array((1.0, -1.0))

    def way(*places: tuple[float, float]) -> np.ndarray:
        closures = np.reshape(places, (-1, 2)).astype(float)
        return compute_cost_to_go(wall, goal, LOW, HIGH, CostmapParams(RADIUS, closures)).path(start)

    assert not len(way((0.0, 1.4)))  # in the middle of the only door
    np.testing.assert_array_equal(way((2.9, 2.9)), way())
    on = way()[len(way()) // 5]
    assert np.hypot(*(way(on) - on).T).min() > CLOSURE_RADIUS * RADIUS


@settings(max_examples=5)
@given(seeds)
def test_cells_outside_the_known_regions_cost_more(seed):
    _, roadmap = wandered(seed, nodes=3)
    plain, weighed = (
        compute_cost_to_go(grid, np.zeros(2), LOW, HIGH, CostmapParams(RADIUS)).weight.astype(int)
        for grid in (dataclasses.replace(roadmap.grid, coverage=Coverage()), roadmap.grid)
    )
    first_middle = compute_cost_to_go(roadmap.grid, np.zeros(2), LOW, HIGH, CostmapParams(RADIUS)).first_middle
    middles = (first_middle + np.argwhere(plain) - 1) * CELL
    added = np.where(roadmap.union.contains(middles), 0, 3)
    np.testing.assert_array_equal((weighed - plain)[plain > 0], added)
    assert (weighed[plain == 0] == 0).all() and len(np.unique(added)) == 2


def test_a_walled_in_goal_or_point_and_places_outside_of_the_box_are_infinitely_far():
    corners = [(-1.0, -1.0), (1.0, -1.0), (1.0, 1.0), (-1.0, 1.0)]
    box = memory(np.vstack([line(a, b) for a, b in zip(corners, corners[1:] + corners[:1], strict=True)]))
    inside, outside, far = np.zeros(2), np.array((2.5, 2.5)), np.array((30.0, 0.0))
    points = np.array((inside, outside, far))
    cost = at(compute_cost_to_go(box, inside, LOW, HIGH, CostmapParams(RADIUS)), points)
    assert cost[0] < CELL and cost[1] == np.inf and cost[2] == np.inf
    assert at(compute_cost_to_go(box, outside, LOW, HIGH, CostmapParams(RADIUS)), inside[None])[0] == np.inf


def test_a_search_ends_at_a_robot_in_a_blocked_cell():
    grid = memory(line((-2.0, -1.0), (-2.0, 1.0)))
    robot, goal = np.array((-2.0 + RADIUS - 0.1, 0.0)), np.zeros(2)
    early, full = (compute_cost_to_go(grid, goal, LOW, HIGH, CostmapParams(RADIUS), end) for end in (robot, None))
    place = tuple(np.rint(robot / full.cell - full.first_middle).astype(int) + 1)
    assert full.weight[place] == 0  # the robot touches the wall, but for the cells around it
    assert at(early, robot[None])[0] == at(full, robot[None])[0] < np.inf
    assert (early.cost < 0).sum() < 0.5 * (full.cost < 0).sum()


@settings(max_examples=20)
@given(seeds)
def test_the_path_leads_over_free_cells_to_the_goal_and_is_as_long_as_its_cost(seed):
    rng = np.random.default_rng(seed)
    grid = memory(rng.uniform(-3.0, 3.0, (20, 2)))
    goal, start = rng.uniform(-2.5, 2.5, (2, 2))
    field = compute_cost_to_go(grid, goal, LOW, HIGH, CostmapParams(RADIUS))
    cost, path = at(field, start[None])[0], field.path(start)
    assert len(path) > 0 or not cost < np.inf
    if len(path):
        steps = np.hypot(*np.diff(np.vstack((start, path)), axis=0).T)
        # two points of neighbouring cells, each up to a quarter of a cell off its centre along both axes
        assert (steps[1:] < 1.5 * math.sqrt(2.0) * CELL + 1e-9).all() and np.hypot(*(path[-1] - goal)) < CELL
        assert (grid.distance(path[:-1]) > RADIUS - BLOCKED_SLACK * RADIUS - 1e-6).all()
        assert steps.sum() == pytest.approx(cost, abs=CELL + 0.05 * cost)


@pytest.mark.parametrize("shift", np.arange(0.0, 2.0 * CELL, 0.25 * RESOLUTION))
def test_a_passage_that_the_robot_just_fits_lies_between_no_cells(shift):
    """Wherever it lies on the grid, at both of the hits' errors; a passage too narrow by a cell's size stays shut."""
    goal, points = np.array((1.0, shift)), np.array(((-1.0, shift),))

    def cost(half: float) -> float:
        wall = [line((0.0, -3.5), (0.0, shift - half)), line((0.0, shift + half), (0.0, 3.5))]
        return float(at(compute_cost_to_go(memory(np.vstack(wall)), goal, LOW, HIGH, CostmapParams(RADIUS)), points)[0])

    assert cost(RADIUS + 0.5 * RESOLUTION) < 2.3
    assert cost(RADIUS - BLOCKED_SLACK * RADIUS - 0.75 * RESOLUTION) == math.inf
