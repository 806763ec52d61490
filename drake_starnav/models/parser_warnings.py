"""What Drake's parser refuses, or skips with no more than a warning although it blocks the way."""

import logging
import logging.handlers
import re
import warnings
from collections.abc import Callable, Iterator
from contextlib import contextmanager

from drake_starnav.errors import StarnavError, said_by

SKIPPED_SHAPES = re.compile(r"element in geometry|geom\b.*\btype", re.IGNORECASE)
"""Warnings of shapes that are left out."""
REPLACED_INERTIAS = re.compile(r"inertia", re.IGNORECASE)
"""Warnings of inertias that are replaced by others; of all other warnings none matters here."""


@contextmanager
def refuse_parser_warnings(
    place: str, allowed: str = "what Drake's parser reads", said: Callable[[str], str] = str
) -> Iterator[None]:
    """Refuse what Drake's parser does, and shapes that it skips; warn of inertias that it replaces.

    `place` names the file, `allowed` says what can be read, and `said` how a message of the parser is told.

    Raises:
        StarnavError: the parser raised an error, or skipped a shape.
    """
    drake_log = logging.getLogger("drake")
    found_warnings = logging.handlers.MemoryHandler(10**6, flushLevel=logging.CRITICAL + 1)
    found_warnings.setLevel(logging.WARNING)
    handlers, passed_on = drake_log.handlers, drake_log.propagate
    drake_log.handlers, drake_log.propagate = [found_warnings], False
    try:
        yield
    except StarnavError:
        raise
    except (RuntimeError, ValueError) as error:
        error_text = " ".join(said(str(error)).split())
        raise StarnavError(f"{place} cannot be read: {error_text}; allowed: {allowed}") from None
    finally:
        drake_log.handlers, drake_log.propagate = handlers, passed_on
    messages = [record.getMessage() for record in found_warnings.buffer]
    for message in filter(SKIPPED_SHAPES.search, messages):
        raise StarnavError(
            f"{place} cannot be read: {said_by(ValueError(said(message)))}; allowed: what Drake's parser reads"
        )
    for message in filter(REPLACED_INERTIAS.search, messages):
        warnings.warn(f"{place}: {said_by(ValueError(said(message)))}", stacklevel=4)
