"""The worlds of the experiment on giving up, and its report."""

import pytest

from drake_starnav.worlds.shortest_path import shortest_path
from scripts.experiments.giving_up import CLOSED, LEAST, RADIUS, SOLVABLE, closed_world, has_way, solvable_world


@pytest.mark.parametrize("kind", CLOSED)
def test_the_robot_does_not_fit_into_a_closed_world(kind: str) -> None:
    world = closed_world(kind, 3)
    assert shortest_path(world, RADIUS) is None and shortest_path(world, 0.5 * RADIUS) is not None


@pytest.mark.parametrize("kind", SOLVABLE)
def test_the_robot_hardly_fits_into_a_solvable_world(kind: str) -> None:
    world = solvable_world(kind, 3)
    assert has_way(world, LEAST) and not has_way(world, RADIUS + 0.04)
