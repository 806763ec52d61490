"""What Numba compiles, who says so, and what it finds in a cache."""

import gc
import os
import shutil
import subprocess
import sys
from pathlib import Path

import numba
import pytest
from numba.core import event

import drake_starnav
from drake_starnav.utils import compilation, progress
from drake_starnav.utils.compilation import COMPILING, PACKAGE, _Compilation
from drake_starnav.utils.progress import silence_progress

PATH = Path(drake_starnav.__file__).parent


@pytest.fixture
def _listening(monkeypatch):
    """A listener of its own, as in a new process, which takes any compilation for a long one."""
    monkeypatch.setattr(progress, "SILENCE", 0.0)
    event.unregister("numba:compile", compilation._compilation)
    try:
        with event.install_listener("numba:compile", _Compilation()):
            yield
    finally:
        event.register("numba:compile", compilation._compilation)


def compile_in(module: str, value: int | None = 1) -> None:
    """Compile a function that says it is of a module."""

    def double(x):
        return 2 * x

    double.__module__ = module
    compiled = numba.njit(double)
    compiled(value)
    assert ("no_cfunc_wrapper" in compiled.targetoptions) == module.startswith(PACKAGE)


@pytest.mark.usefixtures("_listening")
def test_functions_of_this_package_are_counted(capsys) -> None:
    compile_in("somebody.elses")
    assert capsys.readouterr().err == ""
    compile_in(f"{PACKAGE}.room.module")
    assert capsys.readouterr().err.startswith(f"{COMPILING}: 0 functions")


@pytest.mark.usefixtures("_listening")
def test_garbage_is_collected_again_after_a_compilation_that_failed() -> None:
    with pytest.raises(numba.TypingError):
        compile_in(f"{PACKAGE}.room.module", None)
    assert gc.isenabled()


@pytest.mark.usefixtures("_listening")
def test_nothing_is_said_in_silence(capsys) -> None:
    with silence_progress(True):
        compile_in(f"{PACKAGE}.room.module")
    assert capsys.readouterr().err == ""


def test_all_functions_are_compiled_in_one_way_which_is_followed() -> None:
    sources = {path.relative_to(PATH): path.read_text(encoding="utf-8") for path in PATH.rglob("*.py")}
    (way,) = (str(path) for path, text in sources.items() if "njit" in text)
    assert way == "geometry/compiled.py"
    assert f"from {compilation.__name__} import SourcesCache" in sources[Path(way)]


CALLEE = """from drake_starnav.geometry.compiled import kernel
FACTOR = {}
@kernel
def multiply(x):
    return FACTOR * x
"""
CALLER = """from drake_starnav.geometry.callee import multiply
from drake_starnav.geometry.compiled import kernel
@kernel
def twice(x):
    return multiply(x)
"""


class Copy:
    """A copy of the package with a function that calls one of another file, which multiplies by 2."""

    def __init__(self, folder: Path) -> None:
        self.folder, self.package = folder, folder / PACKAGE
        self.places = {"NUMBA_CACHE_DIR": "", "XDG_CACHE_HOME": str(folder / "user")}
        shutil.copytree(PATH, self.package, ignore=shutil.ignore_patterns("__pycache__"))
        (self.package / "geometry" / "caller.py").write_text(CALLER)
        self.multiply_by(2)

    def multiply_by(self, factor: int) -> None:
        """Edit the function that is called."""
        (self.package / "geometry" / "callee.py").write_text(CALLEE.format(factor))

    def start(self, argument: str = "1", code: str = "") -> subprocess.Popen[str]:
        """Start a process that calls the caller, and prints what it returns and whether it was compiled."""
        code = f"from drake_starnav.geometry.caller import twice\n{code}\nprint(twice({argument}), end=' ')\n"
        code += "print(*twice.stats.cache_hits.values())"
        environment = os.environ | self.places | {"PYTHONPATH": str(self.folder)}
        return subprocess.Popen(
            [sys.executable, "-c", code], cwd=self.folder, env=environment, text=True, stdout=subprocess.PIPE
        )

    def printed(self, argument: str = "1", code: str = "") -> str:
        """What such a process prints: the result, and 1 if the function was found in the cache."""
        printed, _ = self.start(argument, code).communicate(timeout=100)
        return printed.strip()

    def folders(self) -> list[Path]:
        """That which holds the compiled caller."""
        return [*self.folder.rglob("compiled_geometry.caller-*/")]


@pytest.fixture
def copy(tmp_path: Path) -> Copy:
    return Copy(tmp_path)


def test_a_change_of_a_called_function_in_another_file_is_seen(copy) -> None:
    assert [copy.printed(), copy.printed()] == ["2", "2 1"]
    (stale,) = copy.folders()
    copy.multiply_by(3)
    (copy.package / "geometry" / "unrelated.py").write_text("FACTOR = 4\n")
    assert copy.printed() == "3"
    (fresh,) = copy.folders()
    assert fresh != stale and fresh.is_relative_to(copy.package)


def test_what_a_process_compiles_after_an_edit_is_not_kept_for_the_sources_before_it(copy) -> None:
    path = copy.package / "geometry" / "callee.py"
    edit = f"import drake_starnav.geometry.callee as callee; open({str(path)!r}, 'w').write({CALLEE.format(3)!r})"
    assert copy.printed(code=f"{edit}; callee.FACTOR = 3") == "3"
    copy.multiply_by(2)
    assert copy.printed() == "2"


def test_processes_that_begin_at_once_leave_a_cache_that_fits(copy) -> None:
    results = {"1": "2", "1.5": "3.0", "1j": "2j"}
    processes = [copy.start(argument) for argument in results]
    assert [each.communicate(timeout=100)[0].split()[0] for each in processes] == [*results.values()]
    again = f"print(*map(twice, ({', '.join(results)})), end=' ')"
    assert copy.printed(code=again).split() == [*results.values(), "2", "1", "1", "1"]


@pytest.mark.parametrize(
    "line",
    [
        "from drake_starnav.geometry import callee",
        "import drake_starnav.geometry.callee as callee",
        "from drake_starnav.geometry.callee import (\n    FACTOR,\n    multiply,\n)",
        "if True:\n    from drake_starnav.geometry.callee import FACTOR",
        "from drake_starnav.geometry import FACTOR",
    ],
)
def test_all_ways_to_import_are_followed(line, tmp_path, monkeypatch) -> None:
    monkeypatch.setattr(compilation, "ROOT", tmp_path)
    (tmp_path / "geometry").mkdir()
    package = "from drake_starnav.geometry.callee import FACTOR"
    for name, text in (("__init__", package), ("callee", ""), ("caller", line)):
        (tmp_path / "geometry" / f"{name}.py").write_text(text)
    sources = {Path(path).name for path, *_ in compilation._find_sources(str(tmp_path / "geometry" / "caller.py"))}
    assert {"caller.py", "callee.py"} <= sources


def test_what_was_compiled_moves_with_the_package(copy) -> None:
    copy.printed()
    moved = copy.folder / "elsewhere"
    moved.mkdir()
    copy.package.rename(moved / PACKAGE)
    copy.folder = moved
    (moved / PACKAGE / "geometry" / "unrelated.py").write_text("FACTOR = 4\n")
    assert copy.printed() == "2 1"


@pytest.mark.parametrize("user_can_write", [True, False])
def test_where_the_package_cannot_be_written_the_user_folder_is_used_or_none(user_can_write, copy) -> None:
    (copy.package / "__pycache__").write_text("no folder")
    if not user_can_write:
        (copy.folder / "user").write_text("no folder")
    assert copy.printed() == "2" and (not user_can_write or copy.printed() == "2 1")
    assert [folder.is_relative_to(copy.folder / "user") for folder in copy.folders()] == [True] * user_can_write


def test_a_folder_that_the_user_names_is_used_and_their_own_functions_are_cached_as_before(copy) -> None:
    copy.places["NUMBA_CACHE_DIR"] = str(copy.folder / "named")
    (copy.folder / "own.py").write_text("import numba\n@numba.njit(cache=True)\ndef negative(x):\n    return -x\n")
    own = "from own import negative; negative(1); print(negative.stats.cache_path)"
    path, result = copy.printed(code=own).splitlines()
    assert result == "2" and [folder.is_relative_to(copy.folder / "named") for folder in copy.folders()] == [True]
    assert Path(path).parent == copy.folder / "named" and [*Path(path).glob("*.nbc")]
