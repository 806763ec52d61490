"""Compiled functions that came with a wheel are used where they fit, and nowhere else."""

import os
import subprocess
import sys
from pathlib import Path

import pytest

from drake_starnav.utils.compiled_ahead import FLAGS, LEVEL, SETTINGS, use_compiled_functions

ABLE = f"processor\t: 0\nflags\t\t: fpu sse2 {' '.join(sorted(FLAGS))} rdtscp\n"


@pytest.fixture
def new_process(monkeypatch: pytest.MonkeyPatch) -> None:
    """As if Numba was not imported yet."""
    monkeypatch.delitem(sys.modules, "numba", raising=False)
    for name in SETTINGS:
        monkeypatch.setenv(name, "")  # so that what is set is undone
        monkeypatch.delenv(name)


def files(folder: Path, flags: str = ABLE, marked: bool = True) -> tuple[Path, Path]:
    marker, processor = folder / "compiled_ahead", folder / "cpuinfo"
    if marked:
        marker.write_text(LEVEL, encoding="ascii")
    processor.write_text(flags, encoding="ascii")
    return marker, processor


@pytest.mark.usefixtures("new_process")
def test_numba_compiles_for_the_level_of_what_came_with_the_wheel(tmp_path: Path) -> None:
    assert use_compiled_functions(*files(tmp_path))
    assert {name: os.environ[name] for name in SETTINGS} == SETTINGS
    code = "import numba; print(numba.config.CPU_NAME, repr(numba.config.CPU_FEATURES))"
    printed = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, check=True).stdout
    assert printed.split() == [LEVEL, "''"]


@pytest.mark.usefixtures("new_process")
def test_no_setting_changes_where_nothing_came_or_fits(tmp_path: Path) -> None:
    lesser = ABLE.replace(" avx2", "")
    assert not use_compiled_functions(*files(tmp_path, marked=False))
    assert not use_compiled_functions(*files(tmp_path, lesser))
    assert not use_compiled_functions(files(tmp_path)[0], tmp_path / "not_linux")
    assert not set(SETTINGS) & set(os.environ)


@pytest.mark.usefixtures("new_process")
@pytest.mark.parametrize("name", sorted(SETTINGS))
def test_what_the_user_has_set_stays(name: str, tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setenv(name, "generic")
    assert not use_compiled_functions(*files(tmp_path))
    assert {each: os.environ.get(each) for each in SETTINGS if each in os.environ} == {name: "generic"}


def test_numba_that_has_begun_is_left_alone(tmp_path: Path) -> None:
    import numba  # noqa: F401

    assert not use_compiled_functions(*files(tmp_path))
