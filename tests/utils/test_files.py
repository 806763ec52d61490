"""Files appear whole or not at all."""

import os
import re
from pathlib import Path

import pytest

from drake_starnav.errors import StarnavError
from drake_starnav.utils.files import check_outputs, check_writable, read_bytes, read_text, replacing, write_text


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
    (tmp_path / "file").touch()
    (tmp_path / "loop").symlink_to("loop")
    for path in (
        tmp_path, tmp_path / "file" / "x.txt", tmp_path / "loop", tmp_path / "loop" / "x", tmp_path / ("x" * 300),
        tmp_path / ("x" * 300) / "y", Path("/"), Path("/proc/nowhere/x.txt"), Path("/dev/full"), Path(""), Path("a\0b"),
    ):  # fmt: skip
        with pytest.raises(StarnavError, match=f"cannot write {re.escape(str(path))}.*allowed: a file"):
            check_outputs([path])
        with pytest.raises(StarnavError, match=f"cannot write {re.escape(str(path))}.*allowed: a file"):
            write_text(path, "")
    assert sorted(os.listdir(tmp_path)) == ["file", "loop"]


def test_checking_leaves_nothing_and_writing_makes_the_folder(tmp_path: Path) -> None:
    path = tmp_path / "new" / "folder" / "x.txt"
    check_outputs([path])
    check_writable(None)
    assert os.listdir(tmp_path) == []
    write_text(path, "there")
    assert path.read_text() == "there"


def test_no_file_is_to_be_in_another(tmp_path: Path) -> None:
    with pytest.raises(StarnavError, match="is to be in .*a.html, which is to be a file"):
        check_outputs([tmp_path / "a.html", tmp_path / "a.html" / "b.json"])


def test_only_regular_files_of_a_reasonable_size_are_read(tmp_path: Path) -> None:
    os.mkfifo(tmp_path / "pipe")
    (tmp_path / "zero").symlink_to("/dev/zero")
    (tmp_path / "loop").symlink_to("loop")
    with open(tmp_path / "huge", "wb") as file:
        file.truncate(10**12)
    for name in ("pipe", "zero", "huge", "loop", "missing", ".", "a\0b"):
        with pytest.raises(OSError):
            read_bytes(tmp_path / name)
    (tmp_path / "marked").write_bytes("\ufeffä".encode())
    assert read_text(tmp_path / "marked") == "ä"
    (tmp_path / "latin").write_bytes(b"\xe4")
    with pytest.raises(StarnavError, match="notes cannot be read: .* at byte 0; allowed: a text file in UTF-8"):
        read_text(tmp_path / "latin", "notes")
    with pytest.raises(StarnavError, match="missing cannot be read: No such file"):
        read_text(tmp_path / "missing")


def test_a_link_stays_and_leads_to_the_new_file(tmp_path: Path) -> None:
    target, link = tmp_path / "target.txt", tmp_path / "link.txt"
    target.write_text("old")
    link.symlink_to(target)
    write_text(link, "new")
    assert link.is_symlink() and target.read_text() == "new"


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
