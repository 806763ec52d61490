"""`--help` of every script describes what it does and how to call it, and runs nothing."""

import ast
import runpy
import sys
from pathlib import Path

import pytest

from tests.scripts.test_examples import needs_extras

ROOT = Path(__file__).resolve().parents[2]


def is_script(path: Path) -> bool:
    """Whether a file has a main block."""
    last = ast.parse(path.read_text(encoding="utf-8")).body[-1]
    return isinstance(last, ast.If) and ast.unparse(last.test) == "__name__ == '__main__'"


SCRIPTS = [p for folder in ("scripts", "benchmarks") for p in sorted((ROOT / folder).rglob("*.py")) if is_script(p)]


@pytest.mark.parametrize("script", SCRIPTS, ids=lambda path: path.stem)
def test_help_describes_the_script(script: Path, tmp_path: Path, monkeypatch, capsys) -> None:
    needs_extras(script)
    monkeypatch.setattr(sys, "argv", [str(script), "--help"])
    monkeypatch.setattr(sys, "path", [str(script.parent), str(ROOT), *sys.path])
    monkeypatch.chdir(tmp_path)
    monkeypatch.setattr("signal.signal", lambda number, handler: None)  # this process goes on
    with pytest.raises(SystemExit) as ended:
        runpy.run_path(str(script), run_name="__main__")
    assert ended.value.code == 0
    usage, _, about = capsys.readouterr().out.partition("\n\n")
    assert usage.startswith("usage: ") and script.stem.lstrip("0123456789_") in usage  # 06 runs lidar_only.py
    assert len(about.split()) > 5, "the description is missing"
    assert list(tmp_path.iterdir()) == []
