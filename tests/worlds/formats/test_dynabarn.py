"""Worlds of a file in the DynaBARN benchmark's form: read as they stand, and refused with a reason."""

import copy
import json
from pathlib import Path

import numpy as np
import pytest

from drake_starnav.errors import StarnavError
from drake_starnav.worlds import DynaBarn, make_world, moving_obstacle_states

BENCHMARK = Path(__file__).parents[4] / "shared" / "data" / "dynabarn_00_29.json"
CONTENT = {
    "meta": {"start": [11, 0, 3.14], "goal": [-9, 0]},
    "worlds": [
        {
            "id": 4,
            "plugins": ["a", "b"],
            "walls": [{"pose": [-10.0, 4.0, 0.5, 0.0, 0.0, 0.5], "size": [0.5, 4.0, 1.0]}],
        }
    ],
    "trajectories": {
        "a": {"total": 4.0, "keys": [[0.0, 10.0, -6.0], [4.0, 6.0, -6.0]]},
        "b": {"total": 5.0, "keys": [[0.0, 0.0, 1.0], [2.0, 0.0, 2.0]]},
    },
}


def make(folder: Path, content: object) -> object:
    file = folder / "worlds.json"
    file.write_text(json.dumps(content))
    return make_world(DynaBarn(file=str(file), id=4), 0, 0.25)


def test_a_world_is_as_the_file_has_it(tmp_path: Path) -> None:
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


@pytest.mark.skipif(not BENCHMARK.is_file(), reason=f"the benchmark's worlds are not at {BENCHMARK}")
def test_reads_the_benchmark() -> None:
    kind = DynaBarn(file=str(BENCHMARK), id=0)
    kind.check_numbers(range(30))
    world = make_world(kind, 0, 0.25)
    assert len(world.moving_obstacles) == 11
    assert len(world.polygons) == 3
    assert world.goal == (-9.0, 0.0)


def test_an_unknown_number_is_told_the_known_ones(tmp_path: Path) -> None:
    make(tmp_path, CONTENT)
    with pytest.raises(StarnavError, match=r"world\.id is 9; allowed: a world of .*worlds\.json: 4"):
        make_world(DynaBarn(file=str(tmp_path / "worlds.json"), id=9), 0, 0.25)
    with pytest.raises(StarnavError, match=r"world\.file is 'nowhere', .* allowed: dynabarn_like, or the path"):
        make_world(DynaBarn(file="nowhere"), 0, 0.25)


@pytest.mark.parametrize(
    ("keys", "value", "message"),
    [
        (("meta",), None, r"worlds\.json: meta has no start, goal; allowed: a mapping with start, goal"),
        (("trajectories",), 3, r"world 4: plugins\[0\] is 'a'; allowed: the name of one of the trajectories"),
        (("worlds", 0, "plugins"), "a", r"world 4: plugins is 'a'; allowed: a list"),
        (("worlds", 0, "plugins", 1), "c", r"plugins\[1\] is 'c'"),
        (("worlds", 0, "walls", 0), [], r"walls\[0\] has no pose, size"),
        (("worlds", 0, "walls", 0, "pose"), [1.0], r"walls\[0\]\.pose is \[1.0\]; allowed: finite \[x, y, z"),
        (("worlds", 0, "walls", 0, "size"), [1.0, 0.0, 1.0], r"walls\[0\]\.size is .* positive lengths"),
        (("worlds", 0, "walls", 0, "pose"), [-9.0, 0.0, 0, 0, 0, 0], r"world 4\.goal is \[-9, 0\], -.* from polygons"),
        (("trajectories", "a"), {}, r"trajectories\.a has no total, keys"),
        (("trajectories", "a", "keys", 1), [4.0, "x", 0.0], r"trajectories\.a\.keys\[1\] is"),
        (("trajectories", "a", "keys"), [], r"world 4: moving obstacles: paths\[0\] is \[\]; allowed: two or more"),
        (
            ("trajectories", "a", "keys", 0),
            [7.0, 0.0, 0.0],
            r"world 4: moving obstacles: the times of paths\[0\] are \[7",
        ),
        (("trajectories", "a", "total"), "4", r"trajectories\.a\.total is"),
    ],
)
def test_a_world_that_makes_no_sense(tmp_path: Path, keys: tuple, value: object, message: str) -> None:
    content = copy.deepcopy(CONTENT)
    place: object = content
    for key in keys[:-1]:
        place = place[key]
    place[keys[-1]] = value
    with pytest.raises(StarnavError, match=message):
        make(tmp_path, content)


@pytest.mark.parametrize("name", ["meta", "trajectories"])
def test_a_file_of_static_worlds(tmp_path: Path, name: str) -> None:
    with pytest.raises(StarnavError, match=rf"worlds\.json has no {name}; allowed: a mapping with meta, trajectories"):
        make(tmp_path, {key: value for key, value in CONTENT.items() if key != name})
