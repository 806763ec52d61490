"""Ctrl-C while a command compiles, drives or runs a batch: one sentence, nothing lost, no process left."""

import os
import signal
import subprocess
import sys
import time
from pathlib import Path

import pytest

from drake_starnav.evaluation.trial_file import read_trials
from drake_starnav.utils.interrupts import deaf_children

ROOT = Path(__file__).parents[2]
SCENARIO = "world: !Obstacles {cylinders: [[1.0, 0.9, 0.3]], goal: [1.5, 0.0]}\nsimulation: {timeout: 6.0}\n"


def started(folder: Path, *arguments: str, **environment: str) -> subprocess.Popen:
    """A command in a folder, in a process group of its own, as from a terminal."""
    (folder / "tiny.yaml").write_text(SCENARIO)
    return subprocess.Popen(
        [sys.executable, "-m", "drake_starnav", *arguments], cwd=folder, stdout=subprocess.DEVNULL,
        stderr=subprocess.PIPE, text=True, env={**os.environ, "PYTHONPATH": str(ROOT), **environment},
        start_new_session=True, preexec_fn=hears,
    )  # fmt: skip


def hears() -> None:
    """Ctrl-C is not ignored in a process that begins, as it is in those that a shell has put into the background."""
    signal.signal(signal.SIGINT, signal.SIG_DFL)


def interrupted(process: subprocess.Popen) -> str:
    """What a command says at Ctrl-C, which ends it and all that it started."""
    os.killpg(process.pid, signal.SIGINT)
    said = process.communicate(timeout=60)[1]
    assert process.returncode == 130, said
    assert "Traceback" not in said
    for _ in range(200):
        try:
            os.killpg(process.pid, 0)
        except ProcessLookupError:
            return said
        time.sleep(0.05)
    pytest.fail("a process is left")


@pytest.mark.slow
@pytest.mark.parametrize("after", [4.0, 6.0, 9.0, 13.0])
def test_ctrl_c_while_functions_are_compiled(after: float, tmp_path: Path) -> None:
    process = started(tmp_path, "simulate", "tiny.yaml", NUMBA_CACHE_DIR=str(tmp_path / "cache"))
    time.sleep(after)
    assert process.poll() is None
    assert "interrupted" in interrupted(process)


@pytest.mark.slow
def test_ctrl_c_in_a_batch_keeps_what_has_ended_and_ends_the_workers(tmp_path: Path) -> None:
    path = tmp_path / "a.jsonl"
    process = started(tmp_path, "benchmark", "tiny.yaml", "--trials", "500", "--jobs", "2", "--json", str(path))
    while process.poll() is None and not (path.exists() and path.read_bytes().count(b"\n") >= 4):
        time.sleep(0.01)
    said = interrupted(process).splitlines()[-1]
    ended = len(read_trials(path)[1])
    assert ended >= 3
    assert f"interrupted; {ended} of 500 trials ended, in {path}; --resume goes on" in said


def test_children_do_not_hear_it() -> None:
    code = "import signal; print(signal.SIGINT in signal.pthread_sigmask(signal.SIG_BLOCK, ()))"
    with deaf_children():
        child = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, check=True)
    assert child.stdout == "True\n"
    assert signal.SIGINT not in signal.pthread_sigmask(signal.SIG_BLOCK, ())
