"""What Numba compiles: all that its cache lacks, as in the first run after an installation."""

import sys
import threading
from collections import defaultdict
from pathlib import Path

from numba.core import event
from numba.core.dispatcher import Dispatcher

from drake_starnav.utils.progress import Progress

COMPILING = "compiling, once"
"""What a first run says."""
PACKAGE = __name__.partition(".")[0]
CALLED = 0.6
"""Share of the functions without a cache that a run calls: measured in a forest."""
FEW = 20
"""So many functions must be compiled before they tell how long the others take: the first ones take longest."""
IDLE = 1.0
"""The bar disappears when nothing has been compiled for so long, s."""


class _Compilation(event.Listener):
    """Follows the compilation of this package's functions, and shows how much of it is left."""

    def __init__(self) -> None:
        self._depth, self._done = 0, 0
        self._waiting: set[Dispatcher] | None = None
        self._progress: Progress | None = None
        self._closing: threading.Timer | None = None

    def on_start(self, event: event.Event) -> None:
        """A function is about to be compiled, often as part of another one."""
        if self._depth == 0 and not _module(event.data["dispatcher"]).startswith(f"{PACKAGE}."):
            return
        self._depth += 1
        if self._depth == 1:
            if self._closing is not None:
                self._closing.cancel()
            self._show()

    def on_end(self, event: event.Event) -> None:
        """It has been compiled."""
        if self._depth == 0:
            return
        self._depth -= 1
        if self._waiting is not None and event.data["dispatcher"] in self._waiting:
            self._waiting.remove(event.data["dispatcher"])
            self._done += 1
        if self._depth == 0 and self._progress is not None:
            self._closing = threading.Timer(IDLE, self.close)
            self._closing.daemon = True
            self._closing.start()
        self._show()

    def share(self) -> float:
        """Estimate of what is done, 0 to 1; 0 as long as few functions have been compiled."""
        if self._done < FEW:
            return 0.0
        waiting = len(self._waiting or ())
        return self._done / (self._done + max(CALLED * (self._done + waiting) - self._done, 0.4 * waiting))

    def _show(self) -> None:
        if Progress.silent:
            return
        if self._waiting is None:
            self._waiting = _uncached()
        if self._progress is None:
            self._progress = Progress(COMPILING)
        self._progress.show(self.share(), f"{self._done} functions")

    def close(self) -> None:
        """Remove the bar."""
        progress, self._progress = self._progress, None
        if progress is not None:
            progress.close()


def _uncached() -> set[Dispatcher]:
    """The compiled functions of this package's loaded modules of which Numba's cache has none: it forgets a module when
    its file changes."""
    modules: defaultdict[str, list[Dispatcher]] = defaultdict(list)
    for name, module in list(sys.modules.items()):
        if name.startswith(f"{PACKAGE}."):
            values = list(vars(module).values())
            modules[name] += [each for each in values if isinstance(each, Dispatcher) and _module(each) == name]
    return {each for functions in modules.values() if not any(map(_is_cached, functions)) for each in functions}


def _module(function: Dispatcher) -> str:
    return function.py_func.__module__ or ""


def _is_cached(function: Dispatcher) -> bool:
    """Whether Numba's cache has the function as it now is: an index of it that is no older than its file."""
    code, folder = function.py_func.__code__, function.stats.cache_path
    source = Path(code.co_filename)
    indices = Path(folder).glob(f"{source.stem}.{code.co_name}-{code.co_firstlineno}.*.nbi") if folder else ()
    return any(index.stat().st_mtime >= source.stat().st_mtime for index in indices)


_compilation = _Compilation()
event.register("numba:compile", _compilation)
