"""Forests: trees of one size, apart, between the strips of start and goal."""

import numpy as np
import pytest

from drake_starnav.worlds import Forest, make_world


@pytest.mark.parametrize("seed", range(5))
def test_trees_keep_their_gap_and_leave_both_ends_clear(seed: int) -> None:
    kind = Forest()
    world = make_world(kind, seed, 0.25)
    trees = world.cylinders
    assert len(trees) <= kind.trees[1] and (trees[:, 2] == kind.radius).all()
    apart = np.hypot(*(trees[:, None, :2] - trees[None, :, :2]).transpose(2, 0, 1))
    assert apart[~np.eye(len(trees), dtype=bool)].min() >= 2.0 * kind.radius + kind.gap[0]
    assert world.start[0] < trees[:, 0].min() - kind.radius and world.goal[0] > trees[:, 0].max() + kind.radius
