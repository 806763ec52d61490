"""Every example runs as it stands, in a process of its own, comes out as it should, and draws it."""

import ast
import importlib
import importlib.util
import os
import re
import subprocess
import sys
from pathlib import Path

import numpy as np
import pytest
from PIL import Image

from drake_starnav.utils.compilation import COMPILING
from tests.project.test_notebooks import NOTEBOOKS, cells
from tests.project.test_public import PUBLIC_MODULES

ROOT = Path(__file__).parents[2]
FOLDER = ROOT / "scripts" / "examples"
EXAMPLES = sorted(FOLDER.glob("*.py"))
NUMBERED = [example for example in EXAMPLES if example.stem[0].isdigit()]
HANG = 240.0
"""An example takes seconds, that of six robots a minute; on a machine that has compiled nothing yet, some more. Beyond
this it hangs, s."""
LARGEST_PICTURE = 150_000
"""Bytes."""
TURTLEBOT = Path(os.environ.get("TURTLEBOT3", "/opt/ros/jazzy/share/turtlebot3_description"))
EXPECTED = {
    "01_run_a_scenario": [*(f"room at up to {v} m/s: reached in" for v in (0.8, 0.4)), "the shortest path"],
    "02_build_the_diagram": ["reached at", "regions in the roadmap"],
    "03_another_controller": [r"^reached at .* by way of [0-9]+ short-term goals$"],
    "04_fixed_path": [r"^reached at .*; off the path by 0\.[12]\d m in the mean, at most 0\.[3-7]\d m$"],
    "05_holonomic_robot": ["^reached at .* without a turn$"],
    "06_lidar_only": [
        *("ground", "extra_heavy_duty_table", "block", "cylinder", "bin"),
        r"\A(.*; at most 1?\d\.\d um off a surface\n){5}\Z",
    ],
    "07_two_robots": [
        r"^blue: 0\.0\d m from its goal, orange: 0\.0\d m from its goal, never nearer .* than 0\.\d\d m; no contact$"
    ],
    "08_own_robot": ["^tugbot: reached in", "^starbot: reached in"],
    "09_batch_over_seeds": ["^reached 6 of 6, 0 collisions$"],
    "10_log_and_plot": [r"^reached at .*; \d+ samples of each port$", r"the mean; 9\d\.\d% of the commands certified$"],
    "11_replay_a_scan_log": [r"^25 scans, \d+ plans; in the end approaching$"],
    "12_record_your_diagram": [r"^[4-9] places visited in 30 s; a page of \d\.\d MB$"],
    "13_plan_with_gcs": [
        r"^\d+ regions in \d+ convex sets; planned a way home of [67]\.\d\d m$",
        r"^home: reached at .*, off the trajectory by at most 0\.[0-4]\d m$",
    ],
    "14_your_plant_and_an_arm": [r"^reached in \d\.\d s; the arm was bent by at most [12]\d mrad$"],
    "15_other_robots": [
        f"^{robot}, .* {rate} .*: reached the goal in"
        for robot, rate in (("carrier", "omega"), ("omnibot", "v_y"), ("carbot", "curvature"))
    ],
    "16_several_robots": [f"^{name}_{k}: reached in" for k, name in enumerate(2 * ("starbot", "jackal", "carrier"), 1)],
    "17_drive_in_mujoco": [r"^0\.[23]\d m from the goal after 2\d\.\d s; 0 contacts$"],
    "18_drive_in_irsim": [r"^0\.[23]\d m from the goal after 2\d\.\d s; 0 contacts$"],
    "19_drake_s_pid_behind_the_shield": [r"^0\.[12]\d m from the goal after 2\d\.\d s; \d+% of the time certified$"],
    "20_drive_a_turtlebot_in_pybullet": [r"0\.[23]\d m from the goal after [12]\d\.\d s; 0 contacts$"],
}
"""What each prints, as regular expressions: its outcome."""


def needs_extras(example: Path) -> None:
    """Skip where an extra is not installed that an example needs."""
    if example.stem == "09_batch_over_seeds":
        pytest.importorskip("gymnasium", reason="needs gymnasium")
    if example.stem.startswith("20") and not TURTLEBOT.exists():
        pytest.skip("needs the URDF of turtlebot3_description in the folder that TURTLEBOT3 names")
    for module in ("mujoco", "irsim", "pybullet"):
        needed = re.search(rf"^ *import {module}\b", example.read_text(encoding="utf-8"), re.MULTILINE)
        if needed and importlib.util.find_spec(module) is None:
            pytest.skip("needs the extra simulators")


def run(example: Path, folder: Path, *arguments: str | Path) -> str:
    """What an example prints, in a process of its own that knows of no display."""
    needs_extras(example)
    environment = {key: value for key, value in os.environ.items() if key not in ("DISPLAY", "WAYLAND_DISPLAY")}
    environment["PYTHONPATH"] = str(ROOT)
    command = [sys.executable, str(example), *map(str, arguments)]
    done = subprocess.run(command, cwd=folder, env=environment, capture_output=True, text=True, timeout=HANG)
    assert done.returncode == 0, done.stderr
    assert not [line for line in done.stderr.splitlines() if COMPILING not in line and not line.startswith("pybullet")]
    return done.stdout


@pytest.mark.slow
@pytest.mark.parametrize("example", NUMBERED, ids=lambda path: path.stem)
def test_example_comes_out_as_it_should_and_draws_it(example: Path, tmp_path: Path) -> None:
    printed = run(example, tmp_path, "--png", "out/picture.png")
    assert "nan" not in printed.lower()
    for text in EXPECTED[example.stem]:
        assert re.search(text, printed, re.MULTILINE), printed
    assert [path.name for path in tmp_path.rglob("*") if path.is_file()] == ["picture.png"]
    picture = np.asarray(Image.open(tmp_path / "out" / "picture.png").convert("RGB"))
    assert picture.std() > 10.0 and len(np.unique(picture.reshape(-1, 3), axis=0)) > 50
    assert (tmp_path / "out" / "picture.png").stat().st_size < LARGEST_PICTURE


@pytest.mark.slow
def test_without_being_asked_an_example_leaves_no_file(tmp_path: Path) -> None:
    run(FOLDER / "11_replay_a_scan_log.py", tmp_path)
    assert list(tmp_path.iterdir()) == []


def test_the_table_names_each_example_and_shows_its_picture() -> None:
    page = ROOT / "docs" / "examples" / "index.md"
    table = page.read_text(encoding="utf-8")
    numbered = [example.stem for example in NUMBERED]
    assert [stem[:2] for stem in numbered] == [f"{k:02d}" for k in range(1, len(numbered) + 1)]
    assert all(f"]({stem}.md)" in table and (page.parent / f"{stem}.md").exists() for stem in numbered)
    assert all(f"`{example.name}`" in table for example in EXAMPLES if example.stem not in numbered)
    pictures = re.findall(r"!\[.*?\]\((.*?)\)", table)
    assert [Path(picture).stem for picture in pictures] == numbered
    for picture in pictures:
        assert 5_000 < (page.parent / picture).stat().st_size < LARGEST_PICTURE


CODES = {path.stem: path.read_text(encoding="utf-8") for path in EXAMPLES}
CODES |= {path.stem: "\n".join(cells(path)) for path in NOTEBOOKS}


def imports(code: str) -> list[ast.ImportFrom]:
    """All `from ... import ...` of a code."""
    return [node for node in ast.walk(ast.parse(code)) if isinstance(node, ast.ImportFrom)]


@pytest.mark.parametrize("name", CODES)
def test_examples_and_notebooks_import_public_names_only(name: str) -> None:
    for node in ast.walk(ast.parse(CODES[name])):
        if isinstance(node, ast.Import):
            assert not any(alias.name.startswith("drake_starnav.") for alias in node.names)
    for found in imports(CODES[name]):
        if (found.module or "").partition(".")[0] == "drake_starnav":
            assert found.module in PUBLIC_MODULES
            assert {alias.name for alias in found.names} <= set(importlib.import_module(found.module).__all__)


def test_the_lidar_example_knows_only_the_lidar() -> None:
    (own,) = (node for node in imports(CODES["lidar_only"]) if node.module == "drake_starnav")
    assert {alias.name for alias in own.names} == {"LidarMount", "LidarParameters", "LidarSensor"}
