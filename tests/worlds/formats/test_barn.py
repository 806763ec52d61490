"""Worlds of a file in the BARN benchmark's form: read as they stand, and refused with a reason."""

import json
from pathlib import Path

import numpy as np
import pytest

from drake_starnav.errors import StarnavError
from drake_starnav.utils.resources import model_path
from drake_starnav.worlds import Barn, make_world

BENCHMARK = Path(__file__).parents[4] / "shared" / "data" / "barn_000_149.json"
ENTRY = {
    "id": 7,
    "cylinders": [[2.0, 0.0, 0.075], [2.15, 0.0, 0.075]],
    "start": [0.0, 0.0, 1.5],
    "goal": [5.0, 0.5],
    "path_length_official": 5.2,
}


@pytest.fixture
def file(tmp_path: Path) -> Path:
    path = tmp_path / "worlds.json"
    path.write_text(json.dumps({"meta": {}, "worlds": [ENTRY, {**ENTRY, "id": 8}, {**ENTRY, "id": 10}]}))
    return path


def rewrite(path: Path, **changes) -> None:
    path.write_text(json.dumps({"worlds": [{**ENTRY, **changes}]}))


def test_a_world_is_as_the_file_has_it(file: Path) -> None:
    world = make_world(Barn(file=str(file), id=7), 3, 0.334)
    np.testing.assert_array_equal(world.cylinders, ENTRY["cylinders"])
    assert world.start == (0.0, 0.0, 1.5)
    assert world.goal == (5.0, 0.5)
    assert world.optimal_time == pytest.approx(2.6)
    assert world.timeout == 100.0
    assert world.name == "barn_7"


def test_shipped_worlds_are_found_by_name() -> None:
    names = sorted(path.stem for path in model_path("worlds").glob("*.json"))
    assert "barn_like" in names
    for number in range(12):
        world = make_world(Barn(id=number), 0, 0.334)
        assert world.optimal_time == pytest.approx(5.1, abs=0.5)


@pytest.mark.skipif(not BENCHMARK.is_file(), reason=f"the benchmark's worlds are not at {BENCHMARK}")
def test_reads_the_benchmark() -> None:
    kind = Barn(file=str(BENCHMARK), id=3)
    kind.check_numbers(range(150))
    world = make_world(kind, 0, 0.334)
    assert len(world.cylinders) > 100
    assert world.optimal_time == pytest.approx(json.loads(BENCHMARK.read_text())["worlds"][3]["optimal_time"], abs=1e-3)


def test_an_unknown_number_is_told_the_known_ones(file: Path) -> None:
    with pytest.raises(StarnavError, match=r"world\.id is 9; allowed: a world of .*worlds\.json: 7-8, 10"):
        make_world(Barn(file=str(file), id=9), 0, 0.334)
    with pytest.raises(StarnavError, match=r"world\.id is 11"):
        Barn(file=str(file)).check_numbers([7, 10, 11])


@pytest.mark.parametrize("name", ["nowhere.json", ".", "a" * 300])
def test_a_file_that_cannot_be_read(name: str) -> None:
    with pytest.raises(StarnavError, match=r"world\.file is '.*', which cannot be read .* allowed: .*barn_like.* or"):
        make_world(Barn(file=name), 0, 0.334)


@pytest.mark.parametrize(
    ("text", "message"),
    [
        (b'{"worlds": [', "is not JSON"),
        (b"\xff\xfe\x00", "is not JSON"),
        (b"[" * 100_000, "is not JSON"),
        (b"[1, 2]", "has no list of worlds"),
        (b'{"worlds": []}', "has no list of worlds"),
        (b'{"worlds": [3]}', r"worlds\[0\] has the id None; allowed: a whole number"),
        (b'{"worlds": [{"id": 1}, {"id": 1}]}', r"worlds\[1\] has the id 1; allowed: .* each once"),
        (b'{"worlds": [{"id": 7, "start": [0, 0, 0]}]}', "world 7 has no cylinders, goal, path_length_official; all"),
    ],
)
def test_a_file_of_something_else(file: Path, text: bytes, message: str) -> None:
    file.write_bytes(text)
    with pytest.raises(StarnavError, match=message):
        make_world(Barn(file=str(file), id=7), 0, 0.334)


@pytest.mark.parametrize(
    ("changes", "message"),
    [
        ({"cylinders": 3}, "world 7: cylinders is 3; allowed: a list"),
        ({"cylinders": [[1.0, 2.0]]}, r"cylinders\[0\] is \[1.0, 2.0\]; allowed: finite \[x, y, radius\]"),
        ({"cylinders": [[2.0, 2.0, -1.0]]}, r"cylinders\[0\] is .* positive radius"),
        ({"start": [0.0, "a", 0.0]}, "start is"),
        ({"goal": [0.0, float("nan")]}, "goal is"),
        ({"path_length_official": None}, r"path_length_official is \[None\]"),
        ({"path_length_official": 0}, "path_length_official is 0; allowed: 0 < x m"),
        ({"goal": [2.0, 0.3]}, r"goal is \[2, 0.3\], 0.225 m from cylinders\[0\]; allowed: more than robot_radius"),
    ],
)
def test_a_world_that_makes_no_sense(file: Path, changes: dict, message: str) -> None:
    rewrite(file, **changes)
    with pytest.raises(StarnavError, match=message):
        make_world(Barn(file=str(file), id=7), 0, 0.334)
