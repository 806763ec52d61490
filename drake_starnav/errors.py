"""The base class of all errors that this package raises on purpose, and helpers for their messages."""

from collections.abc import Iterator
from typing import Any

LONGEST_VALUE = 100
"""Characters of a value that a message shows at most."""


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
    """Return `repr(value)` for a message, shortened to `most` characters; no more of the value is written out."""
    text = ""
    for piece in _repr_pieces(value, most):
        text += piece
        if len(text) > most:
            return f"{text[: most - 3]}..."
    return text


def _repr_pieces(value: Any, most: int) -> Iterator[str]:
    """Yield what `repr` writes, piece by piece: lists in YAML that hold one list many times would fill the memory."""
    kind: Any = type(value)
    writes: Any = kind.__repr__
    if writes is dict.__repr__:
        yield "{"
        for k, (key, item) in enumerate(value.items()):
            yield ", " if k > 0 else ""
            yield from _repr_pieces(key, most)
            yield ": "
            yield from _repr_pieces(item, most)
        yield "}"
    elif writes in (list.__repr__, tuple.__repr__):
        yield "[" if isinstance(value, list) else "("
        for k, item in enumerate(value):
            yield ", " if k > 0 else ""
            yield from _repr_pieces(item, most)
        yield "]" if isinstance(value, list) else ",)" if len(value) == 1 else ")"
    else:
        yield repr(value[: most + 1] if kind in (str, bytes) else value)


def one_line(text: str) -> str:
    """The text without line breaks and control characters, which names of files may have, as Python writes them."""
    return "".join(c if c.isprintable() or c == "\u00a0" else repr(c)[1:-1] for c in text)


def counted(count: int, noun: str) -> str:
    """`1 scan`, but `2 scans`."""
    return f"{count} {noun}{'' if count == 1 else 's'}"


def said_by(error: BaseException) -> str:
    """The message of another library's error, in one line, shortened, without a full stop."""
    text = " ".join(str(error).split()).removesuffix(".")
    return text if len(text) <= 5 * LONGEST_VALUE else f"{text[: 5 * LONGEST_VALUE - 3]}..."
