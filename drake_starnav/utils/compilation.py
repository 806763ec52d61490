"""What Numba compiles: all that its cache lacks, as in the first run after an installation, and how long it takes."""

import sys
import threading
import time
from collections import defaultdict
from collections.abc import Iterator
from pathlib import Path

from numba.core import event
from numba.core.dispatcher import Dispatcher

from drake_starnav.utils.progress import Progress, duration_text

COMPILING = "compiling, once"
"""What a first run says."""
PACKAGE = __name__.partition(".")[0]
SPECIAL_ROOMS = ("baselines", "localization", "tracking")
"""Few runs call functions of these."""
CALLED = 0.8
"""Share of the functions without a cache that a run calls: measured in forests and among moving obstacles."""
OVERHEAD = 300
"""What a function costs beside its length, in bytes of bytecode."""
BYTES_PER_SECOND, PRIOR = 1900.0, 5000.0
"""Speed of compilation until it is measured, and how much bytecode this assumption weighs."""
SHORT = 3.0
"""What takes less is not announced, s."""
IDLE = 1.0
"""The bar disappears when nothing has been compiled for so long, s."""


class _Compilation(event.Listener):
    """Follows the compilation of this package's functions, and shows how much of it is left."""

    def __init__(self) -> None:
        self.spent = 0.0
        self._depth, self._done, self._begun = 0, 0.0, 0.0
        self._waiting: dict[Dispatcher, float] = {}
        self._expected: set[str] | None = None
        self._progress: Progress | None = None
        self._closing: threading.Timer | None = None

    def on_start(self, event: event.Event) -> None:
        """A function is about to be compiled, often as part of another one."""
        if self._depth == 0 and not _module(event.data["dispatcher"]).startswith(f"{PACKAGE}."):
            return
        self._depth += 1
        if self._depth == 1:
            self._begun = time.perf_counter()
            if self._closing is not None:
                self._closing.cancel()
            self._show(event.data["dispatcher"])

    def on_end(self, event: event.Event) -> None:
        """It has been compiled."""
        if self._depth == 0:
            return
        self._depth -= 1
        function = event.data["dispatcher"]
        self._done += self._waiting.pop(function, 0.0)
        if self._depth == 0:
            self.spent += time.perf_counter() - self._begun
            if self._progress is not None:
                self._closing = threading.Timer(IDLE, self.close)
                self._closing.daemon = True
                self._closing.start()
        self._show(function)

    def seconds_left(self) -> float:
        """Estimate of the time that the rest takes, s."""
        left = sum(size for function, size in self._waiting.items() if _module(function) in (self._expected or ()))
        left = max(CALLED * (self._done + left) - self._done, 0.4 * left)
        now = time.perf_counter() - self._begun if self._depth else 0.0
        return left * (self.spent + now + PRIOR / BYTES_PER_SECOND) / (self._done + PRIOR)

    def _expect(self, function: Dispatcher) -> None:
        """Find out what else will be compiled, given that this function is.

        Numba's cache forgets a module when its file changes. If most modules have no cache, as after an installation,
        all will be needed, except those of the special rooms; otherwise those of which a function is compiled.
        """
        if self._expected is None:
            modules: defaultdict[str, list[Dispatcher]] = defaultdict(list)
            for each in _functions():
                modules[_module(each)].append(each)
            cold = {name for name, functions in modules.items() if not any(map(_is_cached, functions))}
            self._waiting = {each: _size(each) for name in cold for each in modules[name]}
            usual = {name for name in modules if _room(name) not in SPECIAL_ROOMS}
            self._expected = usual & cold if len(usual & cold) > 0.5 * len(usual) else set()
        self._expected.add(_module(function))

    def _show(self, function: Dispatcher) -> None:
        if Progress.silent:
            return
        self._expect(function)
        left = self.seconds_left()
        if self._progress is None:
            self._progress = Progress(COMPILING)
            if left > SHORT:
                self._progress.announce(f"about {duration_text(left)}")
        spent = self.spent + (time.perf_counter() - self._begun if self._depth else 0.0)
        self._progress.show(spent / (spent + left), left=left)

    def close(self) -> None:
        """Remove the bar."""
        progress, self._progress = self._progress, None
        if progress is not None:
            progress.close()


def _functions() -> Iterator[Dispatcher]:
    """The compiled functions of all modules of this package that are loaded."""
    for name, module in list(sys.modules.items()):
        if name.startswith(f"{PACKAGE}."):
            for value in list(vars(module).values()):
                if isinstance(value, Dispatcher) and _module(value) == name:
                    yield value


def _module(function: Dispatcher) -> str:
    return function.py_func.__module__ or ""


def _room(module: str) -> str:
    return f"{module}.".split(".")[1]


def _size(function: Dispatcher) -> float:
    return len(function.py_func.__code__.co_code) + OVERHEAD


def _is_cached(function: Dispatcher) -> bool:
    """Whether Numba's cache has the function as it now is: an index of it that is no older than its file."""
    code, folder = function.py_func.__code__, function.stats.cache_path
    source = Path(code.co_filename)
    indices = Path(folder).glob(f"{source.stem}.{code.co_name}-{code.co_firstlineno}.*.nbi") if folder else ()
    return any(index.stat().st_mtime >= source.stat().st_mtime for index in indices)


_compilation = _Compilation()
event.register("numba:compile", _compilation)


def seconds_spent() -> float:
    """The time that this process has compiled for, s."""
    return _compilation.spent
