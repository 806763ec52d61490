"""Every example runs as it stands, in a process of its own, and says something."""

import ast
import os
import re
import subprocess
import sys
from pathlib import Path

import pytest

ROOT = Path(__file__).parents[1]
EXAMPLES = sorted((ROOT / "scripts" / "examples").glob("*.py"))
HANG = 120.0
"""An example takes seconds; on a machine that has compiled nothing yet, some more. Beyond this it hangs, s."""
EXPECTED = {
    "01_run_a_scenario.py": [
        "room at up to 0.8 m/s: reached in",
        "room at up to 0.4 m/s: reached in",
        "the shortest path there is",
    ],
    "02_build_the_diagram.py": ["reached at", "regions in the roadmap"],
    "lidar_only.py": ["ground", "extra_heavy_duty_table", "block", "cylinder", "bin", "um off a surface"],
}
"""What some of them must print."""


@pytest.mark.parametrize("example", EXAMPLES, ids=lambda path: path.stem)
def test_example_runs(example: Path, tmp_path: Path) -> None:
    environment = {**os.environ, "PYTHONPATH": str(ROOT)}
    done = subprocess.run(
        [sys.executable, str(example)], cwd=tmp_path, env=environment, capture_output=True, text=True, timeout=HANG
    )
    assert done.returncode == 0, done.stderr
    assert done.stderr == ""
    assert done.stdout.strip()
    assert "nan" not in done.stdout.lower()
    for text in EXPECTED.get(example.name, []):
        assert text in done.stdout
    assert list(tmp_path.iterdir()) == [], "an example leaves files behind where it is run"


@pytest.mark.parametrize("example", EXAMPLES, ids=lambda path: path.stem)
def test_example_says_what_it_is_and_how_to_run_it(example: Path) -> None:
    text = ast.get_docstring(ast.parse(example.read_text(encoding="utf-8")))
    assert text is not None
    assert f"Run: python scripts/examples/{example.name}" in text


def test_what_is_expected_exists() -> None:
    assert set(EXPECTED) <= {path.name for path in EXAMPLES}


def test_the_lidar_example_knows_only_the_lidar_and_measures_true_points() -> None:
    path = ROOT / "scripts" / "examples" / "lidar_only.py"
    modules = {node.module for node in ast.walk(ast.parse(path.read_text())) if isinstance(node, ast.ImportFrom)}
    own = {module for module in modules if module and module.startswith("drake_starnav")}
    assert own == {"drake_starnav.lidar", "drake_starnav.systems.lidar_sensor"}
    environment = {**os.environ, "PYTHONPATH": str(ROOT)}
    done = subprocess.run([sys.executable, str(path)], env=environment, capture_output=True, text=True, timeout=HANG)
    off = [float(value) for value in re.findall(r"at most ([0-9.]+) um off a surface", done.stdout)]
    assert len(off) == 5 and max(off) < 20.0
