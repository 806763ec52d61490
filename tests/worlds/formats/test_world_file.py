"""What files of numbered worlds have in common; their kinds' own tests try broken files."""

import copy
import json
from pathlib import Path

import numpy as np
import pytest

from drake_starnav.errors import StarnavError
from drake_starnav.worlds import Barn, DynaBarn, make_world, moving_obstacle_states
from drake_starnav.worlds.formats.world_file import WorldFile

ENTRY = {"id": 7, "cylinders": [[2.0, 0.0, 0.075], [2.15, 0.0, 0.075]], "start": [0.0, 0.0, 1.5], "goal": [5.0, 0.5]}
ENTRY |= {"path_length_official": 5.2}
CONTENT = {
    "meta": {"start": [11, 0, 3.14], "goal": [-9, 0]},
    "worlds": [{"id": 4, "plugins": ["a", "b"], "walls": [{"pose": [-10, 4, 0.5, 0, 0, 0.5], "size": [0.5, 4, 1]}]}],
    "trajectories": {
        "a": {"total": 4.0, "keys": [[0.0, 10.0, -6.0], [4.0, 6.0, -6.0]]},
        "b": {"total": 5.0, "keys": [[0.0, 0.0, 1.0], [2.0, 0.0, 2.0]]},
    },
}


def test_worlds_are_found_by_their_numbers(tmp_path) -> None:
    path = tmp_path / "x.json"
    path.write_text(json.dumps({"worlds": [{"id": 3, "size": 1}, {"id": 4}, {"id": 9}]}))
    file = WorldFile.read("Kind", str(path))
    assert file.world(3, ("size",)) == (f"{path}: world 3", {"id": 3, "size": 1})
    file.check_numbers([9, 3])
    with pytest.raises(StarnavError, match=r"world\.id is 5; allowed: a world of .*x\.json: \[3, 4, 9\]"):
        file.world(5, ())
    with pytest.raises(StarnavError, match="world 4 has no size; allowed: a mapping with size"):
        file.world(4, ("size",))


@pytest.mark.parametrize(("kind", "others"), [("Barn", "barn_like"), ("DynaBarn", "dynabarn_like")])
def test_a_kind_is_told_its_own_shipped_files(kind: str, others: str) -> None:
    with pytest.raises(StarnavError, match=rf"world\.file 'none' .*; allowed: {others}, or the path"):
        WorldFile.read(kind, "none")


def test_a_world_is_as_the_file_has_it(tmp_path: Path) -> None:
    file = tmp_path / "worlds.json"
    file.write_text(json.dumps({"meta": {}, "worlds": [{**ENTRY, "id": 8, "start": [1, 0, 0]}, ENTRY]}))
    world = make_world(Barn(file=str(file), id=7), 3, 0.334)
    np.testing.assert_array_equal(world.cylinders, ENTRY["cylinders"])
    assert world.start == (0.0, 0.0, 1.5)
    assert world.goal == (5.0, 0.5)
    assert world.optimal_time == pytest.approx(2.6)
    assert world.timeout == 100.0
    assert world.name == "barn_7"


def make(folder: Path, content: object) -> object:
    file = folder / "worlds.json"
    file.write_text(json.dumps(content))
    return make_world(DynaBarn(file=str(file), id=4), 0, 0.25)


def test_a_world_is_as_the_file_has_it_of_dynabarn(tmp_path: Path) -> None:
    world = make(tmp_path, CONTENT)
    assert (world.name, world.start, world.goal, world.timeout) == ("dynabarn_4", (11, 0, 3.14), (-9, 0), 100.0)
    assert world.moving_obstacles.radii.tolist() == [0.5, 0.5]
    positions, velocities = moving_obstacle_states(world.moving_obstacles, np.array([1.0, 3.0, 6.0]))
    assert positions[:, 0] == pytest.approx(np.array([(9.0, -6.0), (7.0, -6.0), (8.0, -6.0)]))
    assert positions[:, 1] == pytest.approx(np.array([(0.0, 1.5), (0.0, 2.0), (0.0, 1.5)])), "it waits for its total"
    assert velocities[1, 1].tolist() == [0.0, 0.0]
    (wall,) = world.polygons
    assert wall.mean(axis=0) == pytest.approx((-10.0, 4.0))
    along = wall[2] - wall[1]
    assert np.hypot(*along) == pytest.approx(4.0)
    assert np.arctan2(along[1], along[0]) == pytest.approx(0.5 + 0.5 * np.pi)


@pytest.mark.parametrize(
    ("keys", "value", "message"),
    [
        (("meta",), None, r"worlds\.json: world 4: meta has no start, goal; allowed: a mapping with start, goal"),
        (("trajectories",), 3, r"world 4: plugins\[0\] is 'a'; allowed: the name of one of the trajectories"),
        (("worlds", 0, "plugins"), "a", r"world 4: plugins is 'a'; allowed: a list"),
        (("worlds", 0, "plugins", 1), "c", r"plugins\[1\] is 'c'"),
        (("worlds", 0, "walls", 0), [], r"walls\[0\] has no pose, size"),
        (("worlds", 0, "walls", 0, "pose"), [1.0], r"walls\[0\]\.pose is \[1.0\]; allowed: finite \[x, y, z"),
        (("worlds", 0, "walls", 0, "size"), [1.0, 0.0, 1.0], r"walls\[0\]\.size is .* positive lengths"),
        (("worlds", 0, "walls", 0, "pose"), [-9.0, 0.0, 0, 0, 0, 0], r"world 4\.goal is \[-9, 0\], inside polygons"),
        (("trajectories", "a"), {}, r"trajectories\.a has no total, keys"),
        (("trajectories", "a", "keys", 1), [4.0, "x", 0.0], r"trajectories\.a\.keys\[1\] is"),
        (("trajectories", "a", "keys"), [], r"world 4: moving obstacles: paths\[0\] is \[\]; allowed: two or more"),
        (("trajectories", "a", "keys", 0), [7.0, 0.0, 0.0], r"moving obstacles: the times of paths\[0\] are \[7"),
        (("trajectories", "a", "total"), "4", r"trajectories\.a\.total is"),
    ],
)
def test_a_world_that_makes_no_sense_of_dynabarn(tmp_path: Path, keys: tuple, value: object, message: str) -> None:
    content = copy.deepcopy(CONTENT)
    place: object = content
    for key in keys[:-1]:
        place = place[key]
    place[keys[-1]] = value
    with pytest.raises(StarnavError, match=message):
        make(tmp_path, content)
