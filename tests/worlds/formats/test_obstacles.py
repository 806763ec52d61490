"""Worlds written down obstacle by obstacle."""

from pathlib import Path

import numpy as np
import pytest

from drake_starnav.errors import StarnavError
from drake_starnav.worlds import Model, Obstacles, find_shortest_path, make_world

SQUARE = [[1.0, 1.0], [2.0, 1.0], [2.0, 2.0], [1.0, 2.0]]


def test_the_world_is_as_given():
    ends = {"start": [0.0, 0.0, 1.0], "goal": [5, 1]}
    kind = Obstacles(cylinders=[[3.0, 0.0, 0.5]], polygons=[SQUARE], bounds=[-1.0, -2.0, 6.0, 3.0], **ends)
    world = make_world(kind, 0, 0.25)
    assert (world.start, world.goal, world.timeout) == ((0.0, 0.0, 1.0), (5.0, 1.0), 180.0)
    assert world.bounds == (-1.0, -2.0, 6.0, 3.0)
    np.testing.assert_array_equal(world.cylinders, [(3.0, 0.0, 0.5)])
    np.testing.assert_array_equal(world.polygons[0], SQUARE)


def test_an_unreachable_goal_is_allowed():
    wall = [[2.0, -1.0], [2.1, -1.0], [2.1, 1.0], [2.0, 1.0]]
    world = make_world(Obstacles(polygons=[wall], bounds=[-1.0, -1.0, 6.0, 1.0]), 0, 0.25)
    assert find_shortest_path(world, 0.25) is None


@pytest.mark.parametrize(
    ("fields", "message"),
    [
        ({"cylinders": [[3.0, 2.0, 0.5], [0.5, 0.0, 0.3]]}, r"start is \[0, 0\], 0\.2 m from cylinders\[1\]"),
        ({"polygons": [SQUARE], "goal": [1.5, 1.6]}, r"goal is \[1\.5, 1\.6\], inside polygons\[0\]"),
        ({"bounds": [-0.1, -1.0, 6.0, 1.0]}, r"start .* 0\.1 m from bounds"),
        ({"bounds": [-1.0, -1.0, 3.0, 1.0]}, r"goal .* outside of bounds"),
        ({"polygons": [[]]}, r"polygons\[0\].*at least 3"),
        ({"polygons": [[*SQUARE[:3], [1.0]]]}, r"polygons\[0\]\[3\] is \[1\.0\]"),
        ({"polygons": [[SQUARE[k] for k in (0, 2, 1, 3)]]}, r"polygons\[0\].*simple"),
    ],
)
def test_bad_input_is_refused(fields, message):
    with pytest.raises(StarnavError, match=message):
        make_world(Obstacles(**fields), 0, 0.25)


def test_the_world_is_the_file_with_its_ends(tmp_path: Path) -> None:
    path = tmp_path / "my.room.dmd.yaml"
    path.write_text("directives: []")
    world = make_world(Model(directives=str(path), start=[1.0, 2.0, 0.5], goal=[3, 4], weld=False), 0, 0.25)
    assert (world.name, world.start, world.goal) == ("my", (1.0, 2.0, 0.5), (3.0, 4.0))
    assert world.model is not None
    assert (world.model.path, world.model.weld) == (str(path), False)


@pytest.mark.parametrize(
    ("changes", "message"),
    [
        ({}, r"Model\.directives is ''; allowed: a \.dmd\.yaml, \.sdf, \.world or \.urdf file"),
        ({"directives": "world.obj"}, r"'world\.obj'; allowed"),
        ({"directives": "/nowhere/world.sdf"}, r"/nowhere/world\.sdf cannot be read: no such file"),
        ({"directives": "package://drake_starnav/worlds/no.sdf"}, r"no\.sdf cannot be read: no such file"),
        ({"goal": [], "directives": "a\n"}, r"world model: goal is \[\]; allowed: finite \[x, y\]"),
        ({"start": [], "directives": "a\n"}, r"world model: start is \[\]; allowed: finite \[x, y, yaw\]"),
        ({"weld": 3}, r"Model\.weld is 3; allowed: true or false"),
    ],
)
def test_bad_input_of_a_model_is_refused(changes: dict, message: str) -> None:
    with pytest.raises(StarnavError, match=message):
        make_world(Model(**{"goal": [1.0, 0.0], **changes}), 0, 0.25)
