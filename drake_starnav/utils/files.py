"""Reads regular files of a reasonable size only, and writes files whole or not at all."""

import errno
import os
import re
import tempfile
from collections.abc import Iterable, Iterator, Sequence
from contextlib import contextmanager
from pathlib import Path

from drake_starnav.errors import StarnavError

LARGEST_FILE = 256 * 2**20
"""Limit for files of worlds, models and maps, bytes; a larger one would only fill the memory."""
_NAME_PART = 40
"""Characters of a text, or of a file's name in its temporary one, in a name that would be too long otherwise."""


def read_bytes(path: Path | str, largest: int = LARGEST_FILE) -> bytes:
    """The content of a regular file.

    Raises:
        OSError: it cannot be read, has more bytes than `largest`, or is a pipe or a device, which may never end.
    """
    try:
        path = Path(path)
        check_regular(path)
        if path.stat().st_size > largest:
            raise OSError(f"it has {path.stat().st_size} bytes, more than {largest}")
        return path.read_bytes()
    except ValueError as error:  # a null byte in its name
        raise OSError(str(error)) from None


def read_text(path: Path | str, place: str = "", largest: int = LARGEST_FILE) -> str:
    """The content of a text file in UTF-8, with or without a byte order mark.

    Raises:
        StarnavError: as of `read_bytes`, or it is not UTF-8; `place` is its name in the message, if not its path.
    """
    try:
        return read_bytes(path, largest).decode("utf-8-sig")
    except (OSError, UnicodeDecodeError) as error:
        reason = f"{error.reason} at byte {error.start}" if isinstance(error, UnicodeDecodeError) else reason_of(error)
        raise StarnavError(f"{place or path} cannot be read: {reason}; allowed: a text file in UTF-8") from None


@contextmanager
def replacing(path: Path) -> Iterator[Path]:
    """A temporary file beside `path` that takes its name once the block has ended well, and is removed otherwise.

    The folder is made, and the temporary name has the same suffix.

    Raises:
        StarnavError: the file cannot be written.
    """
    temporary = None
    try:
        try:
            target = _resolved(path)  # a link stays, and leads to the new file
            check_regular(target)
            target.parent.mkdir(parents=True, exist_ok=True)
            prefix, suffix = f".{target.stem[:_NAME_PART]}.", path.suffix[:_NAME_PART]
            handle, name = tempfile.mkstemp(dir=target.parent, prefix=prefix, suffix=suffix)
            os.close(handle)
            temporary = Path(name)
            yield temporary
            temporary.chmod(0o666 & ~_umask())
            temporary.replace(target)
        except OSError as error:
            raise unwritable(path, error) from None
    finally:
        if temporary is not None:
            temporary.unlink(missing_ok=True)


def write_text(path: Path, text: str) -> None:
    """Write a text file in UTF-8 whole or not at all; of names of files that are none, their bytes are written out."""
    with replacing(path) as temporary:
        temporary.write_text(text, encoding="utf-8", errors="backslashreplace")


def check_regular(path: Path) -> None:
    """Raise an `OSError` if something is at `path` that is no regular file."""
    if path.is_dir():
        raise IsADirectoryError("it is a folder")
    if path.exists() and not path.is_file():
        raise OSError("it is not a regular file")


def _resolved(path: Path) -> Path:
    """Where a path leads through links; an `OSError` if in a circle, which each Python reports differently."""
    try:
        target = Path(os.path.realpath(path))
    except ValueError as error:  # a null byte
        raise OSError(str(error)) from None
    if any(part.is_symlink() for part in (target, *target.parents)):
        raise OSError(errno.ELOOP, os.strerror(errno.ELOOP))
    return target


def _umask() -> int:
    """The permission bits that new files do not get."""
    mask = os.umask(0o077)
    os.umask(mask)
    return mask


def check_outputs(outputs: Sequence[Path | None], inputs: Iterable[Path | str] = ()) -> None:
    """Raise `StarnavError` unless all files can be written, each once and none over an input; writes nothing.

    None among the outputs is skipped, and so are inputs that are no files.
    """
    read, written = {Path(path).resolve() for path in inputs if os.path.isfile(path)}, set()
    for path in outputs:
        if path is None:
            continue
        try:
            target = _resolved(path)
        except OSError as error:  # a loop of links, a null byte
            raise unwritable(path, error) from None
        if target in written:
            raise StarnavError(f"{path} is to be written twice; allowed: a file of its own for each")
        if target in read:
            raise StarnavError(f"{path} is to be read and written; allowed: another file to write")
        written.add(target)
        check_writable(path)
    for path in written:
        if parents := written & {*path.parents}:
            raise StarnavError(f"{path} is to be in {parents.pop()}, which is to be a file; allowed: another folder")


def check_writable(path: Path | None) -> None:
    """Raise `StarnavError` unless a file can be written at `path`, its folder made first; leaves no trace."""
    if path is None:
        return
    try:
        check_regular(path)
        target = _resolved(path)
        folder = next(folder for folder in target.parents if folder.exists())
        if folder == target.parent:
            with tempfile.TemporaryFile(dir=folder):
                pass
        else:
            with tempfile.TemporaryDirectory(dir=folder):
                pass
        if path.exists() and not os.access(path, os.W_OK):
            raise PermissionError("it is write-protected")
    except OSError as error:
        raise unwritable(path, error) from None


def unwritable(path: Path, error: Exception) -> StarnavError:
    """The error for a file that cannot be written."""
    return StarnavError(f"cannot write {path}: {reason_of(error)}; allowed: a file in a folder you may write to")


def file_name(text: str) -> str:
    """The text as part of a file name: shortened, other characters replaced; a scenario's name may be any text."""
    return re.sub(r"[^\w .+-]|^\.", "_", text)[:_NAME_PART]


def reason_of(error: Exception) -> str:
    """The operating system's reason, without the name of the file."""
    return getattr(error, "strerror", None) or str(error)
