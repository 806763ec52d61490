"""Run trials through a `concurrent.futures.Executor`, such as processes of this machine, and collect their records."""

import multiprocessing
import os
import signal
import threading
from collections import deque
from collections.abc import Callable, Generator, Iterable, Iterator, Sequence
from concurrent.futures import BrokenExecutor, Executor, Future, ProcessPoolExecutor
from contextlib import AbstractContextManager, closing, contextmanager
from dataclasses import dataclass
from multiprocessing import connection
from queue import SimpleQueue

from drake_starnav.errors import StarnavError, one_line
from drake_starnav.evaluation.jobs import Case, Job, Record, make_error_record, make_jobs, run_job
from drake_starnav.evaluation.summary import UNSUPPORTED
from drake_starnav.evaluation.trial_file import TrialFile, make_record_key
from drake_starnav.utils.progress import Progress

THREAD_VARIABLES = ("OMP_NUM_THREADS", "OPENBLAS_NUM_THREADS", "MKL_NUM_THREADS", "NUMBA_NUM_THREADS")
"""Each worker has one core: these variables keep its libraries from starting threads of their own."""


@dataclass(frozen=True)
class Pool:
    """Where trials run.

    Attributes:
        make_executor: makes an executor as a context manager, and a new one after it broke.
        in_flight: number of trials submitted to the executor at a time; at least its number of workers.
        workers: number of trials that run at a time.
    """

    make_executor: Callable[[], AbstractContextManager[Executor]]
    in_flight: int
    workers: int = 1


def make_local_pool(count: int) -> Pool:
    """`count` processes of this machine."""
    return Pool(lambda: start_local_processes(count), 2 * count, count)


def run_jobs(jobs: Iterable[Job], pool: Pool) -> Generator[Record, None, None]:
    """Run trials in a pool and yield the record of each as it ends.

    Trials whose worker was lost, or that ran beside one that was, run once more; one that is lost again yields a record
    with the outcome `error`.

    Raises:
        StarnavError: the workers can no longer be reached.
    """
    waiting_jobs, lost_jobs = deque(jobs), set[Job]()
    while waiting_jobs:
        running_jobs: dict[Future[Record], Job] = {}
        ended_jobs: SimpleQueue[Future[Record]] = SimpleQueue()  # `wait` would not notice those cancelled from outside
        is_broken = False
        with pool.make_executor() as executor:
            while running_jobs or (waiting_jobs and not is_broken):
                while waiting_jobs and not is_broken and len(running_jobs) < pool.in_flight:
                    try:
                        future = executor.submit(run_job, waiting_jobs[0])
                    except BrokenExecutor:
                        is_broken = True
                        break
                    running_jobs[future] = waiting_jobs.popleft()
                    future.add_done_callback(ended_jobs.put)
                if not running_jobs:
                    continue
                job = running_jobs.pop(future := ended_jobs.get())
                if future.cancelled():
                    raise StarnavError("the workers cannot be reached any more; allowed: --resume once they can")
                if future.exception() is None:  # never the trial's own: run_job turns that into a record
                    yield future.result()
                elif job in lost_jobs:
                    is_broken = True
                    yield make_error_record(job, "its worker process died, twice")
                else:
                    is_broken = True
                    lost_jobs.add(job)
                    waiting_jobs.append(job)


@contextmanager
def start_local_processes(count: int) -> Iterator[Executor]:
    """An executor of `count` processes of this machine, with one thread each.

    They are spawned, not forked: forking with Drake's threads deadlocks. If the context is left by an exception, as by
    Ctrl-C, which they themselves ignore, they end at once; so they do if this process ends, in whatever way.
    """
    for name in THREAD_VARIABLES:
        os.environ.setdefault(name, "1")  # children read them before they import NumPy
    executor = ProcessPoolExecutor(count, multiprocessing.get_context("spawn"), initializer=_follow_parent)
    try:
        yield executor
        executor.shutdown()
    except BaseException:
        executor.shutdown(wait=False, cancel_futures=True)
        for worker in multiprocessing.active_children():
            worker.terminate()
            worker.join()
        raise


def _follow_parent() -> None:
    """Leave Ctrl-C to the process that started this one, and end with it, even if it is killed.

    The sentinel is a pipe whose other end only that process holds: the system closes it, however the process ends.
    """
    signal.signal(signal.SIGINT, signal.SIG_IGN)
    parent = multiprocessing.parent_process()
    assert parent is not None  # it is an initializer of spawned processes

    def end_with_parent() -> None:
        connection.wait([parent.sentinel])
        os._exit(1)

    threading.Thread(target=end_with_parent, daemon=True).start()


def describe_batch(jobs: Sequence[Job], workers: int) -> str:
    """The size of a batch."""
    case_count = len({(job.case.scenario, job.case.method) for job in jobs})
    return f"{len(jobs)} trial{'s' * (len(jobs) > 1)} of {case_count} case{'s' * (case_count > 1)}, {workers} at a time"


def run_batch(
    cases: Sequence[Case],
    *,
    trials: int | Sequence[int],
    seed: int,
    pool: Pool,
    file: TrialFile | None = None,
    title: str = "",
) -> list[Record]:
    """Run the trials that `file` lacks or in which an error occurred, append each as it ends, and return all.

    Args:
        cases, trials, seed: see `make_jobs`; further trials in the file are kept.
        pool: where the trials run.
        file: stores the records and holds those of earlier runs; None to store none.
        title: of the progress bar and of reports about failed trials.

    Raises:
        StarnavError: the file can no longer be written, or the workers cannot be started or reached.
    """
    records = {make_record_key(record): record for record in file.records} if file else {}
    done_keys = {key for key, record in records.items() if record["outcome"] != "error"}
    jobs = make_jobs(cases, trials, seed, done_keys)
    if not jobs:
        return list(records.values())
    trial_count = (trials if isinstance(trials, int) else len(trials)) * len(cases)
    untried_pairs: set[tuple[str, str]] = set()
    try:
        with Progress(title or "trials") as bar, closing(run_jobs(jobs, pool)) as results:
            bar.say(one_line(f"{title} {describe_batch(jobs, pool.workers)}".lstrip()))
            for ended_count, record in enumerate(results, start=1):
                if file and record != records.get(make_record_key(record)):
                    file.append(record)
                records[make_record_key(record)] = record
                case_names = record["scenario"], record["method"]
                is_known = record["outcome"] == "reached" or (
                    record["outcome"] == UNSUPPORTED and case_names in untried_pairs
                )
                if not is_known:
                    bar.say(one_line(f"{title} {_describe_failure(record)}".lstrip()))
                if record["outcome"] == UNSUPPORTED:
                    untried_pairs.add(case_names)
                bar.count(ended_count, len(jobs))
    except KeyboardInterrupt:
        raise BatchInterrupted(list(records.values()), trial_count) from None
    return list(records.values())


class BatchInterrupted(KeyboardInterrupt):
    """Ctrl-C while a batch runs; it has the records of the trials that have ended."""

    def __init__(self, records: list[Record], total: int) -> None:
        super().__init__(f"{len(records)} of {total} trials ended")
        self.records = records


def _describe_failure(record: Record) -> str:
    message_text = f": {record['message']}" if "message" in record else ""
    return (
        f"{record['scenario']} {record['method']} trial {record['trial']} seed {record['seed']}: "
        f"{record['outcome']}{message_text}"
    )
