"""What Numba compiles: all that its cache lacks, as in the first run after an installation."""

import contextlib
import fcntl
import functools
import gc
import hashlib
import os
import re
import shutil
from collections.abc import Iterable
from pathlib import Path
from typing import Any

from numba.core import caching, config, event

from drake_starnav.utils.progress import Progress

COMPILING = "compiling, once"
"""What a first run says."""
PACKAGE = __name__.partition(".")[0]
ROOT = Path(__file__).parents[1]
"""The folder of the package."""
FOLDER_PREFIX = "compiled_"
"""Begins the names of the folders of compiled functions, one for each file with such functions."""
IMPORT = re.compile(
    rb"^[ \t]*(?:from|import)[ \t]+(%s[\w.]*)(?:[ \t]+import[ \t]*(\([^)]*\)|[^\n]*))?" % PACKAGE.encode(), re.M
)
"""What a file imports of the package: module, and names."""


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


@functools.cache
def _find_imported_files(path: str) -> set[str]:
    """Return the files of the package that a file may import a function or constant from."""
    found_files: set[str] = set()
    for module, names in IMPORT.findall(Path(path).read_bytes()):
        module_path = ROOT.joinpath(*module.decode().split(".")[1:])
        inner_files = [module_path / f"{name}.py" for name in re.findall(r"\w+", names.decode())]
        if module_path.with_suffix(".py").is_file():
            found_files.add(str(module_path.with_suffix(".py")))
        elif all(file.is_file() for file in inner_files):
            found_files.update(map(str, inner_files))
        else:  # names of a package, which any of its files may hold
            found_files.update(str(file) for file in module_path.glob("*.py") if file.stem.isidentifier())
    return found_files


@functools.cache
def _find_sources(path: str) -> tuple[tuple[str, int, int], ...]:
    """Return path, time of the last change in ns, and size of a file and of all that it may import, directly or not."""
    known_files, files = {path}, [path]
    for file in files:  # grows
        new_files = _find_imported_files(file) - known_files
        known_files |= new_files
        files += new_files
    return _stamp_paths(sorted(known_files))


def _stamp_paths(paths: Iterable[str]) -> tuple[tuple[str, int, int], ...]:
    return tuple((path, (stat := os.stat(path)).st_mtime_ns, stat.st_size) for path in paths)


@functools.cache
def _hash_named_file(path: str) -> bytes:
    """Return the name of a file in the package, and the hash of its text."""
    return os.path.relpath(path, ROOT).encode() + hashlib.sha256(Path(path).read_bytes()).digest()


def _hash_sources(path: str) -> str:
    """Hash the names and the texts of the sources of a file."""
    return hashlib.sha256(b"".join(_hash_named_file(source) for source, *_ in _find_sources(path))).hexdigest()[:16]


@functools.cache
def _make_cache_folder(path: str) -> Path:
    """Return the folder for what is compiled of a file, and remove those of its former sources.

    It is inside the package, or else where Numba keeps what it compiles for a user; inside `NUMBA_CACHE_DIR` if that is
    set. Where no folder can be written, what the package's own holds is loaded, and nothing is saved.
    """
    inner_cache = ROOT / "__pycache__"
    user_cache = Path(config.CACHE_DIR or caching.AppDirs("numba", appauthor=False).user_cache_dir)
    user_cache /= caching.InTreeCacheLocator.get_suitable_cache_subpath(str(ROOT / "__init__.py"))
    module_name = os.path.relpath(path, ROOT).removesuffix(".py").replace(os.sep, ".")
    folder_name = f"{FOLDER_PREFIX}{module_name}-{_hash_sources(path)}"
    for place in (user_cache,) if config.CACHE_DIR else (inner_cache, user_cache):
        folder = place / folder_name
        with contextlib.suppress(OSError):
            folder.mkdir(parents=True, exist_ok=True)
            if os.access(folder, os.W_OK):
                for other in set(place.glob(f"{FOLDER_PREFIX}{module_name}-*")) - {folder}:
                    shutil.rmtree(other, ignore_errors=True)
                return folder
    return inner_cache / folder_name


class _Locator(caching.InTreeCacheLocator):
    """Places what is compiled of each file in a folder of its own."""

    def __init__(self, py_func: Any, py_file: str) -> None:
        super().__init__(py_func, py_file)
        self._cache_path = str(_make_cache_folder(py_file))

    @classmethod
    def from_function(cls, py_func: Any, py_file: str) -> "_Locator":
        """Return the locator of a function, whether or not its folder can be written."""
        return cls(py_func, py_file)


class _Located(caching.CompileResultCacheImpl):
    _locator_classes = (_Locator,)


class SourcesCache(caching.FunctionCache):
    """Numba's cache of one function, valid for the present text of its file and of all files that this may import.

    Numba's own sees changes only in the function's file, and not in those of the compiled functions that it calls.
    """

    _impl_class = _Located

    def load_overload(self, sig: Any, target_context: Any) -> Any:
        """Load a function; None where there is none that can be read."""
        with contextlib.suppress(OSError):
            return super().load_overload(sig, target_context)

    def save_overload(self, sig: Any, data: Any) -> None:
        """Save a function, unless its sources changed after this process began or the folder cannot be written.

        Of two processes that save at once, one waits: Numba's index would name the function of the other.
        """
        with contextlib.suppress(OSError):
            sources, folder = _find_sources(self._py_func.__code__.co_filename), Path(self.cache_path)
            if _stamp_paths(path for path, *_ in sources) == sources:
                folder.mkdir(exist_ok=True)
                with open(folder / "lock", "wb") as lock:
                    fcntl.flock(lock, fcntl.LOCK_EX)
                    super().save_overload(sig, data)


_compilation = _Compilation()
event.register("numba:compile", _compilation)
