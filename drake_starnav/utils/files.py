"""Reads text files, and writes files whole or not at all."""

import io
import os
import re
import tempfile
from collections.abc import Iterable, Iterator, Sequence
from contextlib import contextmanager
from json import JSONDecodeError
from pathlib import Path

from drake_starnav.errors import StarnavError, said_by

LARGEST_FILE = 200_000_000
"""Bytes that are read of a file at most."""
_NAME_PART = 40
"""Characters of a text, or of a file's name in its temporary one, in a name that would be too long otherwise."""


@contextmanager
def explain_read_errors(place: str, allowed: str) -> Iterator[None]:
    """Tell in one `StarnavError` why a file cannot be read, whatever its reader raises: a damaged file may do anything.

    Args:
        place: the file in the message.
        allowed: what can be read.
    """
    try:
        yield
    except StarnavError:
        raise
    except Exception as error:
        raise StarnavError(f"{place} cannot be read: {extract_reason(error)}; allowed: {allowed}") from None


def explain_missing_file(path: Path | None) -> str:
    """Why there is no file to read: `no such file`, or `a folder`; empty if there is one."""
    if path is None or not path.exists():
        return "no such file"
    return "" if path.is_file() else "a folder" if path.is_dir() else "no regular file"


def read_bytes(path: Path | str, place: str, allowed: str, *, may_be_empty: bool = False) -> bytes:
    """Return the content of a regular file of at most `LARGEST_FILE` bytes; arguments and errors as of `reading`.

    A device may have no end, and a pipe may never be written.
    """
    with explain_read_errors(place, allowed):
        if file_fault := explain_missing_file(Path(path)):
            raise ValueError(file_fault)
        with Path(path).open("rb") as file:
            file_content = file.read(LARGEST_FILE + 1)
        if len(file_content) > LARGEST_FILE:
            raise ValueError(f"it has more than {LARGEST_FILE // 10**6} MB")
        if file_content or may_be_empty:
            return file_content
        raise ValueError("it is empty")


def read_text(path: str | os.PathLike, place: str = "", allowed: str = "a text file in UTF-8") -> str:
    """Return the content of a text file in UTF-8, with or without a byte order mark; errors as of `read_bytes`."""
    file_content = read_bytes(Path(path), place or str(path), allowed, may_be_empty=True)
    with (
        explain_read_errors(place or str(path), allowed),
        io.TextIOWrapper(io.BytesIO(file_content), encoding="utf-8-sig") as text,
    ):
        return text.read()


@contextmanager
def replace_file(path: Path) -> Iterator[Path]:
    """A temporary file beside `path` that takes its name once the block has ended well, and is removed otherwise.

    The folder is made, and the temporary name has the same suffix.

    Raises:
        StarnavError: the file cannot be written.
    """
    target_path = path.resolve()  # a link stays, and leads to the new file
    temporary_path = target_path.with_name(f".{target_path.stem[:_NAME_PART]}.{os.getpid()}{path.suffix[:_NAME_PART]}")
    try:
        target_path.parent.mkdir(parents=True, exist_ok=True)
        try:
            yield temporary_path
            temporary_path.replace(target_path)
        finally:
            temporary_path.unlink(missing_ok=True)
    except OSError as error:
        raise make_write_error(path, error) from None


def write_text(path: Path, text: str) -> None:
    """Write a text file in UTF-8 whole or not at all; of names of files that are none, their bytes are written out."""
    with replace_file(path) as temporary:
        temporary.write_text(text, encoding="utf-8", errors="backslashreplace")


def check_outputs(outputs: Sequence[Path | None], inputs: Iterable[Path | str] = ()) -> None:
    """Raise `StarnavError` unless all files can be written, each once and none over an input; writes nothing.

    None among the outputs is skipped, and so are inputs that are no files.
    """
    read_paths, written_paths = {Path(path).resolve() for path in inputs if os.path.isfile(path)}, set()
    for path in filter(None, outputs):
        target_path = path.resolve()
        if target_path in written_paths:
            raise StarnavError(f"{path} is to be written twice; allowed: a file of its own for each")
        if target_path in read_paths:
            raise StarnavError(f"{path} is to be read and written; allowed: another file to write")
        written_paths.add(target_path)
        check_writable(path)


def check_writable(path: Path) -> None:
    """Raise `StarnavError` unless a file can be written at `path`, its folder made first; leaves no trace."""
    try:
        if path.is_dir():
            raise IsADirectoryError("it is a folder")
        folder = next(folder for folder in path.resolve().parents if folder.exists())
        with tempfile.TemporaryFile(dir=folder):
            pass
        if path.exists() and not os.access(path, os.W_OK):
            raise PermissionError("it is write-protected")
    except OSError as error:
        raise make_write_error(path, error) from None


def make_write_error(path: Path, error: Exception) -> StarnavError:
    """The error for a file that cannot be written."""
    return StarnavError(f"cannot write {path}: {extract_reason(error)}; allowed: a file in a folder you may write to")


def make_file_name(text: str) -> str:
    """The text as part of a file name: shortened, other characters replaced; a scenario's name may be any text."""
    return re.sub(r"[^\w .+-]|^\.", "_", text)[:_NAME_PART]


def extract_reason(error: Exception) -> str:
    """What an error says, without the name of the file."""
    if isinstance(error, UnicodeDecodeError):
        return f"no text in UTF-8, {error.reason} at byte {error.start}"
    if isinstance(error, JSONDecodeError):
        return f"no JSON, {said_by(error)}" if error.doc.strip() else "it is empty"
    return getattr(error, "strerror", None) or said_by(error)
