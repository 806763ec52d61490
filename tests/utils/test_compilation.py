"""What Numba compiles, who says so, and what it finds in a cache."""

import gc
import subprocess
import sys
from pathlib import Path

import numba
import pytest
from numba.core import event

import drake_starnav
from drake_starnav.utils import compilation, progress
from drake_starnav.utils.compilation import COMPILING, PACKAGE, _Compilation
from drake_starnav.utils.progress import silence

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
    with silence(True):
        compile_in(f"{PACKAGE}.room.module")
    assert capsys.readouterr().err == ""


def test_all_functions_are_compiled_in_one_way_which_is_followed() -> None:
    sources = {path.relative_to(PATH): path.read_text(encoding="utf-8") for path in PATH.rglob("*.py")}
    (way,) = (str(path) for path, text in sources.items() if "njit" in text)
    assert way == "geometry/compiled.py"
    assert f"import {compilation.__name__}" in sources[Path(way)]


def test_what_was_compiled_with_a_module_since_renamed_is_compiled_anew(tmp_path: Path) -> None:
    """As after an update of the package in place, which leaves the cache of the version before."""
    caller = "import {0}, numba, drake_starnav.utils.compilation\n"
    caller += "double = numba.njit(cache=True)(lambda p: 2 * p.x)\nprint(double({0}.Point(1)))\n"
    for name in ("before", "after"):
        point = "from typing import NamedTuple\nclass Point(NamedTuple):\n    x: int\n"
        (tmp_path / f"{name}.py").write_text(point)
        (tmp_path / "caller.py").write_text(caller.format(name))
        code = "import caller"
        done = subprocess.run([sys.executable, "-c", code], cwd=tmp_path, capture_output=True, text=True, check=False)
        assert done.stdout == "2\n", done.stderr
        (tmp_path / f"{name}.py").unlink()
    assert [*tmp_path.rglob("*.nbi")]
