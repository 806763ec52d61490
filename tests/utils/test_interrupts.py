"""Ctrl-C at any moment of a command: one sentence, no traceback, nothing half-written, no process left."""

import os
import signal
import subprocess
import sys
import textwrap
from pathlib import Path

import pytest

from drake_starnav.evaluation.trial_file import read_trials
from drake_starnav.utils.interrupts import INTERRUPTED, kept_from_children

ROOT = Path(__file__).parents[2]
SCENARIO = "world: !Obstacles {cylinders: [[1.0, 0.9, 0.3]], goal: [1.5, 0.0]}\nsimulation: {timeout: 6.0}\n"
AT_IMPORT = """
    class AtImport:
        def find_spec(self, name, path=None, target=None):
            if name == moment:
                sys.meta_path.remove(self)
                os.killpg(0, signal.SIGINT)

    sys.meta_path.insert(0, AtImport())
"""
AT_CALL = """
    name, _, left = moment.rpartition(":")
    left = int(left)

    def profile(frame, event, argument):
        global left
        if event == "call" and name in ("", frame.f_code.co_qualname):
            left -= 1
            if left == 0:
                sys.setprofile(None)
                os.killpg(0, signal.SIGINT)

    sys.setprofile(profile)
"""
AT_RETURN = """
    def profile(frame, event, argument):
        caller = frame.f_back
        if event == "return" and frame.f_code.co_name == "__call__" and caller and caller.f_code.co_name == moment:
            sys.setprofile(None)
            os.killpg(0, signal.SIGINT)

    sys.setprofile(profile)
"""
"""As from a terminal, all processes of the command receive a signal: when it first imports a module, at the n-th call
of a function of this name or of any, or when the first object that a function of this name calls has returned."""


def interrupted(how: str, moment: str, arguments: list[str], folder: Path) -> subprocess.CompletedProcess:
    """A command that receives Ctrl-C at a moment, in a folder of its own."""
    (folder / "tiny.yaml").write_text(SCENARIO)
    code = "import os, signal, sys\nfrom drake_starnav.cli.main import main\nmoment = sys.argv.pop(1)\n"
    code += f"{textwrap.dedent(how)}\nsys.exit(main())"
    return subprocess.run(
        [sys.executable, "-c", code, moment, *arguments], cwd=folder, env={**os.environ, "PYTHONPATH": str(ROOT)},
        capture_output=True, text=True, timeout=120, start_new_session=True,
    )  # fmt: skip


def check_ended(done: subprocess.CompletedProcess, folder: Path) -> None:
    """Assert that the command ended with its sentence alone, and has left nothing half-written."""
    *said, sentence = done.stderr.splitlines()
    assert done.returncode == INTERRUPTED, done.stderr
    assert "interrupted" in sentence
    assert all("at a time" in line or "so far" in line for line in said), done.stderr
    assert not [path for path in folder.rglob(".*")]


@pytest.mark.parametrize(
    "module",
    ["argparse", "numpy", "drake_starnav.cli.options", "numba", "pydrake.systems", "drake_starnav.simulation.run"],
)
def test_while_it_starts(module: str, tmp_path: Path) -> None:
    check_ended(interrupted(AT_IMPORT, module, ["simulate", "tiny.yaml"], tmp_path), tmp_path)


@pytest.mark.parametrize("caller", ["add_module", "link_modules", "_dispose"])
def test_while_compiled_code_changes_hands(caller: str, tmp_path: Path) -> None:
    check_ended(interrupted(AT_RETURN, caller, ["simulate", "tiny.yaml"], tmp_path), tmp_path)


@pytest.mark.slow
@pytest.mark.parametrize("calls", [10, 3000, 30_000, 100_000, 300_000, 600_000])
@pytest.mark.parametrize(
    "command",
    [
        ["simulate", "tiny.yaml", "--html", "a.html", "--json", "a.json"],
        ["record", "tiny.yaml", "--gif", "--png"],
        ["benchmark", "tiny.yaml", "--trials", "50", "--jobs", "2", "--html", "b.html"],
        ["show_world", "map"],
        ["--version"],
    ],
)
def test_anywhere(command: list[str], calls: int, tmp_path: Path) -> None:
    done = interrupted(AT_CALL, str(calls), command, tmp_path)
    if done.returncode != 0:  # some have ended by then
        check_ended(done, tmp_path)


def test_a_run_leaves_its_recording_so_far(tmp_path: Path) -> None:
    command = ["simulate", "tiny.yaml", "--html", "a.html", "--json", "a.json"]
    done = interrupted(AT_CALL, "plan_step:5", command, tmp_path)
    check_ended(done, tmp_path)
    assert "s were driven, in a.html" in done.stderr
    assert "interrupted after" in (tmp_path / "a.html").read_text(encoding="utf-8")


@pytest.mark.parametrize("moment", ["Popen._launch:1", "Popen._launch:2", "TrialFile.append:1"])
def test_a_benchmark_keeps_what_ended(moment: str, tmp_path: Path) -> None:
    command = ["benchmark", "tiny.yaml", "--trials", "50", "--jobs", "2", "--json", "a.jsonl"]
    done = interrupted(AT_CALL, moment, command, tmp_path)
    check_ended(done, tmp_path)
    ended = len(read_trials(tmp_path / "a.jsonl")[1])
    assert f"interrupted; {ended} of 50 trials ended, in a.jsonl; --resume goes on" in done.stderr
    assert ended >= moment.startswith("TrialFile")


def test_a_process_started_apart_hears_nothing() -> None:
    with kept_from_children():
        command = "import signal; print(signal.SIGINT in signal.pthread_sigmask(signal.SIG_BLOCK, []))"
        said = subprocess.run([sys.executable, "-c", command], capture_output=True, text=True, check=True).stdout
    assert said == "True\n"
    assert signal.SIGINT not in signal.pthread_sigmask(signal.SIG_BLOCK, [])


def test_what_a_finalizer_swallows_is_raised_again() -> None:
    code = """
    import os, signal, sys, time
    from drake_starnav.utils.interrupts import run_interruptibly

    class Final:
        def __del__(self):
            os.kill(os.getpid(), signal.SIGINT)

    def work():
        Final()
        time.sleep(60.0)

    sys.exit(run_interruptibly("it", work))
    """
    done = subprocess.run(
        [sys.executable, "-c", textwrap.dedent(code)],
        capture_output=True,
        text=True,
        env={**os.environ, "PYTHONPATH": str(ROOT)},
    )
    assert (done.returncode, done.stderr) == (INTERRUPTED, "it: interrupted\n")
