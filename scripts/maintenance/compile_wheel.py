"""Put compiled functions into a wheel: python scripts/maintenance/compile_wheel.py dist

Installs the folder's pure wheel, drives with it so that Numba compiles for any processor of the level that
`drake_starnav.utils.compiled_ahead` names, and packs what it leaves in its cache into a second wheel, for this Python
and platform. What the runs do not call is compiled by the users' machines, as all of it is with the pure wheel.
"""

import argparse
import os
import platform
import shutil
import subprocess
import sys
import tempfile
from collections.abc import Iterable
from pathlib import Path

from drake_starnav.errors import StarnavError
from drake_starnav.utils.compiled_ahead import LEVEL, MARKER, SETTINGS

SHORT = ("--set", "simulation.timeout=6")
RUNS = (
    ("demo",),
    *(("simulate", "room", *SHORT, "--set", f"robot.model={name}") for name in ("jackal", "carrier", "omnibot")),
    *(("simulate", name, *SHORT) for name in ("maze", "map", "kitchen", "crowd_room", "barn", "rooms")),
    ("simulate", "room", *SHORT, "--set", "localization.drift=0.02"),
    ("simulate", "room", *SHORT, "--set", "lidar.rolling=true"),
    ("simulate", "room", "--set", "robot.model=carbot", *SHORT),
)
"""Commands of `starnav` that call what most users call."""
CACHED = ("*.nbi", "*.nbc")
PLATFORM = "manylinux_2_34_x86_64"
"""That of Drake's wheels."""


def compile_into(site: Path, runs: Iterable[tuple[str, ...]] = RUNS) -> int:
    """Let the package in a folder compile what some commands call; returns the number of cached functions.

    Raises:
        StarnavError: a command failed.
    """
    environment = os.environ | SETTINGS | {"PYTHONPATH": str(site), "NUMBA_CACHE_DIR": ""}
    with tempfile.TemporaryDirectory() as folder:
        for run in runs:
            command = [sys.executable, "-P", "-m", "drake_starnav", *run, "--quiet"]
            done = subprocess.run(command, cwd=folder, env=environment, capture_output=True, text=True, check=False)
            if done.returncode not in (0, 1):  # 1: the run ended before the goal was reached
                raise StarnavError(f"starnav {' '.join(run)} ended with {done.returncode}: {done.stderr.strip()}")
    return len(list(site.rglob(CACHED[0])))


def packed(wheel: Path, site: Path, out: Path) -> Path:
    """A copy of a wheel with the compiled functions of the package installed in `site`, in a folder; its path."""
    with tempfile.TemporaryDirectory() as folder:
        _wheel("unpack", "--dest", folder, wheel)
        (content,) = Path(folder).iterdir()
        for pattern in CACHED:
            for path in sorted(site.glob(f"drake_starnav/**/{pattern}")):
                target = content / path.relative_to(site)
                target.parent.mkdir(parents=True, exist_ok=True)
                shutil.copyfile(path, target)
        (content / "drake_starnav" / MARKER.name).write_text(f"{LEVEL}\n", encoding="ascii")
        python = f"cp{sys.version_info.major}{sys.version_info.minor}"
        _wheel("pack", "--dest-dir", folder, content)
        (pure,) = Path(folder).glob("*.whl")
        _wheel("tags", "--remove", f"--python-tag={python}", f"--abi-tag={python}", f"--platform-tag={PLATFORM}", pure)
        (made,) = Path(folder).glob("*.whl")
        return Path(shutil.move(made, out / made.name))


def _wheel(*arguments: str | Path) -> None:
    subprocess.run([sys.executable, "-m", "wheel", *map(str, arguments)], check=True, stdout=subprocess.DEVNULL)


def main() -> int:
    """Make the wheel; returns the exit code."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("folder", type=Path, help="with one pure wheel")
    options = parser.parse_args()
    if (sys.platform, platform.machine()) != ("linux", "x86_64"):
        print(f"compile_wheel.py: this is not {PLATFORM}; allowed: the pure wheel", file=sys.stderr)
        return 2
    wheels = sorted(options.folder.glob("*-py3-none-any.whl"))
    if len(wheels) != 1:
        print(f"compile_wheel.py: {options.folder} holds {len(wheels)} pure wheels; allowed: one", file=sys.stderr)
        return 2
    with tempfile.TemporaryDirectory() as folder:
        install = ("-m", "pip", "install", "--quiet", "--no-deps", "--target", folder, str(wheels[0]))
        subprocess.run([sys.executable, *install], check=True)
        try:
            count = compile_into(Path(folder))
        except StarnavError as error:
            print(f"compile_wheel.py: {error}", file=sys.stderr)
            return 1
        print(f"{packed(wheels[0], Path(folder), options.folder)}: {count} compiled functions")
    return 0


if __name__ == "__main__":
    sys.exit(main())
