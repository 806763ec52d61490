"""What Numba compiles: all that its cache lacks, as in the first run after an installation."""

import signal
import threading
from typing import Any

from numba.core import event

from drake_starnav.utils.progress import Progress

COMPILING = "compiling, once"
"""What a first run says."""
PACKAGE = __name__.partition(".")[0]


class _Compilation(event.Listener):
    """Shows the number of this package's functions that have been compiled, while one is, and keeps Ctrl-C waiting for
    its end: LLVM's callbacks lose it, or leave objects half made."""

    def __init__(self) -> None:
        self._depth, self._done = 0, 0
        self._handler: Any = None
        self._interrupted = False
        self._progress: Progress | None = None

    def on_start(self, event: event.Event) -> None:
        """A function is about to be compiled, often as part of another one."""
        if self._depth == 0 and not (event.data["dispatcher"].py_func.__module__ or "").startswith(f"{PACKAGE}."):
            return
        self._depth += 1
        if self._depth == 1 and threading.current_thread() is threading.main_thread():
            self._handler = signal.getsignal(signal.SIGINT)
            if callable(self._handler):
                signal.signal(signal.SIGINT, self._wait)
        if self._progress is None:
            self._progress = Progress(COMPILING)
        self._progress.show(0.0, f"{self._done} functions")

    def on_end(self, event: event.Event) -> None:
        """It has been compiled."""
        if self._depth == 0:
            return
        self._depth, self._done = self._depth - 1, self._done + 1
        if self._depth > 0:
            return
        if self._progress is not None:
            self._progress.close()
        if callable(self._handler) and threading.current_thread() is threading.main_thread():
            signal.signal(signal.SIGINT, self._handler)
            if self._interrupted:
                self._interrupted = False
                self._handler(signal.SIGINT, None)

    def _wait(self, *signal: Any) -> None:
        self._interrupted = True


_compilation = _Compilation()
event.register("numba:compile", _compilation)
