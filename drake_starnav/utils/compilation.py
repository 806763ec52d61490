"""What Numba compiles: all that its cache lacks, as in the first run after an installation."""

import gc
from typing import Any

from numba.core import caching, event

from drake_starnav.utils.progress import Progress

COMPILING = "compiling, once"
"""What a first run says."""
PACKAGE = __name__.partition(".")[0]


class _Compilation(event.Listener):
    """Shows the number of this package's functions that have been compiled, while one is.

    Meanwhile garbage is not collected: what the compiler has made is in use, and looking through it takes 7 % of all.
    """

    def __init__(self) -> None:
        self._depth, self._done, self._collects = 0, 0, False
        self._progress: Progress | None = None

    def on_start(self, event: event.Event) -> None:
        """A function is about to be compiled, often as part of another one."""
        dispatcher = event.data["dispatcher"]
        if self._depth == 0 and not (dispatcher.py_func.__module__ or "").startswith(f"{PACKAGE}."):
            return
        dispatcher.targetoptions["no_cfunc_wrapper"] = True  # what C would call, a tenth of all: nobody does
        if self._depth == 0:
            self._collects = gc.isenabled()
            gc.disable()
        self._depth += 1
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
        if self._collects:
            gc.enable()
        if self._progress is not None:
            self._progress.hide()


class _Cache(caching.IndexDataCacheFile):
    """A cache in which functions that name modules of an earlier version, since renamed, count as not compiled yet."""

    def _load_index(self) -> dict[Any, str]:
        try:
            found: dict[Any, str] = super()._load_index()
        except (ImportError, AttributeError):
            return {}
        return found

    def _load_data(self, name: str) -> Any:
        try:
            return super()._load_data(name)
        except (ImportError, AttributeError) as error:
            raise OSError(str(error)) from None


_compilation = _Compilation()
event.register("numba:compile", _compilation)
caching.IndexDataCacheFile = _Cache
