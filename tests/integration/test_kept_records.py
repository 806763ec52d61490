"""What a benchmark's records rely on: the disk, the code that ran them, fair order, and workers that do not give in."""

import os
import signal
from concurrent.futures import BrokenExecutor, Executor, Future
from contextlib import nullcontext
from pathlib import Path

from drake_starnav.evaluation import trial_file, workers
from drake_starnav.evaluation.jobs import Case, Job, error_record, make_jobs
from drake_starnav.evaluation.trial_file import TrialFile, make_header
from drake_starnav.evaluation.workers import LONE_CRASHES, Pool, local_processes, run_jobs

CASES = [Case(name, "star", "world: !Forest {}\n") for name in ("a", "b")]


def test_each_record_is_synchronised_with_the_disk(tmp_path: Path, monkeypatch) -> None:
    sizes: list[int] = []
    monkeypatch.setattr(os, "fsync", lambda handle: sizes.append(os.fstat(handle).st_size))
    with TrialFile(tmp_path / "trials.jsonl", make_header(CASES, 3)) as file:
        for job in make_jobs(CASES, 2, 3):
            file.append(error_record(job, "for the test"))
            assert sizes[-1] == file.path.stat().st_size
    assert len(set(sizes)) == 5  # the header's and the records'


def test_the_hash_of_the_source_is_of_names_and_contents_in_all_folders(tmp_path: Path, monkeypatch) -> None:
    monkeypatch.setattr(trial_file, "__file__", str(tmp_path / "benchmark" / "trial_file.py"))
    hashes = []
    for names, content in ((("a", "b"), "x"), (("a", "b"), "y"), (("a", "c"), "y"), (("a/c",), "y"), (("a/d",), "y")):
        for path in tmp_path.rglob("*.py"):
            path.unlink()
        for name in names:
            path = tmp_path / f"{name}.py"
            path.parent.mkdir(exist_ok=True)
            path.write_text(content)
        hashes.append(trial_file.source_hash.__wrapped__())
        (tmp_path / "notes.txt").write_text(str(names))
        assert trial_file.source_hash.__wrapped__() == hashes[-1]
    assert len(set(hashes)) == len(hashes)


def test_every_case_has_its_first_trial_before_any_has_its_second() -> None:
    keys = [(job.trial, job.case.scenario) for job in make_jobs(CASES, 3, 0)]
    assert keys == [(trial, name) for trial in range(3) for name in "ab"]
    assert [(job.trial, job.case.scenario) for job in make_jobs(CASES, [7, 4], 0)] == [
        (trial, name) for trial in (7, 4) for name in "ab"
    ]


def test_a_deadly_trial_is_given_up_after_so_many_crashes_alone(monkeypatch) -> None:
    class Deadly(Executor):
        def submit(self, function, /, *args, **kwargs) -> Future:
            future: Future = Future()
            if args:
                runs.append(args[0].trial)
                future.set_exception(BrokenExecutor("a worker died"))
            else:
                future.set_result(function())
            return future

    runs: list[int] = []
    monkeypatch.setattr(workers, "_load", lambda: None)
    (record,) = run_jobs([Job(CASES[0], 5, 1)], Pool(lambda: nullcontext(Deadly()), 4))
    assert runs == [5] * 3  # once among the others, twice alone
    assert (record["outcome"], LONE_CRASHES) == ("error", 2)


def test_workers_leave_an_interrupt_to_their_parent() -> None:
    with local_processes(1) as executor:
        assert executor.submit(signal.getsignal, signal.SIGINT).result() is signal.SIG_IGN
