"""What files of numbered worlds have in common; their kinds' own tests try broken files."""

import json

import pytest

from drake_starnav.errors import StarnavError
from drake_starnav.worlds.formats.world_file import WorldFile, check_keys


def test_worlds_are_found_by_their_numbers(tmp_path) -> None:
    path = tmp_path / "x.json"
    path.write_text(json.dumps({"worlds": [{"id": 3, "size": 1}, {"id": 4}, {"id": 9}]}))
    file = WorldFile.read("Kind", str(path))
    assert file.world(3, ("size",)) == (f"{path}: world 3", {"id": 3, "size": 1})
    file.check_numbers([9, 3])
    with pytest.raises(StarnavError, match=r"world\.id is 5; allowed: a world of .*x\.json: 3-4, 9"):
        file.world(5, ())
    with pytest.raises(StarnavError, match="world 4 has no size; allowed: a mapping with size"):
        file.world(4, ("size",))


@pytest.mark.parametrize(("kind", "others"), [("Barn", "barn_like"), ("DynaBarn", "dynabarn_like")])
def test_a_kind_is_told_its_own_shipped_files(kind: str, others: str) -> None:
    with pytest.raises(StarnavError, match=rf"world\.file is 'none', .*; allowed: {others}, or the path"):
        WorldFile.read(kind, "none")


@pytest.mark.parametrize("entry", [None, 3, [1], {"a": 1}])
def test_keys_that_lack_are_named(entry) -> None:
    with pytest.raises(StarnavError, match=r"here has no .*b; allowed: a mapping with a, b"):
        check_keys(entry, "here", ("a", "b"))
