"""Files appear whole or not at all."""

import errno
import io
import os
from pathlib import Path

import pytest

from drake_starnav.errors import StarnavError
from drake_starnav.utils import files
from drake_starnav.utils.files import check_outputs, read_bytes, read_text, replace_file, write_text


def test_a_file_appears_once_the_block_has_ended(tmp_path: Path) -> None:
    path = tmp_path / "folder" / "new.txt"
    with replace_file(path) as temporary:
        temporary.write_text("whole")
        assert not path.exists() and temporary.suffix == ".txt"
    assert path.read_text() == "whole" and list(path.parent.iterdir()) == [path]


def test_after_a_failure_the_old_file_is_there_and_nothing_else(tmp_path: Path) -> None:
    path = tmp_path / "kept.txt"
    path.write_text("old")
    with pytest.raises(ValueError), replace_file(path) as temporary:
        temporary.write_text("half")
        raise ValueError
    assert path.read_text() == "old" and list(tmp_path.iterdir()) == [path]


def test_a_link_stays_and_leads_to_the_new_file(tmp_path: Path) -> None:
    target, link = tmp_path / "target.txt", tmp_path / "link.txt"
    link.symlink_to(target)
    write_text(link, "new")
    assert link.is_symlink() and target.read_text() == "new"


def test_what_cannot_be_written_is_named_before_and_leaves_nothing(tmp_path: Path) -> None:
    (tmp_path / "file").touch()
    check_outputs([None, tmp_path / "new" / "x.txt"])
    for path in (tmp_path, tmp_path / "file" / "x.txt", Path("/proc/nowhere/x.txt")):
        for write in (lambda path: check_outputs([path]), lambda path: write_text(path, "")):
            with pytest.raises(StarnavError, match=f"cannot write {path}: .*allowed: a file in a folder"):
                write(path)
    assert list(tmp_path.iterdir()) == [tmp_path / "file"]


def test_no_file_is_written_twice_or_over_what_is_read(tmp_path: Path) -> None:
    first, second = tmp_path / "a.txt", tmp_path / "b.txt"
    first.write_text("read")
    check_outputs([second], [first, "forest"])
    with pytest.raises(StarnavError, match="b.txt is to be written twice; allowed"):
        check_outputs([second, tmp_path / "." / "b.txt"])
    with pytest.raises(StarnavError, match="a.txt is to be read and written; allowed"):
        check_outputs([first], [str(first)])


def test_a_text_is_read_with_or_without_a_mark_and_else_the_reason_is_told(tmp_path: Path) -> None:
    (tmp_path / "marked").write_bytes("\ufeffä".encode())
    assert read_text(tmp_path / "marked") == "ä"
    (tmp_path / "latin").write_bytes(b"\xe4")
    with pytest.raises(StarnavError, match="notes cannot be read: .* at byte 0; allowed: a text file in UTF-8"):
        read_text(tmp_path / "latin", "notes")
    with pytest.raises(StarnavError, match="missing cannot be read: no such file"):
        read_text(tmp_path / "missing")


def test_only_regular_files_of_a_bounded_size_are_read(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    endless, pipe, large, secret = (tmp_path / name for name in ("endless", "pipe", "large", "secret"))
    endless.symlink_to("/dev/zero")
    os.mkfifo(pipe)
    large.write_bytes(b"12345678")
    secret.write_bytes(b"1")
    opened = io.open

    def forbid(file, *mode, **more):
        if Path(str(file)) == secret:
            raise PermissionError(errno.EACCES, "Permission denied", str(file))
        return opened(file, *mode, **more)

    monkeypatch.setattr(io, "open", forbid)
    monkeypatch.setattr(files, "LARGEST_FILE", 7)
    irregular = ((endless, "no regular file"), (pipe, "no regular file"), (tmp_path, "a folder"))
    for path, reason in (*irregular, (large, "it has more than"), (secret, "Permission denied")):
        for read in (lambda path: read_bytes(path, str(path), "a file"), read_text):
            with pytest.raises(StarnavError, match=f"{path} cannot be read: {reason}"):
                read(path)
