"""Every generated world is solvable, free at both ends, and the same wherever it is made."""

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
