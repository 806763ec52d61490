"""Worlds from occupancy maps: their walls, and a start and a goal with a way between them."""

import math
from pathlib import Path

import numpy as np
import pytest

from drake_starnav.errors import StarnavError
from drake_starnav.worlds import RosMap, compute_clearance, find_shortest_path, make_world
from drake_starnav.worlds.formats.ros_map import FREE, OCCUPIED, UNKNOWN, OccupancyMap
from tests.helpers.maps import write_map

RADIUS = 0.25
RESOLUTION = 0.1
LETTERS = {".": FREE, "#": OCCUPIED, "?": UNKNOWN}
TWO_ROOMS = [
    "????????????????????????????????????????",
    *["?######################################?"] * 2,
    *["?#..................##................#?"] * 16,
    *["?######################################?"] * 2,
]
"""Of 1.8 x 1.6 m and 1.6 x 1.6 m, without a door."""


def map_of(rows: list[str], tmp_path: Path, origin: tuple[float, float, float] = (0.0, 0.0, 0.0), **changes) -> RosMap:
    """A map drawn with letters, the upper row first."""
    cells = np.array([[LETTERS[letter] for letter in row] for row in rows[::-1]], np.int8)
    write_map(OccupancyMap(cells, RESOLUTION, origin), tmp_path / "m.yaml")
    return RosMap(file=str(tmp_path / "m.yaml"), **{"min_distance": 0.4, **changes})


def with_door(rows: list[str], height: int) -> list[str]:
    """The two rooms with a door of some cells in the middle."""
    return [row.replace(".##.", "....") if 0 <= k - 6 < height else row for k, row in enumerate(rows)]


@pytest.mark.parametrize("origin", [(0.0, 0.0, 0.0), (-3.0, 1.5, 0.0), (1.0, -2.0, 0.6), (0.0, 0.0, -2.3)])
@pytest.mark.parametrize("unknown", ["occupied", "free"])
def test_walls_are_where_cells_are(tmp_path: Path, origin, unknown: str) -> None:
    rng = np.random.default_rng(4)
    cells = rng.choice([FREE, FREE, FREE, OCCUPIED, UNKNOWN], (30, 40)).astype(np.int8)
    cells[5:15, 5:25] = FREE
    grid = OccupancyMap(cells, RESOLUTION, origin)
    write_map(grid, tmp_path / "m.yaml")
    world = make_world(RosMap(file=str(tmp_path / "m.yaml"), unknown=unknown, min_distance=0.1), 0, 0.11)
    solid = cells == OCCUPIED if unknown == "free" else cells != FREE
    # the middle room holds start and goal: what is beside it stays
    points = rng.uniform((5.0, 5.0), (25.0, 15.0), (300, 2))
    rows, columns = np.nonzero(solid)
    if unknown == "occupied":  # so is all beyond the map
        rows = np.concatenate((rows, np.arange(-1, 31), np.arange(-1, 31)))
        columns = np.concatenate((columns, np.full(32, -1), np.full(32, 40)))
    dx = np.maximum(np.maximum(columns - points[:, :1], points[:, :1] - columns - 1), 0.0)
    dy = np.maximum(np.maximum(rows - points[:, 1:], points[:, 1:] - rows - 1), 0.0)
    expected = RESOLUTION * np.hypot(dx, dy).min(axis=1)
    np.testing.assert_allclose(compute_clearance(world, grid.to_world(points)), expected, atol=1e-9)


@pytest.mark.parametrize("seed", range(5))
def test_random_places_are_wide_far_and_in_reach(tmp_path: Path, seed: int) -> None:
    kind = map_of(with_door(TWO_ROOMS, 9), tmp_path, min_distance=1.4)
    world = make_world(kind, seed, RADIUS)
    ends = np.array([world.start[:2], world.goal])
    assert (compute_clearance(world, ends) >= RADIUS + 0.1).all()
    assert math.hypot(*(ends[1] - ends[0])) >= 1.4
    assert find_shortest_path(world, RADIUS + 0.05) is not None
    assert -math.pi <= world.start[2] < math.pi
    again = make_world(kind, seed, RADIUS)
    assert (again.start, again.goal) == (world.start, world.goal)


@pytest.mark.parametrize("seed", range(3))
def test_random_places_are_in_one_room_where_there_is_no_door(tmp_path: Path, seed: int) -> None:
    for rows in (TWO_ROOMS, with_door(TWO_ROOMS, 5)):  # 0.5 m is too narrow for the robot and its margin
        world = make_world(map_of(rows, tmp_path), seed, RADIUS)
        assert (world.start[0] < 2.1) == (world.goal[0] < 2.1)


def test_what_is_given_is_kept(tmp_path: Path) -> None:
    world = make_world(map_of(TWO_ROOMS, tmp_path, start=[1.0, 1.0, 2.0], goal=[0.6, 1.3]), 0, RADIUS)
    assert (world.start, world.goal) == ((1.0, 1.0, 2.0), (0.6, 1.3))
    for seed in range(5):
        world = make_world(map_of(TWO_ROOMS, tmp_path, start=[1.0, 1.0, 2.0]), seed, RADIUS)
        assert world.start == (1.0, 1.0, 2.0)
        assert world.goal[0] < 2.1
        world = make_world(map_of(TWO_ROOMS, tmp_path, goal=[3.0, 1.0]), seed, RADIUS)
        assert world.goal == (3.0, 1.0)
        assert world.start[0] > 2.1


def test_unknown_cells_may_be_free(tmp_path: Path) -> None:
    rows = [row.replace("##", "??") if 6 <= k < 15 else row for k, row in enumerate(TWO_ROOMS)]
    ends = {"start": [1.0, 1.0, 0.0], "goal": [3.0, 1.0]}
    with pytest.raises(StarnavError, match="out of reach"):
        make_world(map_of(rows, tmp_path, **ends), 0, RADIUS)
    assert make_world(map_of(rows, tmp_path, unknown="free", **ends), 0, RADIUS).goal == (3.0, 1.0)


def test_the_way_may_lead_around_the_map_where_that_is_free(tmp_path: Path) -> None:
    rows = [".......#......."] * 15
    ends = {"start": [0.3, 0.7, 0.0], "goal": [1.1, 0.7]}
    with pytest.raises(StarnavError, match="out of reach"):
        make_world(map_of(rows, tmp_path, **ends), 0, 0.2)
    assert find_shortest_path(make_world(map_of(rows, tmp_path, unknown="free", **ends), 0, 0.2), 0.2)[0] > 1.5
    worlds = [make_world(map_of(rows, tmp_path, unknown="free"), seed, 0.2) for seed in range(9)]
    assert len({(world.start[0] < 0.75) == (world.goal[0] < 0.75) for world in worlds}) == 2


@pytest.mark.parametrize(
    ("rows", "changes", "message"),
    [
        (["...", "..."], {}, "has no occupied cell; allowed: a map with free and occupied"),
        (["###", "???"], {}, "has no free cell"),
        (TWO_ROOMS, {"start": [0.15, 1.0, 0.0]}, r"start is \[0\.15, 1\], on an occupied cell"),
        (TWO_ROOMS, {"goal": [0.05, 1.0]}, r"goal is \[0\.05, 1\], on an unknown cell .*world\.unknown is occupied"),
        (TWO_ROOMS, {"goal": [9.0, 1.0]}, r"goal is \[9, 1\], outside of map"),
        (TWO_ROOMS, {"start": [0.4, 1.0, 0.0]}, r"start is \[0\.4, 1\], 0\.2 m from .*robot.radius 0\.25 m"),
        (TWO_ROOMS, {"start": [1.0, 1.0, 0.0], "goal": [3.0, 1.0]}, "goal .* is out of reach from the start"),
        (with_door(TWO_ROOMS, 4), {"start": [1.0, 1.0, 0.0], "goal": [3.0, 1.0]}, "out of reach"),
        (TWO_ROOMS, {"min_distance": 3.0}, "no start and goal 3 m apart .* robot.radius 0.25 m and 0.1 m to spare"),
        (TWO_ROOMS, {"start": [1.0, 1.0, 0.0], "min_distance": 3.0}, "no start and goal 3 m apart"),
        (TWO_ROOMS, {"start": [1.0, 1.0]}, r"start is \[1\.0, 1\.0\]; allowed: finite \[x, y, yaw\]"),
    ],
)
def test_bad_maps_and_places_are_refused(tmp_path: Path, rows, changes, message: str) -> None:
    with pytest.raises(StarnavError, match=message) as error:
        make_world(map_of(rows, tmp_path, **changes), 0, RADIUS)
    assert "\n" not in str(error.value)
