"""What Numba compiles, and who says so."""

import signal
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
def listener(monkeypatch):
    """A listener of its own, as in a new process, which takes any compilation for a long one."""
    fresh = _Compilation()
    monkeypatch.setattr(progress, "FIRST_LINE", 0.0)
    event.unregister("numba:compile", compilation._compilation)
    try:
        with monkeypatch.context() as patch, event.install_listener("numba:compile", fresh):
            patch.setattr(compilation, "_compilation", fresh)
            yield fresh
    finally:
        event.register("numba:compile", compilation._compilation)


def compile_in(module: str) -> None:
    """Compile a function that says it is of a module."""

    def double(x):
        return 2 * x

    double.__module__ = module
    numba.njit(double)(1)


def test_only_functions_of_this_package_count(listener, capsys) -> None:
    compile_in("somebody.elses")
    assert capsys.readouterr().err == ""
    compile_in(f"{PACKAGE}.room.module")
    assert capsys.readouterr().err.startswith(f"{COMPILING}: ")


def test_it_is_counted_but_not_in_silence(listener, capsys) -> None:
    with silence(True):
        compile_in(f"{PACKAGE}.room.module")
    assert capsys.readouterr().err == ""
    compile_in(f"{PACKAGE}.room.module")
    assert "functions" in capsys.readouterr().err


def test_every_room_with_compiled_functions_is_followed_whoever_calls_it() -> None:
    sources = {path: path.read_text(encoding="utf-8") for path in PATH.rglob("*.py")}
    rooms = {path.relative_to(PATH).parts[0] for path, text in sources.items() if "from numba import njit" in text}
    assert {"geometry", "planning"} < rooms
    for room in rooms:
        assert f"import {compilation.__name__}" in sources[PATH / room / "__init__.py"]


def test_ctrl_c_waits_until_a_function_is_compiled(listener) -> None:
    steps = []

    class Pressing(event.Listener):
        def on_start(self, event) -> None:
            signal.raise_signal(signal.SIGINT)
            steps.append("compiling")

        def on_end(self, event) -> None:
            steps.append("compiled")

    before = signal.signal(signal.SIGINT, signal.default_int_handler)  # workers of pytest ignore it
    try:
        with event.install_listener("numba:compile", Pressing()), pytest.raises(KeyboardInterrupt):
            compile_in(f"{PACKAGE}.room.module")
        assert steps[0] == "compiling"
        assert signal.getsignal(signal.SIGINT) is signal.default_int_handler
    finally:
        signal.signal(signal.SIGINT, before)
