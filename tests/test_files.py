"""Files appear whole or not at all."""

import os
from pathlib import Path

import pytest

from drake_starnav.errors import StarnavError
from drake_starnav.files import check_outputs, check_writable, replacing, write_text


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


def test_a_link_stays_and_leads_to_the_new_file(tmp_path: Path) -> None:
    target, link = tmp_path / "target.txt", tmp_path / "link.txt"
    target.write_text("old")
    link.symlink_to(target)
    write_text(link, "new")
    assert link.is_symlink() and target.read_text() == "new"


def test_a_file_gets_the_permissions_that_the_umask_leaves(tmp_path: Path) -> None:
    before = os.umask(0o077)
    try:
        write_text(tmp_path / "mine.txt", "")
    finally:
        os.umask(before)
    assert (tmp_path / "mine.txt").stat().st_mode & 0o777 == 0o600


def test_what_is_no_regular_file_is_left_alone(tmp_path: Path) -> None:
    pipe = tmp_path / "pipe"
    os.mkfifo(pipe)
    for write in (check_writable, lambda path: write_text(path, "")):
        with pytest.raises(StarnavError, match=f"cannot write {pipe}: it is not a regular file"):
            write(pipe)
    assert pipe.is_fifo()


def test_no_file_is_written_twice_or_over_what_is_read(tmp_path: Path) -> None:
    first, second = tmp_path / "a.txt", tmp_path / "b.txt"
    first.write_text("read")
    (tmp_path / "link.txt").symlink_to(first)
    check_outputs([second, None, tmp_path / "new" / "c.txt"], [first, "forest"])
    with pytest.raises(StarnavError, match="b.txt is to be written twice; allowed"):
        check_outputs([second, tmp_path / "." / "b.txt"])
    for path in (first, tmp_path / "link.txt"):
        with pytest.raises(StarnavError, match=f"{path.name} is to be read and written; allowed"):
            check_outputs([path], [str(first)])
    assert first.read_text() == "read"
