"""The optimistic explorer: shortest where nothing hides the way, fooled where something does, never through walls."""

import math

import numpy as np
import pytest

from drake_starnav.worlds import Maze, World, make_world
from drake_starnav.worlds.clearance import clearance
from drake_starnav.worlds.outlines import rectangle
from drake_starnav.worlds.shortest_path import shortest_path
from scripts.experiments import explorer

pytestmark = pytest.mark.slow

RADIUS, TOLERANCE, RANGE = 0.25, 0.3, 5.0
ROOM = (-1.0, -3.0, 7.0, 3.0)


def length(world: World) -> float:
    way = explorer.explored_way(world, RADIUS, TOLERANCE, RANGE)
    assert math.dist(way[-1], world.goal) <= TOLERANCE
    assert clearance(world, way).min() > RADIUS - explorer.SLACK - explorer.CELL
    return float(np.hypot(*np.diff(way, axis=0).T).sum())


def room(*walls: tuple[float, float, float, float]) -> World:
    return World("room", (0.0, 0.0, 0.0), (6.0, 0.0), polygons=tuple(rectangle(*wall) for wall in walls), bounds=ROOM)


def test_way_is_straight_in_an_empty_room_and_taut_round_a_wall() -> None:
    assert length(room()) == pytest.approx(6.0 - TOLERANCE, abs=explorer.STEP)
    around = room((2.9, -3.0, 3.1, 0.5))
    shortest = shortest_path(around, RADIUS)
    assert shortest is not None
    assert length(around) == pytest.approx(shortest[0] - TOLERANCE, abs=0.15)


@pytest.mark.parametrize("seed", range(3))
def test_mazes_are_crossed(seed: int) -> None:
    world = make_world(Maze(), seed, RADIUS)
    shortest = shortest_path(world, RADIUS)
    assert shortest is not None
    assert 0.97 * (shortest[0] - TOLERANCE) < length(world) < 4.0 * shortest[0]
