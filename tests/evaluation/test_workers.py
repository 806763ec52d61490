"""Trials through executors: broken ones, and processes of this machine."""

import multiprocessing
import os
import signal
import threading
import time
from collections.abc import Iterator
from concurrent.futures import BrokenExecutor, Executor, Future, ThreadPoolExecutor
from contextlib import contextmanager, nullcontext

import pytest

from drake_starnav.errors import StarnavError
from drake_starnav.evaluation import workers
from drake_starnav.evaluation.jobs import Case, Job
from drake_starnav.evaluation.workers import LONE_CRASHES, THREAD_VARIABLES, Pool, local_pool, local_processes, run_jobs
from drake_starnav.utils.progress import Progress, silence

pytestmark = pytest.mark.slow


def shows_nothing(seconds: float) -> bool:
    """Whether this process is silent; a moment later, so that others are asked too."""
    time.sleep(seconds)
    return Progress.silent


JOBS = [Job(Case("tiny", "star", ""), k, k) for k in range(8)]


class Fragile(Executor):
    """Runs calls at once; a deadly job breaks it, with all that is handed to it later, as a dying process would."""

    def __init__(self, deadly: dict[int, int]) -> None:
        """Takes how often each trial is deadly."""
        self.deadly = deadly
        self.broken = False

    def submit(self, function, /, *args, **kwargs) -> Future:
        future: Future = Future()
        if args and self.deadly.get(args[0].trial, 0) > 0:
            self.deadly[args[0].trial] -= 1
            self.broken = True
        if self.broken:
            future.set_exception(BrokenExecutor("a worker died"))
        else:
            future.set_result(function(*args, **kwargs))
        return future


class Forgiving(Executor):
    """Runs calls at once, and loses only the deadly ones, as a cluster does which has other workers."""

    def __init__(self, deadly: dict[int, int]) -> None:
        """Takes how often each trial is deadly."""
        self.deadly = deadly

    def submit(self, function, /, *args, **kwargs) -> Future:
        future: Future = Future()
        if args and self.deadly.get(args[0].trial, 0) > 0:
            self.deadly[args[0].trial] -= 1
            future.set_exception(RuntimeError("several workers died of it"))
        else:
            future.set_result(function(*args, **kwargs))
        return future


@pytest.fixture
def _no_simulation(monkeypatch) -> None:
    monkeypatch.setattr(workers, "run_job", lambda job: {"trial": job.trial, "outcome": "reached"})


@pytest.mark.usefixtures("_no_simulation")
@pytest.mark.parametrize("in_flight", [1, 3, 20])
@pytest.mark.parametrize(
    ("deadly", "errors"),
    [({}, set()), ({2: 1}, set()), ({2: 2, 3: 1}, set()), ({0: 99}, {0}), ({3: 99, 4: 99, 7: 1}, {3, 4})],
)
@pytest.mark.parametrize("kind", [Fragile, Forgiving])
def test_a_crash_costs_only_a_retry(kind: type, deadly: dict[int, int], errors: set[int], in_flight: int) -> None:
    left = dict(deadly)
    records = list(run_jobs(JOBS, Pool(lambda: nullcontext(kind(left)), in_flight)))
    assert sorted(record["trial"] for record in records) == list(range(8))
    assert {record["trial"] for record in records if record["outcome"] == "error"} == errors


def test_workers_that_cannot_start_are_reported() -> None:
    @contextmanager
    def broken() -> Iterator[Executor]:
        executor = Fragile({})
        executor.broken = True
        yield executor

    with pytest.raises(StarnavError, match="cannot run trials"):
        list(run_jobs(JOBS, Pool(broken, 2)))


@pytest.mark.usefixtures("_no_simulation")
def test_workers_out_of_reach_are_reported_after_what_they_had_done() -> None:
    class Leaving(Forgiving):
        def submit(self, function, /, *args, **kwargs) -> Future:
            future = super().submit(function, *args, **kwargs)
            if args and args[0].trial == 3:
                future = Future()
                future.cancel()
            return future

    records = []
    with pytest.raises(StarnavError, match="cannot be reached any more; allowed: --resume"):
        for record in run_jobs(JOBS, Pool(lambda: nullcontext(Leaving({})), 8)):
            records.append(record)
    assert [record["trial"] for record in records] == [0, 1, 2]


def test_no_more_jobs_are_in_flight_than_asked(monkeypatch) -> None:
    lock, running, most = threading.Lock(), 0, 0

    def run(job: Job) -> dict:
        nonlocal running, most
        with lock:
            running += 1
            most = max(most, running)
        with lock:
            running -= 1
        return {"trial": job.trial}

    monkeypatch.setattr(workers, "run_job", run)
    records = list(run_jobs(JOBS, Pool(lambda: ThreadPoolExecutor(8), 2)))
    assert len(records) == 8
    assert most <= 2


def test_local_processes_have_one_thread_and_leave_nothing_behind() -> None:
    before = dict(os.environ)
    with local_processes(1) as executor:
        assert executor.submit(os.getpid).result() != os.getpid()
        assert [executor.submit(os.getenv, name).result() for name in THREAD_VARIABLES] == ["1"] * len(THREAD_VARIABLES)
    assert dict(os.environ) == before
    assert not multiprocessing.active_children()


def test_an_interrupt_ends_the_processes_at_once() -> None:
    with pytest.raises(KeyboardInterrupt), local_processes(1) as executor:
        executor.submit(os.getpid).result()  # it runs
        executor.submit(time.sleep, 600.0)
        raise KeyboardInterrupt
    assert not multiprocessing.active_children()


def test_a_killed_worker_costs_only_a_retry() -> None:
    """With the real thing: a process is killed while trials are under way, and each has its record once."""
    text = "world: !Obstacles {goal: [1.0, 0.0]}\n"
    jobs = [Job(Case("empty", "star", text), k, k) for k in range(4)]
    records = []
    for record in run_jobs(jobs, local_pool(1)):
        if not records:
            multiprocessing.active_children()[0].kill()
        records.append(record)
    assert sorted(record["trial"] for record in records) == [0, 1, 2, 3]
    assert {record["outcome"] for record in records} == {"reached"}


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
    (record,) = run_jobs([Job(JOBS[0].case, 5, 1)], Pool(lambda: nullcontext(Deadly()), 4))
    assert runs == [5] * 3  # once among the others, twice alone
    assert (record["outcome"], LONE_CRASHES) == ("error", 2)


def test_workers_leave_an_interrupt_to_their_parent() -> None:
    with local_processes(1) as executor:
        assert signal.SIGINT in executor.submit(signal.pthread_sigmask, signal.SIG_BLOCK, []).result()


def test_one_worker_shows_what_it_compiles_unless_its_parent_is_silent() -> None:
    for quiet, silent in ((False, [False, True]), (True, [True, True])):
        with silence(quiet), local_processes(2) as executor:
            both = [executor.submit(shows_nothing, 1.0) for _ in range(2)]
            assert sorted(future.result() for future in both) == silent
