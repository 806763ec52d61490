"""What Numba compiles: all that its cache lacks, as in the first run after an installation."""

import multiprocessing
import sys
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from contextvars import ContextVar
from functools import cache

COMPILING = "compiling, once"
"""What a first run says before anything else."""

_reported: ContextVar[bool] = ContextVar("_reported", default=False)


@cache
def say_compiling() -> None:
    """Say on standard error that functions are compiled: once in a process, and not in the workers of another one."""
    if multiprocessing.parent_process() is None:
        print(COMPILING, file=sys.stderr, flush=True)


@contextmanager
def compilations(report: Callable[[int], None] = lambda count: say_compiling()) -> Iterator[None]:
    """Call a function with the number of functions that Numba has compiled: with 0 when it begins, then with each.

    Within another such context nothing is called: that one reports already.
    """
    if _reported.get():
        yield
        return
    from numba.core import event

    class Count(event.Listener):
        begun = ended = 0

        def on_start(self, _: event.Event) -> None:
            if self.begun == 0:
                report(0)
            self.begun += 1

        def on_end(self, _: event.Event) -> None:
            self.ended += 1
            report(self.ended)

    token = _reported.set(True)
    try:
        with event.install_listener("numba:compile", Count()):
            yield
    finally:
        _reported.reset(token)
