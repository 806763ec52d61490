"""Try a wheel with every supported Python there is: python scripts/maintenance/check_wheel.py dist

For each, in a new environment and a folder of its own: install the wheel with what pip chooses for it, list what there
is, import every public name, drive the demo. Of several wheels, that with compiled functions for this Python is tried;
its demo must compile nothing. `scripts/maintenance/pythons.sh` finds the Pythons.
"""

import argparse
import json
import os
import subprocess
import sys
import tempfile
import time
import tomllib
from collections.abc import Sequence
from pathlib import Path

from drake_starnav.errors import StarnavError

ROOT = Path(__file__).parents[2]
PROBE = """
import sys, drake_starnav, pathlib
from importlib.metadata import version
assert pathlib.Path(drake_starnav.__file__).is_relative_to(sys.prefix), drake_starnav.__file__
for name in drake_starnav.__all__:
    getattr(drake_starnav, name)
print(version("drake"))
"""
"""Prints the version of Drake if the package is installed and whole."""


def tested() -> list[str]:
    """The versions of Python that the package declares, oldest first."""
    project = tomllib.loads((ROOT / "pyproject.toml").read_text(encoding="utf-8"))["project"]
    prefix = "Programming Language :: Python :: 3."
    return [line.rpartition(" ")[2] for line in project["classifiers"] if line.startswith(prefix)]


def wheel_for(wheels: Sequence[Path], version: str) -> Path | None:
    """The wheel of some for a Python, e.g. 3.12: the one made for it, else the pure one."""
    tags = f"-cp{version.replace('.', '')}-", "-py3-none-any"
    return next((wheel for tag in tags for wheel in wheels if tag in wheel.name), None)


def check(wheel: Path, python: Path) -> str:
    """Install a wheel for one Python and use it; returns what happened, in a few words.

    Raises:
        StarnavError: a step failed.
    """
    with tempfile.TemporaryDirectory() as name:
        folder, own = Path(name), Path(name, "venv", "bin", "python")
        start = time.perf_counter()
        _run([str(python), "-m", "venv", "venv"], folder)
        _run([str(own), "-m", "pip", "install", "--quiet", "--disable-pip-version-check", str(wheel)], folder)
        installed = time.perf_counter() - start
        drake = _run([str(own), "-c", PROBE], folder).strip()
        _run([str(own), "-m", "drake_starnav"], folder)
        before, start = _compiled(folder), time.perf_counter()
        _run([str(own), "-m", "drake_starnav", "demo", "--quiet"], folder)
        demo, compiled = time.perf_counter() - start, len(_compiled(folder) - before)
        if before and compiled:
            raise StarnavError(f"{wheel.name}: {compiled} functions were compiled by the demo; allowed: none")
        outcome = json.loads((folder / "out" / "forest.json").read_text(encoding="utf-8"))["outcome"]
    return f"Drake {drake}, installed in {installed:.0f} s, demo {outcome} in {demo:.0f} s, {compiled} compiled"


def _compiled(folder: Path) -> set[Path]:
    return set(folder.glob("venv/lib/*/site-packages/drake_starnav/**/*.nbc"))


def _run(command: list[str], folder: Path) -> str:
    environment = {key: value for key, value in os.environ.items() if key not in ("PYTHONPATH", "VIRTUAL_ENV")}
    done = subprocess.run(command, cwd=folder, env=environment, capture_output=True, text=True, check=False)
    if done.returncode != 0:
        said = (done.stderr or done.stdout).strip().splitlines()
        raise StarnavError(f"{' '.join(command[1:4])} ended with {done.returncode}: {said[-1] if said else 'no word'}")
    return done.stdout


def main() -> int:
    """Try all, one line each; returns the exit code."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("wheel", type=Path, help="a wheel, or a folder with wheels of one release")
    options = parser.parse_args()
    wheels = sorted(options.wheel.glob("*.whl")) if options.wheel.is_dir() else [options.wheel]
    releases = {wheel.name.split("-")[1] for wheel in wheels if wheel.is_file() and wheel.suffix == ".whl"}
    if len(releases) != 1:
        print(f"check_wheel.py: {options.wheel} holds {len(releases)} releases; allowed: one", file=sys.stderr)
        return 2
    versions = tested()
    lines = [line.partition(" ") for line in _run(["sh", "scripts/maintenance/pythons.sh"], ROOT).splitlines()]
    found = {version: Path(python) for version, _, python in lines if version in versions}
    failures = 0
    for version in versions:
        wheel = wheel_for(wheels, version)
        if version not in found or wheel is None:
            print(f"Python {version}: {'no wheel' if version in found else 'not here'}, skipped")
            continue
        try:
            print(f"Python {version}: {check(wheel.resolve(), found[version])}", flush=True)
        except StarnavError as error:
            failures += 1
            print(f"Python {version}: FAILED: {error}", flush=True)
    if not found:
        print(f"check_wheel.py: no Python of {', '.join(versions)} was found", file=sys.stderr)
    return 1 if failures or not found else 0


if __name__ == "__main__":
    sys.exit(main())
