"""The paper's forest: the same trees always, start and goal in the paper's ranges."""

import numpy as np
import pytest

from drake_starnav.worlds import PaperForest, make_world


@pytest.mark.parametrize("seed", range(5))
def test_only_start_and_goal_are_random(seed: int) -> None:
    first, world = make_world(PaperForest(), 100, 0.25), make_world(PaperForest(), seed, 0.25)
    np.testing.assert_array_equal(world.cylinders, first.cylinders)
    assert len(world.cylinders) == 11
    assert -3.6 <= world.start[0] <= -2.7 and 4.5 <= world.goal[0] <= 4.8
    assert all(-1.35 <= y <= 3.2 for y in (world.start[1], world.goal[1]))
    assert (world.start[1], world.goal[1]) != (first.start[1], first.goal[1])
