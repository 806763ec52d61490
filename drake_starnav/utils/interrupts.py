"""Ctrl-C, at any moment of a command: raised where work can end in order, and kept from the processes it starts."""

import os
import signal
import sys
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from types import FrameType

INTERRUPTED = 130
"""The exit code after Ctrl-C, as shells have it."""
RETRY = 0.02
"""Where nothing may be interrupted, as in an import: time until the next look, s."""
WHOLE = ("<frozen importlib", "llvmlite" + os.sep)
"""In the files of what must not be interrupted: imports, whose errors have many forms, and LLVM's objects, which are
freed twice if their owner is not told."""


class _Interrupts:
    """What is known of Ctrl-C in this process: whether it was pressed, and whether it must wait."""

    requested = False
    held = False


def run_interruptibly(name: str, work: Callable[[], int]) -> int:
    """Do the work of a process, the program of a name, from its first import to its end; returns the exit code.

    Ctrl-C raises `KeyboardInterrupt`, but not within what must be `WHOLE`; one that is lost, as in a finalizer, is
    raised again. If `work` does not catch it, it is reported in one sentence.
    """
    try:
        signal.signal(signal.SIGINT, _interrupt)
        signal.signal(signal.SIGALRM, _interrupt)
        sys.unraisablehook = _lost
        return work()
    except BaseException:
        if not _Interrupts.requested:
            raise
        end_quietly()
        print(f"{name}: interrupted", file=sys.stderr)
        return INTERRUPTED
    finally:
        end_quietly()


def end_quietly() -> bool:
    """Let the process end without further interruptions, from where it is; returns whether one was requested."""
    if signal.getsignal(signal.SIGINT) is _interrupt:
        signal.signal(signal.SIGINT, signal.SIG_IGN)
        signal.setitimer(signal.ITIMER_REAL, 0.0)
    return _Interrupts.requested


@contextmanager
def held() -> Iterator[None]:
    """Ctrl-C waits for the end of this block, if the process is `run_interruptibly`."""
    before, _Interrupts.held = _Interrupts.held, True
    try:
        yield
    finally:
        _Interrupts.held = before


@contextmanager
def kept_from_children() -> Iterator[None]:
    """Processes started in this block never receive Ctrl-C, which a terminal sends to all: their parent ends them."""
    before = signal.pthread_sigmask(signal.SIG_BLOCK, {signal.SIGINT})
    try:
        with held():  # another thread of this process may receive it
            yield
    finally:
        signal.pthread_sigmask(signal.SIG_SETMASK, before)


def _interrupt(number: int, frame: FrameType | None) -> None:
    _Interrupts.requested = True
    wait = _Interrupts.held
    while frame is not None and not wait:
        wait = any(part in frame.f_code.co_filename for part in WHOLE)
        frame = frame.f_back
    if not wait:
        raise KeyboardInterrupt
    signal.setitimer(signal.ITIMER_REAL, RETRY)


def _lost(error: "sys.UnraisableHookArgs") -> None:
    """An error where none can be raised."""
    if issubclass(error.exc_type, KeyboardInterrupt):
        signal.setitimer(signal.ITIMER_REAL, RETRY)
    elif not _Interrupts.requested:
        sys.__unraisablehook__(error)
