"""Every generated world is solvable, free at both ends, of its kind, and the same wherever it is made."""

import hashlib
import math
import subprocess
import sys

import numpy as np
import pytest

from drake_starnav.errors import StarnavError
from drake_starnav.worlds import (
    WORLD_KINDS,
    Channel,
    Corridor,
    Crowd,
    Forest,
    Maze,
    PaperForest,
    PaperMaze,
    PaperRoom,
    Room,
    StopAndGo,
    World,
    compute_clearance,
    find_shortest_path,
    make_world,
    split_into_convex_parts,
)
from drake_starnav.worlds.generators.channel import _LANE_WIDTH
from drake_starnav.worlds.generators.maze import _draw_spanning_tree_walls

KINDS = [Forest(), Room(), Maze(family="cells"), Maze(family="open"), Corridor(), Crowd(), StopAndGo()]
KINDS += [PaperForest(), PaperMaze(), PaperRoom()]
GENERATORS = [kind for name, kind in WORLD_KINDS.items() if name not in ("Obstacles", "Model", "Barn", "DynaBarn")]


def fingerprint(world: World) -> str:
    numbers = [*world.start, *world.goal, *world.cylinders.ravel(), *world.spheres.ravel()]
    for polygon in world.polygons:
        numbers += list(polygon.ravel())
    numbers += [*world.moving_obstacles.radii, *world.moving_obstacles.way_points.ravel()]
    return hashlib.sha256(np.array(numbers).tobytes()).hexdigest()


@pytest.mark.parametrize("seed", range(2))
@pytest.mark.parametrize("kind", KINDS, ids=lambda kind: f"{type(kind).__name__}-{getattr(kind, 'family', '')}")
def test_solvable_with_five_centimetres_to_spare(kind, seed):
    radius = 0.25
    world = make_world(kind, seed, radius)
    ends = np.array([world.start[:2], world.goal])
    assert (compute_clearance(world, ends) >= radius + 0.05).all()
    assert find_shortest_path(world, radius + 0.05) is not None
    assert -math.pi <= world.start[2] < math.pi
    for polygon in world.polygons:
        split_into_convex_parts(polygon)


def test_the_same_world_in_another_process():
    code = (
        "import sys; sys.path[:0] = ['tests/worlds']\n"
        "from test_generators import *\n"
        "print(*[fingerprint(make_world(kind(), 3, 0.25)) for kind in GENERATORS])"
    )
    command = [sys.executable, "-c", code]
    other = subprocess.run(command, capture_output=True, text=True, check=True, timeout=300).stdout.split()
    assert other == [fingerprint(make_world(kind(), 3, 0.25)) for kind in GENERATORS]


def test_seeds_and_kinds_differ():
    worlds = [make_world(kind(), seed, 0.25) for kind in GENERATORS for seed in range(2)]
    assert len({fingerprint(world) for world in worlds}) == len(worlds)
    yaws = [world.start[2] for world in worlds if world.name != "stop_and_go"]  # there the robot faces the goal
    assert len(set(yaws)) == len(yaws)


@pytest.mark.parametrize("kind", [kind for kind in GENERATORS if kind is not Channel])  # it is as wide as any robot
def test_a_robot_that_fits_nowhere_is_named(kind):
    with pytest.raises(StarnavError, match=r"robot.radius 2\.5 m"):
        make_world(kind(), 0, 2.5)


def test_open_mazes_hold_walls_spheres_cylinders_and_concave_obstacles():
    worlds = [make_world(Maze(family="open"), seed, 0.25) for seed in range(10)]
    spheres = np.vstack([world.spheres for world in worlds])
    assert len(spheres)
    assert (spheres[:, 2] >= 0.2).all()
    assert sum(len(world.cylinders) for world in worlds)
    assert any(len(polygon) == 4 for world in worlds for polygon in world.polygons)
    assert any(len(split_into_convex_parts(polygon)) == 3 for world in worlds for polygon in world.polygons)


@pytest.mark.parametrize(
    ("seed", "radius"), [(-1, 0.25), (0.5, 0.25), (True, 0.25), (0, 0.0), (0, -1.0), (0, math.inf), (0, math.nan)]
)
def test_bad_seeds_and_radii_are_refused(seed, radius):
    for kind in (Forest(), Room()):
        with pytest.raises(StarnavError, match="allowed"):
            make_world(kind, seed, radius)


@pytest.mark.parametrize("seed", range(5))
def test_trees_keep_their_gap_and_leave_both_ends_clear(seed: int) -> None:
    kind = Forest()
    world = make_world(kind, seed, 0.25)
    trees = world.cylinders
    assert len(trees) <= kind.trees[1] and (trees[:, 2] == kind.radius).all()
    apart = np.hypot(*(trees[:, None, :2] - trees[None, :, :2]).transpose(2, 0, 1))
    assert apart[~np.eye(len(trees), dtype=bool)].min() >= 2.0 * kind.radius + kind.gap[0]
    assert world.start[0] < trees[:, 0].min() - kind.radius and world.goal[0] > trees[:, 0].max() + kind.radius


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


@pytest.mark.parametrize("length", [20.0, 60.0])
def test_a_smooth_corridor_is_about_as_long_as_its_middle_line(length: float) -> None:
    world = make_world(Corridor(length=length, fin=0.0), 0, 0.25)
    found = find_shortest_path(world, 0.25)
    assert found is not None
    lanes = len(world.polygons) + 1
    assert length - 2.0 * lanes * _LANE_WIDTH < found[0] <= length
    assert world.timeout == pytest.approx(60.0 * length / 10.0)


def test_fins_stand_in_the_lanes_and_make_the_way_longer() -> None:
    smooth, winding = (make_world(Corridor(fin=fin), 1, 0.25) for fin in (0.0, 0.4))
    assert len(winding.polygons) > len(smooth.polygons)
    ways = [find_shortest_path(world, 0.25) for world in (smooth, winding)]
    assert ways[0] is not None and ways[1] is not None and ways[1][0] > ways[0][0]


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
