"""Files that are written whole or not at all."""

import os
import tempfile
from collections.abc import Iterator, Sequence
from contextlib import contextmanager
from pathlib import Path

from drake_starnav.errors import StarnavError


@contextmanager
def replacing(path: Path) -> Iterator[Path]:
    """A temporary file beside `path` that takes its name once the block has ended well, and is removed otherwise.

    Args:
        path: of the file to write; the temporary name has the same suffix.

    Raises:
        StarnavError: the file cannot be written.
    """
    temporary, target = None, path.resolve()  # a link stays, and leads to the new file
    try:
        try:
            _check_regular(target)
            handle, name = tempfile.mkstemp(dir=target.parent, prefix=f".{target.stem}.", suffix=path.suffix)
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
    """Write a text file whole or not at all."""
    with replacing(path) as temporary:
        temporary.write_text(text, encoding="utf-8")


def _check_regular(path: Path) -> None:
    """Raise an `OSError` if something is at `path` that is no regular file."""
    if path.is_dir():
        raise IsADirectoryError("it is a folder")
    if path.exists() and not path.is_file():
        raise OSError("it is not a regular file")


def _umask() -> int:
    """The permissions that new files do not get."""
    mask = os.umask(0o077)
    os.umask(mask)
    return mask


def check_outputs(outputs: Sequence[Path | None], inputs: Sequence[Path | str] = ()) -> None:
    """Raise `StarnavError` unless all files can be written, each once and over none that is read; makes their folders.

    Args:
        outputs: what is to be written; None is nothing.
        inputs: what is read; names that are no files count as nothing.
    """
    read, written = {Path(path).resolve() for path in inputs if os.path.isfile(path)}, set()
    for path in outputs:
        if path is None:
            continue
        target = path.resolve()
        if target in written:
            raise StarnavError(f"{path} is to be written twice; allowed: a file of its own for each")
        if target in read:
            raise StarnavError(f"{path} is to be read and written; allowed: another file to write")
        written.add(target)
        check_writable(path)


def check_writable(path: Path | None) -> None:
    """Raise `StarnavError` unless a file can be written at `path`; makes its folder."""
    if path is None:
        return
    try:
        _check_regular(path)
        path.parent.mkdir(parents=True, exist_ok=True)
        with tempfile.TemporaryFile(dir=path.parent):
            pass
        if path.exists() and not os.access(path, os.W_OK):
            raise PermissionError("it is write-protected")
    except OSError as error:
        raise unwritable(path, error) from None


def unwritable(path: Path, error: OSError) -> StarnavError:
    """What to say when a file cannot be written."""
    return StarnavError(f"cannot write {path}: {error.strerror or error}; allowed: a file in a folder you may write to")
