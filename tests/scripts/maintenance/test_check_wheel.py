"""The wheel is whole: it works in a folder of its own, away from the checkout."""

import importlib.util
import json
import os
import platform
import subprocess
import sys
import zipfile
from pathlib import Path

import pytest

import drake_starnav
from scripts.maintenance.compile_wheel import compile_into, packed

CHECKOUT = Path(__file__).resolve().parents[3]
PACKAGE = Path(drake_starnav.__file__).parent

pytestmark = [
    pytest.mark.slow,
    pytest.mark.skipif(
        any(importlib.util.find_spec(name) is None for name in ("build", "hatchling", "pip")),
        reason="building a wheel takes build, hatchling and pip: install the extra dev",
    ),
    pytest.mark.skipif(not (CHECKOUT / "pyproject.toml").is_file(), reason="not run from a checkout"),
]


def run(*arguments: str | Path, cwd: Path, python_path: Path | None = None) -> str:
    """Standard output of Python with some arguments; an exit code other than 0 fails the test."""
    environment = {key: value for key, value in os.environ.items() if key != "PYTHONPATH"}
    if python_path is not None:
        environment["PYTHONPATH"] = str(python_path)
    done = subprocess.run(
        [sys.executable, *map(str, arguments)], cwd=cwd, env=environment, capture_output=True, text=True, check=False
    )
    assert done.returncode == 0, done.stdout + done.stderr
    return done.stdout


@pytest.fixture(scope="module")
def wheel(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """A wheel built from the sdist of the checkout, without network."""
    folder = tmp_path_factory.mktemp("dist")
    run("-m", "build", "--no-isolation", "--outdir", folder, CHECKOUT, cwd=folder)
    (path,) = folder.glob("*.whl")
    return path


@pytest.fixture(scope="module")
def installed(wheel: Path, tmp_path_factory: pytest.TempPathFactory) -> Path:
    """The folder into which the wheel is installed; what it depends on comes from the environment of the tests."""
    target = tmp_path_factory.mktemp("site")
    run("-m", "pip", "install", "--quiet", "--no-index", "--no-deps", "--target", target, wheel, cwd=target)
    return target


def test_holds_the_package_the_models_and_the_licence(wheel: Path) -> None:
    names = set(zipfile.ZipFile(wheel).namelist())
    code = {f"drake_starnav/{path.relative_to(PACKAGE).as_posix()}" for path in PACKAGE.rglob("*.py")}
    models = CHECKOUT / "models"
    data = {
        f"drake_starnav/share/{path.relative_to(models).as_posix()}" for path in models.rglob("*") if path.is_file()
    }
    assert "drake_starnav/share/robots/starbot.urdf" in data
    assert code | data <= names
    assert any(name.endswith(".dist-info/licenses/LICENSE") for name in names)
    assert {name.split("/")[0].split("-")[0] for name in names} == {"drake_starnav"}


@pytest.mark.skipif((sys.platform, platform.machine()) != ("linux", "x86_64"), reason="made for x86-64 Linux alone")
def test_what_a_compiled_wheel_holds_is_not_compiled_again(wheel: Path, tmp_path: Path) -> None:
    first, second, out = tmp_path / "first", tmp_path / "second", tmp_path / "out"
    out.mkdir()
    command = ("simulate", "room", "--set", "simulation.timeout=0.5")
    install = ("-m", "pip", "install", "--quiet", "--no-index", "--no-deps", "--target")
    run(*install, first, wheel, cwd=tmp_path)
    count = compile_into(first, [command])
    made = packed(wheel, first, out)
    assert f"-cp{sys.version_info.major}{sys.version_info.minor}-" in made.name
    run(*install, second, made, cwd=tmp_path)
    held = {path.relative_to(second) for path in second.rglob("*.nbc")}
    assert compile_into(second, [command]) == count > 20
    assert {path.relative_to(second) for path in second.rglob("*.nbc")} == held


def test_drives_the_demo_scenario_away_from_the_checkout(installed: Path, tmp_path: Path) -> None:
    arguments = ("simulate", "forest", "--quiet", "--json", tmp_path / "forest.json")
    run("-m", "drake_starnav", *arguments, cwd=tmp_path, python_path=installed)
    assert json.loads((tmp_path / "forest.json").read_text(encoding="utf-8"))["outcome"] == "reached"
