"""What Drake's parser skips with no more than a warning, although it blocks the way or moves."""

import logging
import re
from collections.abc import Iterator
from contextlib import contextmanager

from drake_starnav.errors import StarnavError, said_by

SKIPPED = re.compile(r"element in geometry|geom\b.*\btype|inertia", re.IGNORECASE)
"""Warnings of shapes that are left out, and of inertias that are replaced by others."""


@contextmanager
def none_skipped(place: str) -> Iterator[None]:
    """Refuse what Drake's parser skips; its other warnings, of what does not matter here, are not shown.

    Raises:
        StarnavError: at the end, a shape or an inertia of the file that `place` names was skipped.
    """
    log, found = logging.getLogger("drake"), _Messages()
    handlers, passed_on = log.handlers, log.propagate
    log.handlers, log.propagate = [found], False
    try:
        yield
    finally:
        log.handlers, log.propagate = handlers, passed_on
    for message in found.messages:
        if SKIPPED.search(message):
            raise StarnavError(
                f"{place} cannot be read: {said_by(ValueError(message))}; allowed: what Drake's parser reads"
            )


class _Messages(logging.Handler):
    def __init__(self) -> None:
        super().__init__(logging.WARNING)
        self.messages: list[str] = []

    def emit(self, record: logging.LogRecord) -> None:
        self.messages.append(record.getMessage())
