"""The notebooks of the docs run as they stand, and use only what is public."""

import os
import re
import subprocess
import sys
from pathlib import Path

import pytest

ROOT = Path(__file__).resolve().parents[2]
NOTEBOOKS = sorted((ROOT / "docs" / "notebooks").glob("*.md"))
HANG = 300.0
"""A notebook takes seconds; on a machine that has compiled nothing yet, some more. Beyond this it hangs, s."""


def cells(notebook: Path) -> list[str]:
    return re.findall(r"```\{code-cell\} python\n(.*?)```", notebook.read_text(encoding="utf-8"), flags=re.DOTALL)


@pytest.mark.slow
@pytest.mark.parametrize("notebook", NOTEBOOKS, ids=lambda path: path.stem)
def test_a_notebook_runs_again_and_again_and_its_last_lines_are_shown(notebook: Path, tmp_path: Path) -> None:
    code = "\n".join(cells(notebook))
    environment = {**os.environ, "PYTHONPATH": str(ROOT)}
    for _ in range(2):  # in the same folder, as whoever tries changes does
        done = subprocess.run(
            [sys.executable, "-c", code], cwd=tmp_path, env=environment, capture_output=True, text=True, timeout=HANG,
            check=False,
        )  # fmt: skip
        assert done.returncode == 0, done.stderr
    assert done.stdout.strip()
    assert not re.search("collision|timeout", done.stdout)


@pytest.mark.parametrize("notebook", NOTEBOOKS, ids=lambda path: path.stem)
def test_a_notebook_opens_in_jupyter(notebook: Path) -> None:
    jupytext = pytest.importorskip("jupytext")
    opened = jupytext.read(notebook)
    code = [cell.source.strip() for cell in opened.cells if cell.cell_type == "code"]
    assert code == [cell.strip() for cell in cells(notebook)]
    assert opened.metadata["kernelspec"]["name"] == "python3"
