"""The base class of all errors that this package raises on purpose, and helpers for their messages."""

from collections.abc import Iterator
from typing import Any

LONGEST_VALUE = 100
"""Characters of a value that a message shows at most."""
MOST_DIGITS = 1000
"""Larger whole numbers are not written out."""


class StarnavError(ValueError):
    """Bad input: the message names the place, the value found, and what is allowed."""


class UnsupportedError(StarnavError):
    """A method that is not applicable in a world, which is not a failed trial."""


def check_kind(value: Any, kind: type, name: str, source: str) -> None:
    """Raise a `StarnavError` unless an argument is of a kind.

    Args:
        value: of the argument.
        kind: that it must have.
        name: of the argument.
        source: where such a value comes from, in words.
    """
    if not isinstance(value, kind):
        raise StarnavError(f"{name} is {shown(value)}; allowed: a {kind.__name__}, {source}")


def shown(value: Any, most: int = LONGEST_VALUE) -> str:
    """`repr(value)` for a message, shortened to `most` characters without building more of it.

    A value from a file may not fit in memory once it is written out: a few aliases of YAML may expand to billions of
    entries.
    """
    text = ""
    for piece in _pieces(value, most):
        text += piece
        if len(text) > most:
            return f"{text[: most - 3]}..."
    return text


def _pieces(value: Any, most: int) -> Iterator[str]:
    """The parts of `repr(value)` one after another."""
    if isinstance(value, dict):
        yield "{"
        for k, (key, entry) in enumerate(value.items()):
            yield ", " if k else ""
            yield from _pieces(key, most)
            yield ": "
            yield from _pieces(entry, most)
        yield "}"
    elif isinstance(value, (list, tuple)):
        left, right = "[]" if isinstance(value, list) else ("(", ",)" if len(value) == 1 else ")")
        yield left
        for k, entry in enumerate(value):
            yield ", " if k else ""
            yield from _pieces(entry, most)
        yield right
    elif isinstance(value, (str, bytes)):
        dots = "..." if isinstance(value, str) else b"..."
        yield repr(value if len(value) <= most else value[: most - 10] + dots)  # type: ignore[operator]
    elif isinstance(value, int) and value.bit_length() > 3.3 * MOST_DIGITS:
        yield f"a whole number of {value.bit_length()} bits"
    else:
        yield repr(value)


def one_line(text: str) -> str:
    """The text without line breaks and control characters, which names of files may have, as Python writes them."""
    return "".join(c if c.isprintable() or c == "\u00a0" else repr(c)[1:-1] for c in text)


def said_by(error: BaseException) -> str:
    """The message of another library's error, in one line and shortened."""
    text = " ".join(str(error).split())
    return text if len(text) <= 5 * LONGEST_VALUE else f"{text[: 5 * LONGEST_VALUE - 3]}..."
