"""What Numba compiles: all that its cache lacks, as in the first run after an installation."""

import contextlib
import fcntl
import gc
import hashlib
import os
import shutil
from pathlib import Path
from typing import Any

from numba.core import caching, config, event

from drake_starnav.utils.progress import Progress

COMPILING = "compiling, once"
"""What a first run says."""
PACKAGE = __name__.partition(".")[0]
ROOT = Path(__file__).parents[1]
"""The folder of the package."""
COMPILED = "compiled_"
"""Begins the names of the folders of compiled functions, one for each state of the sources."""


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


def _stamps() -> list[tuple[str, int, int]]:
    """Path, time of the last change in ns, and size of each source file of the package."""
    names = ((folder, name) for folder, _, files in os.walk(ROOT) for name in files if name.endswith(".py"))
    paths = sorted(os.path.join(folder, name) for folder, name in names if name[:-3].isidentifier())
    return [(path, (stat := os.stat(path)).st_mtime_ns, stat.st_size) for path in paths]


def _key(stamps: list[tuple[str, int, int]]) -> str:
    """Hash the names and the texts of source files, 12 ms for all of the package."""
    digest = hashlib.sha256()
    for path, *_ in stamps:
        text = Path(path).read_bytes()
        digest.update(f"{os.path.relpath(path, ROOT)} {len(text)} ".encode() + text)
    return digest.hexdigest()[:16]


def _cache_folder(key: str) -> Path:
    """Return the folder for what is compiled from the sources with a key, and remove those of other sources.

    It is inside the package, or else where Numba keeps what it compiles for a user; inside `NUMBA_CACHE_DIR` if that is
    set. Where no folder can be written, what the package's own holds is loaded, and nothing is saved.
    """
    inside = ROOT / "__pycache__"
    user = Path(config.CACHE_DIR or caching.AppDirs("numba", appauthor=False).user_cache_dir)
    user /= caching.InTreeCacheLocator.get_suitable_cache_subpath(str(ROOT / "__init__.py"))
    for place in (user,) if config.CACHE_DIR else (inside, user):
        folder = place / f"{COMPILED}{key}"
        with contextlib.suppress(OSError):
            folder.mkdir(parents=True, exist_ok=True)
            if os.access(folder, os.W_OK):
                for other in set(place.glob(f"{COMPILED}*")) - {folder}:
                    shutil.rmtree(other, ignore_errors=True)
                return folder
    return inside / f"{COMPILED}{key}"


class _Locator(caching.InTreeCacheLocator):
    """Places what is compiled of each package in a folder of its own, inside `FOLDER`."""

    def __init__(self, py_func: Any, py_file: str) -> None:
        super().__init__(py_func, py_file)
        self._cache_path = str(FOLDER / os.path.relpath(os.path.dirname(py_file), ROOT).replace(os.sep, "_"))

    @classmethod
    def from_function(cls, py_func: Any, py_file: str) -> "_Locator":
        """Return the locator of a function, whether or not its folder can be written."""
        return cls(py_func, py_file)


class _Located(caching.CompileResultCacheImpl):
    _locator_classes = (_Locator,)


class SourcesCache(caching.FunctionCache):
    """Numba's cache of one function, valid for the present sources of the whole package.

    Numba's own sees changes only in the function's file, and not in those of the compiled functions that it calls.
    """

    _impl_class = _Located

    def load_overload(self, sig: Any, target_context: Any) -> Any:
        """Load a function; None where there is none that can be read."""
        with contextlib.suppress(OSError):
            return super().load_overload(sig, target_context)

    def save_overload(self, sig: Any, data: Any) -> None:
        """Save a function, unless sources changed after this process began or the folder cannot be written.

        Of two processes that save at once, one waits: Numba's index would name the function of the other.
        """
        with contextlib.suppress(OSError):
            if _stamps() == STAMPS:
                FOLDER.mkdir(exist_ok=True)
                with open(FOLDER / "lock", "wb") as lock:
                    fcntl.flock(lock, fcntl.LOCK_EX)
                    super().save_overload(sig, data)


STAMPS = _stamps()
FOLDER = _cache_folder(_key(STAMPS))
_compilation = _Compilation()
event.register("numba:compile", _compilation)
