"""Files appear whole or not at all."""

import os
from pathlib import Path

import pytest

from drake_starnav.errors import StarnavError
from drake_starnav.files import check_writable, replacing, write_text


def test_a_file_appears_once_the_block_has_ended(tmp_path: Path) -> None:
    path = tmp_path / "new.txt"
    with replacing(path) as temporary:
        temporary.write_text("whole")
        assert not path.exists()
        assert temporary.suffix == ".txt"
    assert path.read_text() == "whole"
    assert list(tmp_path.iterdir()) == [path]
    assert path.stat().st_mode & 0o777 == 0o644


def test_after_a_failure_the_old_file_is_there_and_nothing_else(tmp_path: Path) -> None:
    path = tmp_path / "kept.txt"
    path.write_text("old")
    with pytest.raises(ValueError), replacing(path) as temporary:
        temporary.write_text("half")
        raise ValueError
    assert path.read_text() == "old"
    assert list(tmp_path.iterdir()) == [path]


def test_what_is_in_the_way_is_named(tmp_path: Path) -> None:
    for path in (tmp_path, tmp_path / "nowhere" / "x.txt"):
        with pytest.raises(StarnavError, match=f"cannot write {path}.*allowed: a file"):
            write_text(path, "")
    assert os.listdir(tmp_path) == []


def test_a_folder_is_made_and_checking_leaves_no_file(tmp_path: Path) -> None:
    check_writable(tmp_path / "new" / "x.txt")
    check_writable(None)
    assert list((tmp_path / "new").iterdir()) == []
