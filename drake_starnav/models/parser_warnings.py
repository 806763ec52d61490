"""What Drake's parser refuses, or skips with no more than a warning although it blocks the way or moves."""

import logging
import logging.handlers
import re
from collections.abc import Callable, Iterator
from contextlib import contextmanager

from drake_starnav.errors import StarnavError, said_by

SKIPPED = re.compile(r"element in geometry|geom\b.*\btype|inertia", re.IGNORECASE)
"""Warnings of shapes that are left out, and of inertias that are replaced by others."""


@contextmanager
def parsing(place: str, allowed: str = "what Drake's parser reads", said: Callable[[str], str] = str) -> Iterator[None]:
    """Refuse what Drake's parser does, and what it skips; its other warnings, which do not matter here, are not shown.

    `place` names the file, `allowed` says what can be read, and `said` how a message of the parser is told.

    Raises:
        StarnavError: the parser raised an error, or skipped a shape or an inertia.
    """
    log, found = logging.getLogger("drake"), logging.handlers.MemoryHandler(10**6, flushLevel=logging.CRITICAL + 1)
    found.setLevel(logging.WARNING)
    handlers, passed_on = log.handlers, log.propagate
    log.handlers, log.propagate = [found], False
    try:
        yield
    except StarnavError:
        raise
    except (RuntimeError, ValueError) as error:
        reason = " ".join(said(str(error)).split())
        raise StarnavError(f"{place} cannot be read: {reason}; allowed: {allowed}") from None
    finally:
        log.handlers, log.propagate = handlers, passed_on
    for message in filter(SKIPPED.search, (record.getMessage() for record in found.buffer)):
        raise StarnavError(
            f"{place} cannot be read: {said_by(ValueError(message))}; allowed: what Drake's parser reads"
        )
