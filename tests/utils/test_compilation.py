"""What Numba compiles, who says so, and how much of it is left."""

from pathlib import Path

import numba
import numpy as np
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
    monkeypatch.setattr(compilation, "_uncached", set)
    event.unregister("numba:compile", compilation._compilation)
    try:
        with monkeypatch.context() as patch, event.install_listener("numba:compile", fresh):
            patch.setattr(compilation, "_compilation", fresh)
            yield fresh
    finally:
        fresh.close()
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


def test_what_is_left_is_said_but_not_in_silence(listener, capsys) -> None:
    with silence(True):
        compile_in(f"{PACKAGE}.room.module")
    assert capsys.readouterr().err == ""
    listener.share = lambda: 0.5
    compile_in(f"{PACKAGE}.room.module")
    assert " s left" in capsys.readouterr().err


def test_every_room_with_compiled_functions_is_followed_whoever_calls_it() -> None:
    sources = {path: path.read_text(encoding="utf-8") for path in PATH.rglob("*.py")}
    rooms = {path.relative_to(PATH).parts[0] for path, text in sources.items() if "from numba import njit" in text}
    assert {"geometry", "planning"} < rooms
    for room in rooms:
        assert f"import {compilation.__name__}" in sources[PATH / room / "__init__.py"]


@pytest.mark.parametrize("called", [0.5, 0.6, 0.7])
@pytest.mark.parametrize("machine", [0.5, 1.0, 3.0])
def test_the_estimate_is_within_a_factor_of_two(called: float, machine: float) -> None:
    """Of functions whose costs differ by far more than that, some of them never called."""
    random = np.random.default_rng(7)
    now = 0.0
    costs = random.lognormal(-1.0, 0.6, 150) * np.exp(random.uniform(-1.0, 1.0, 150)) * machine
    listener = _Compilation()
    listener._waiting = set(range(150))
    needed = random.permutation(150)[: round(called * 150)]
    total = float(costs[needed].sum())
    for k in needed:
        left = total - now
        if listener._done < compilation.FEW:
            assert listener.share() == 0.0
        elif left > 0.3 * total:
            estimate = now * (1.0 - listener.share()) / listener.share()
            assert 0.5 * left <= estimate <= 2.0 * left
        now += costs[k]
        listener._waiting.remove(k)
        listener._done += 1
