"""Rooms: a dead end in the middle that opens towards the start, and some clutter."""

import numpy as np
import pytest

from drake_starnav.worlds import Room, make_world


@pytest.mark.parametrize("seed", range(5))
def test_the_dead_end_lies_between_start_and_goal(seed: int) -> None:
    world = make_world(Room(), seed, 0.25)
    dead_end = world.polygons[0]
    assert len(dead_end) == 8
    assert world.start[1] < dead_end[:, 1].mean() < world.goal[1]
    clutter = len(world.polygons) - 1 + len(world.cylinders)
    assert 3 <= clutter <= 7
    # its spine is on the goal's side: the two corners of the opening's inner edges are nearer to the start
    assert np.sort(dead_end[:, 1])[-2:].mean() > dead_end[:, 1].mean()
