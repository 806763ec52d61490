"""Trials through executors: broken ones, and processes of this machine."""

import itertools
import json
import multiprocessing
import os
import signal
import subprocess
import sys
import time
from concurrent.futures import BrokenExecutor, Future
from contextlib import nullcontext
from pathlib import Path

import pytest

from drake_starnav.cli.benchmark import benchmark
from drake_starnav.cli.simulate import simulate
from drake_starnav.evaluation import workers
from drake_starnav.evaluation.jobs import Case, Job
from drake_starnav.evaluation.trial_file import read_trials
from drake_starnav.evaluation.workers import THREAD_VARIABLES, Pool, run_jobs, start_local_processes
from tests.helpers.trials import AtOnce

pytestmark = pytest.mark.slow


JOBS = [Job(Case("tiny", "star", ""), k, k) for k in range(8)]


class Fragile(AtOnce):
    """Runs calls at once; a deadly job breaks it, with all that is handed to it later, as a dying process would."""

    def __init__(self, deadly: dict[int, int]) -> None:
        """Takes how often each trial is deadly."""
        self.deadly = deadly
        self.broken = False

    def submit(self, function, /, *args, **kwargs) -> Future:
        if args and self.deadly.get(args[0].trial, 0) > 0:
            self.deadly[args[0].trial] -= 1
            self.broken = True
        if not self.broken:
            return super().submit(function, *args, **kwargs)
        future: Future = Future()
        future.set_exception(BrokenExecutor("a worker died"))
        return future


@pytest.fixture
def _no_simulation(monkeypatch) -> None:
    monkeypatch.setattr(workers, "run_job", lambda job: {"trial": job.trial, "outcome": "reached"})


@pytest.mark.usefixtures("_no_simulation")
@pytest.mark.parametrize("in_flight", [1, 3])
@pytest.mark.parametrize(("deadly", "errors"), [({}, set()), ({2: 1}, set()), ({0: 99}, {0}), ({7: 99}, {7})])
def test_a_crash_costs_a_retry(deadly: dict[int, int], errors: set[int], in_flight: int) -> None:
    left = dict(deadly)
    records = list(run_jobs(JOBS, Pool(lambda: nullcontext(Fragile(left)), in_flight)))
    assert sorted(record["trial"] for record in records) == list(range(8))
    lost = {record["trial"] for record in records if record["outcome"] == "error"}
    assert errors <= lost and (lost == errors or in_flight > 1)  # what ran beside it twice is lost, too


def test_local_processes_have_one_thread_and_leave_nothing_behind() -> None:
    with start_local_processes(1) as executor:
        assert executor.submit(os.getpid).result() != os.getpid()
        assert [executor.submit(os.getenv, name).result() for name in THREAD_VARIABLES] == ["1"] * len(THREAD_VARIABLES)
    assert not multiprocessing.active_children()


TIMES = ("wall_s", "command", "scan", "plan")


@pytest.fixture(scope="module")
def tiny(tmp_path_factory) -> Path:
    path = tmp_path_factory.mktemp("scenario") / "tiny.yaml"
    path.write_text("world: !Obstacles {cylinders: [[1.0, 0.9, 0.3]], goal: [1.5, 0.0]}\nsimulation: {timeout: 6.0}\n")
    return path


def results(path: Path) -> dict[tuple, dict]:
    """The records of a file without wall-clock times, by what tells them apart."""
    _, records = read_trials(path)
    found = {(r["scenario"], r["method"], r["trial"]): {k: v for k, v in r.items() if k not in TIMES} for r in records}
    assert len(found) == len(records)
    return found


@pytest.fixture(scope="module")
def whole(tiny: Path, tmp_path_factory) -> Path:
    """A file of four trials, run without interruption by two processes."""
    path = tmp_path_factory.mktemp("whole") / "trials.jsonl"
    assert benchmark(arguments(tiny, path, "--jobs", "2")) == 0
    return path


def arguments(scenario: Path, path: Path, *more: str) -> list[str]:
    return [str(scenario), "--trials", "4", "--seed", "1000", "--json", str(path), "--quiet", *more]


def test_a_trial_is_the_same_alone(whole: Path, tiny: Path, tmp_path: Path) -> None:
    record = results(whole)["tiny", "star", 2]
    assert simulate([str(tiny), "--seed", str(record["seed"]), "--json", str(tmp_path / "one.json"), "--quiet"]) == 0
    alone = json.loads((tmp_path / "one.json").read_text())
    assert alone["state_hash"] == record["state_hash"]
    header, records = read_trials(whole)
    assert alone.pop("text") == header["cases"][0]["text"]  # of a batch it stands in the header, once for all trials
    assert set(alone) == set(records[0]) - {"trial"}


def test_resuming_a_cut_file_gives_the_same_trials(whole: Path, tiny: Path, tmp_path: Path) -> None:
    cut = tmp_path / "cut.jsonl"
    lines = whole.read_bytes().splitlines(keepends=True)
    cut.write_bytes(b"".join(lines[:3]) + lines[3][:50])
    assert benchmark(arguments(tiny, cut, "--jobs", "1", "--resume")) == 0
    assert results(cut) == results(whole)
    assert cut.read_bytes().startswith(b"".join(lines[:3]))


def test_what_cannot_be_tried_is_reported_once(capsys) -> None:
    assert benchmark(["crowd_room", "--method", "dsm", "--trials", "3"]) == 0
    captured = capsys.readouterr()
    assert captured.err.count("unsupported: a method that knows its obstacles as circles in world crowd") == 1
    assert "| 3 " in captured.out.split("unsupported")[1].splitlines()[2]


def test_an_interrupted_batch_reports_on_what_ended(tiny: Path, tmp_path: Path, monkeypatch, capsys) -> None:
    def interrupted(jobs, pool):
        yield from itertools.islice(run_jobs(jobs, pool), 2)
        raise KeyboardInterrupt

    monkeypatch.setattr("drake_starnav.evaluation.workers.run_jobs", interrupted)
    command = [str(tiny), "--trials", "4", "--jobs", "1"]
    assert benchmark([*command, "--csv", str(tmp_path / "a.csv")]) == 130
    printed = capsys.readouterr()
    assert "| 2      | 2       |" in printed.out
    assert ",2,2," in (tmp_path / "a.csv").read_text()
    assert printed.err.splitlines()[-1].endswith("interrupted; 2 of 4 trials ended")


def test_ctrl_c_in_a_batch_keeps_what_has_ended_and_ends_the_workers(tiny: Path, tmp_path: Path) -> None:
    path = tmp_path / "a.jsonl"
    command = [sys.executable, "-m", "drake_starnav", "benchmark", str(tiny), "--trials", "500", "--jobs", "2"]
    batch = subprocess.Popen(
        [*command, "--json", str(path)], stderr=subprocess.PIPE, text=True, start_new_session=True,
        preexec_fn=lambda: signal.signal(signal.SIGINT, signal.SIG_DFL),
    )  # fmt: skip
    while batch.poll() is None and not (path.exists() and path.read_bytes().count(b"\n") >= 4):
        time.sleep(0.01)
    os.killpg(batch.pid, signal.SIGINT)
    said = batch.communicate(timeout=60)[1].splitlines()[-1]
    ended = len(read_trials(path)[1])
    assert batch.returncode == 130
    assert said.endswith(f"interrupted; {ended} of 500 trials ended, in {path}; --resume goes on")
    for _ in range(200):
        try:
            os.killpg(batch.pid, 0)
        except ProcessLookupError:
            return
        time.sleep(0.05)
    pytest.fail("a process is left")


COMPUTE = """
from drake_starnav.evaluation.workers import start_local_processes

def compute():
    while True:
        pass

if __name__ == "__main__":
    with start_local_processes(2) as executor:
        for _ in range(2):
            executor.submit(compute)
        print(*executor._processes, flush=True)
        executor.submit(compute).result()
"""


@pytest.mark.skipif(not Path("/proc").exists(), reason="processes are looked up in /proc")
@pytest.mark.parametrize("end", [signal.SIGTERM, signal.SIGKILL])
def test_workers_end_with_the_process_that_started_them(end: signal.Signals, tmp_path: Path) -> None:
    (tmp_path / "compute.py").write_text(COMPUTE)
    with subprocess.Popen([sys.executable, tmp_path / "compute.py"], stdout=subprocess.PIPE, text=True) as parent:
        assert parent.stdout is not None
        workers_of_parent = parent.stdout.readline().split()
        assert workers_of_parent and all(Path("/proc", worker).exists() for worker in workers_of_parent)
        parent.send_signal(end)
    for _ in range(400):
        if not any(Path("/proc", worker).exists() for worker in workers_of_parent):
            return
        time.sleep(0.05)
    pytest.fail("a worker outlives its parent")


def test_workers_know_a_world_of_the_user_s_own(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    (tmp_path / "own_posts.py").write_text(
        "import dataclasses\nfrom drake_starnav import World\nfrom drake_starnav.parameters import parameter\n\n"
        "@dataclasses.dataclass(frozen=True)\nclass Posts:\n    size: float = parameter(0.2, 'of the post')\n\n"
        "    def make(self, rng, robot):\n"
        "        post = (1.0, rng.uniform(0.6, 0.8), self.size)\n"
        "        return World('posts', (0.0, 0.0, 0.0), (1.5, 0.0), cylinders=[post])\n"
    )
    (tmp_path / "posts.yaml").write_text("world: !own_posts:Posts {size: 0.3}\n")
    monkeypatch.chdir(tmp_path)
    monkeypatch.setenv("PYTHONPATH", os.pathsep.join((str(tmp_path), os.environ.get("PYTHONPATH", ""))))
    assert benchmark(["posts.yaml", "--trials", "1", "--jobs", "1", "--json", "a.jsonl", "--quiet"]) == 0
    ((record,), header) = reversed(read_trials(tmp_path / "a.jsonl"))
    assert record["outcome"] == "reached" and list(header["code"]) == ["own_posts"]
    assert len(record["path"]) == len(record["path_s"]) and record["path_s"][-1] == pytest.approx(
        record["time_s"], abs=2e-3
    )
