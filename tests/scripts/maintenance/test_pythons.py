"""The scripts that find Pythons, make an environment and run continuous integration, on a machine made up for them."""

import os
import shutil
import subprocess
from pathlib import Path

import pytest

from drake_starnav.utils.files import write_text
from scripts.maintenance import check_wheel

CHECKOUT = Path(__file__).resolve().parents[3]
SCRIPTS = ("scripts/maintenance/pythons.sh", "scripts/maintenance/make_venv.sh", ".ci/run", "pyproject.toml")
TOOLS = "awk bash cat dirname env grep id mkdir mktemp rm sed sh sort tail tee tr"
PYTHON = """#!/bin/sh
case "$*" in
*version_info*) echo {version} ;;
*ensurepip*) exit {bare} ;;
"-m venv --clear "*) mkdir -p "$4/bin" && cat "$0" >"$4/bin/python" && chmod +x "$4/bin/python" ;;
esac
"""
MAKE = """#!/bin/sh
echo "$@" >>"{calls}"
echo "1 passed"
case "$*" in *{failing}*) exit 2 ;; esac
"""

pytestmark = pytest.mark.skipif(not (CHECKOUT / ".ci" / "run").is_file(), reason="not run from a checkout")


def executable(path: Path, text: str) -> Path:
    write_text(path, text)
    path.chmod(0o755)
    return path


def python(path: Path, version: str, *, bare: bool = False) -> Path:
    """A Python that says it has a version, and makes environments unless it is bare."""
    return executable(path, PYTHON.format(version=version, bare=int(bare)))


class Machine:
    """A copy of the scripts, on a machine that has no Python but those in its folders."""

    def __init__(self, folder: Path) -> None:
        """It is made in a folder that is empty."""
        self.path, self.pyenv, self.places = folder / "path", folder / "pyenv", folder / "opt"
        self.checkout = folder / "a checkout"
        for name in SCRIPTS:
            (self.checkout / name).parent.mkdir(parents=True, exist_ok=True)
            shutil.copy(CHECKOUT / name, self.checkout / name)
        (folder / "tools").mkdir()
        for tool in (*TOOLS.split(), "chmod"):
            (folder / "tools" / tool).symlink_to(shutil.which(tool))
        self.environment = {
            "PATH": os.pathsep.join(map(str, (self.path, folder / "tools"))),
            "HOME": str(folder),
            "PYENV_ROOT": str(self.pyenv),
            "PLACES": str(self.places / "*"),
        }

    def run(self, *command: str) -> subprocess.CompletedProcess[str]:
        return subprocess.run(
            command, cwd=self.checkout, env=self.environment, capture_output=True, text=True, timeout=60
        )

    def pythons(self, *arguments: str) -> tuple[list[str], list[str]]:
        """What the search finds, and what it says of what it passes over."""
        done = self.run("sh", "scripts/maintenance/pythons.sh", *arguments)
        assert done.returncode == 0, done.stderr
        return done.stdout.splitlines(), done.stderr.splitlines()


@pytest.fixture
def machine(tmp_path: Path) -> Machine:
    return Machine(tmp_path)


def test_those_beside_a_launcher_are_found_and_the_launcher_is_passed_over_with_a_word(machine) -> None:
    shim = executable(machine.path / "python3.13", "#!/bin/sh\nexit 127\n")
    oldest = python(machine.path / "python3.11", "3.11")
    newest = python(machine.pyenv / "versions" / "3.13.0" / "bin" / "python3.13", "3.13")
    middle = python(machine.places / "of one" / "python3.12", "3.12")
    assert check_wheel.tested() == ["3.11", "3.12", "3.13"]
    said = [f"Passed over {shim}: it does not start."]
    assert machine.pythons() == ([f"3.13 {newest}", f"3.12 {middle}", f"3.11 {oldest}"], said)
    assert machine.pythons("first") == ([f"3.13 {newest}"], said)


def test_each_that_cannot_serve_has_its_reason(machine) -> None:
    bare = python(machine.path / "python3.12", "3.12", bare=True)
    old = python(machine.path / "python3", "3.10")
    older = python(machine.path / "python", "2.7")
    advice = f"Passed over {bare}: it lacks venv or ensurepip (Debian, Ubuntu: apt-get install python3.12-venv)."
    reasons = [advice, f"Passed over {old}: it is Python 3.10.", f"Passed over {older}: it is Python 2.7."]
    assert machine.pythons() == ([], reasons)
    assert machine.pythons("first", "python3") == ([], ["Passed over python3: it is Python 3.10."])
    assert machine.pythons("first", "nowhere") == ([], ["Passed over nowhere: it does not start."])


def test_the_environment_is_made_once_for_each_version(machine) -> None:
    for version in ("3.11", "3.12"):
        python(machine.path / f"python{version}", version)
    make = ("sh", "scripts/maintenance/make_venv.sh", ".venv")
    assert "Installing into .venv with Python 3.12;" in machine.run(*make).stdout
    for again in ((), ("python3.12",)):
        done = machine.run(*make, *again)
        assert (done.returncode, done.stdout, done.stderr) == (0, "", "")
    assert "Installing into .venv with Python 3.11;" in machine.run(*make, "python3.11").stdout
    assert machine.run(*make).stdout == ""
    os.utime(machine.checkout / "pyproject.toml", (4e9, 4e9))
    assert "Installing into .venv with Python 3.11;" in machine.run(*make).stdout, "the one that is there is kept"


def ci(machine: Machine, *versions: str, failing: str = "nothing", asked: str = "") -> tuple[int, list[str], list[str]]:
    """Exit code of continuous integration with these Pythons, how it called `make`, and its last lines."""
    for version in versions:
        python(machine.path / f"python{version}", version)
    calls = machine.checkout / "calls"
    executable(machine.path / "make", MAKE.format(calls=calls, failing=failing))
    done = machine.run("bash", ".ci/run", *asked.split())
    called = calls.read_text(encoding="utf-8").splitlines() if calls.exists() else []
    return done.returncode, called, f"\n{done.stdout}".rpartition("\n\n")[2].splitlines()


def test_ci_runs_all_on_the_oldest_and_much_on_the_newest(machine) -> None:
    status, called, last = ci(machine, "3.11", "3.12", "3.13")
    assert status == 0
    oldest, newest = (
        [call for call in called if f"VENV=.venv-{version} PYTHON={machine.path}/python{version}" in call]
        for version in ("3.11", "3.13")
    )
    assert oldest + newest == called
    assert [call.partition(" VENV")[0] for call in oldest] == ["check", "test", "test MARKS=slow"]
    assert [call.partition(" VENV")[0].partition(" TESTS")[0] for call in newest] == ["demo", "test", "test MARKS=slow"]
    for folder in newest[-1].partition("TESTS=")[2].partition(" VENV")[0].split():
        assert (CHECKOUT / folder).exists()
    assert last[:2] == ["Python 3.11, make check: 1 passed", "Python 3.11, make test: 1 passed"]
    assert last[-2:] == ["Python 3.12: found, not tried; `.ci/run 3.12` does", "exit status 0"]


def test_ci_ends_with_what_failed(machine) -> None:
    status, called, last = ci(machine, "3.11", "3.13", failing="MARKS=slow")
    assert status == 2 and len(called) == 3
    assert last[-2:] == ["Python 3.11, make test MARKS=slow: 1 passed", "exit status 2"]
