"""Mazes: of cells, with loops, or open with traps; both are crossed from side to side."""

import numpy as np
import pytest

from drake_starnav.worlds import Maze, make_world
from drake_starnav.worlds.generators.maze import _draw_spanning_tree_walls


@pytest.mark.parametrize("n", [2, 5, 9])
def test_the_walls_of_a_perfect_maze_leave_one_way_between_any_cells(n: int) -> None:
    right, upper = _draw_spanning_tree_walls(n, np.random.default_rng(n))
    assert (~right).sum() + (~upper).sum() == n * n - 1  # the edges of a tree
    reached, open_ = {(0, 0)}, [(0, 0)]
    while open_:
        i, j = open_.pop()
        ways = [((i + 1, j), i < n - 1 and not right[i, j]), ((i - 1, j), i > 0 and not right[i - 1, j])]
        ways += [((i, j + 1), j < n - 1 and not upper[i, j]), ((i, j - 1), j > 0 and not upper[i, j - 1])]
        fresh = [cell for cell, free in ways if free and cell not in reached]
        reached |= set(fresh)
        open_ += fresh
    assert len(reached) == n * n


@pytest.mark.parametrize("family", ["cells", "open"])
def test_start_and_goal_are_at_opposite_sides(family: str) -> None:
    kind = Maze(family=family)
    for seed in range(4):
        world = make_world(kind, seed, 0.25)
        gap = np.abs(np.array(world.goal) - world.start[:2]).max()
        assert gap > 0.6 * kind.size
        assert world.bounds == (0.0, 0.0, kind.size, kind.size)
