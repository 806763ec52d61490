"""The optimistic explorer: shortest where nothing hides the way, fooled where something does, never through walls."""

import json
import math
from pathlib import Path

import numpy as np
import pytest

from drake_starnav.errors import StarnavError
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


def test_a_dead_end_is_entered_only_while_it_may_lead_on() -> None:
    box = ((2.0, -0.8, 6.5, -0.7), (2.0, 0.7, 6.5, 0.8), (4.9, -0.8, 5.0, 0.8))
    in_sight = length(room(*box))
    screen = (3.5, -0.3, 3.6, 0.1)
    assert in_sight < length(room(*box, screen))


def test_worlds_that_it_can_not_cross_are_told() -> None:
    with pytest.raises(StarnavError, match="explorer: no way to the goal of room"):
        length(room((3.0, -3.0, 3.1, 3.0)))


@pytest.mark.parametrize("seed", range(3))
def test_mazes_are_crossed(seed: int) -> None:
    world = make_world(Maze(), seed, RADIUS)
    shortest = shortest_path(world, RADIUS)
    assert shortest is not None
    assert 0.97 * (shortest[0] - TOLERANCE) < length(world) < 4.0 * shortest[0]


def test_comparison_lists_the_trials_that_are_longer(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    world = make_world(Maze(), 7, RADIUS)
    shortest = shortest_path(world, RADIUS)
    assert shortest is not None
    trial = {"scenario": "maze", "seed": 7, "outcome": "reached", "shortest_path_m": shortest[0]}
    records = [{**trial, "trial": k, "path_length_m": factor * length(world)} for k, factor in enumerate((1.1, 1.2))]
    header = {"cases": [{"scenario": "maze", "text": "world: !Maze {}\n"}]}
    monkeypatch.setattr(explorer, "read_trials", lambda _: (header, records))
    text = explorer.comparison(tmp_path / "trials.jsonl", "maze")
    assert json.dumps(text).count("| 7 ") == 1
    assert "| 1     | 7" in text
    with pytest.raises(StarnavError, match="no trial of forest"):
        explorer.comparison(tmp_path / "trials.jsonl", "forest")
