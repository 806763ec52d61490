"""Trials through a `concurrent.futures.Executor`: processes of this machine, or whatever has the same interface."""

import multiprocessing
import os
import signal
import threading
from collections import Counter, deque
from collections.abc import Callable, Generator, Iterable, Iterator
from concurrent.futures import BrokenExecutor, Executor, Future, ProcessPoolExecutor
from contextlib import AbstractContextManager, contextmanager
from dataclasses import dataclass
from multiprocessing.connection import Connection
from queue import SimpleQueue

from drake_starnav.errors import StarnavError
from drake_starnav.evaluation.jobs import Job, Record, error_record, run_job

THREAD_VARIABLES = ("OMP_NUM_THREADS", "OPENBLAS_NUM_THREADS", "MKL_NUM_THREADS", "NUMBA_NUM_THREADS")
"""A worker has one core: these keep the libraries in it from starting threads of their own."""
LONE_CRASHES = 2
"""A trial that ends its worker this often while nothing else runs is given up."""


@dataclass(frozen=True)
class Pool:
    """Where trials run.

    Attributes:
        make_executor: makes an executor as a context manager: once, and again after it broke.
        in_flight: how many trials are handed to the executor at a time; at least the number of its workers.
    """

    make_executor: Callable[[], AbstractContextManager[Executor]]
    in_flight: int


def local_pool(count: int) -> Pool:
    """`count` processes of this machine."""
    return Pool(lambda: local_processes(count), 2 * count)


def run_jobs(jobs: Iterable[Job], pool: Pool) -> Generator[Record, None, None]:
    """Run trials and yield each one's record as it ends; a lost worker costs a retry of what was under way there.

    Trials that were under way when a worker was lost run again one at a time, so that the one to blame is known. If
    it is lost again, it becomes a record with the outcome `error`.

    Raises:
        StarnavError: the workers cannot be started, or not be reached any more.
    """
    waiting = deque(jobs)
    suspects: deque[Job] = deque()
    crashes: Counter[Job] = Counter()
    while waiting or suspects:
        queue, limit = (suspects, 1) if suspects else (waiting, pool.in_flight)
        with pool.make_executor() as executor:
            _check(executor)
            lost = yield from _run(queue, executor, limit)
        if queue is waiting:
            suspects.extend(lost)
            continue
        for job in lost:
            crashes[job] += 1
            if crashes[job] < LONE_CRASHES:
                suspects.append(job)
            else:
                yield error_record(job, f"its worker process died, {LONE_CRASHES} times with no other trial under way")


def _run(queue: deque[Job], executor: Executor, limit: int) -> Generator[Record, None, list[Job]]:
    """Take jobs from the queue until it is empty or the executor breaks; returns those whose worker was lost."""
    running: dict[Future[Record], Job] = {}
    ended: SimpleQueue[Future[Record]] = SimpleQueue()
    lost: list[Job] = []
    broken = False
    while running or (queue and not broken):
        while queue and len(running) < limit and not broken:
            try:
                future = executor.submit(run_job, queue[0])
            except BrokenExecutor:
                broken = True
            else:
                running[future] = queue.popleft()
                future.add_done_callback(ended.put)
        if not running:
            break
        future = ended.get()
        job = running.pop(future)
        if future.cancelled():
            raise StarnavError("the workers cannot be reached any more; allowed: --resume once they can, for the rest")
        error = future.exception()  # never the trial's own: run_job makes a record of that
        if error is None:
            yield future.result()
        else:
            lost.append(job)
            broken = broken or isinstance(error, BrokenExecutor)
    return lost


def _check(executor: Executor) -> None:
    """Raise `StarnavError` unless a worker can be started, and Drake be imported there."""
    try:
        executor.submit(_load).result()
    except Exception as error:
        raise StarnavError(f"a worker process cannot run trials: {error}; allowed: a working installation") from None


def _load() -> None:
    import drake_starnav.simulation  # noqa: F401


@contextmanager
def local_processes(count: int) -> Iterator[Executor]:
    """Spawned processes of this machine, one thread each, which end at once when the context is left by an exception.

    They also end when this process is killed. They are spawned, never forked: forking with Drake's threads deadlocks.

    Args:
        count: number of processes, >= 1.
    """
    before = {name: os.environ.get(name) for name in THREAD_VARIABLES}
    os.environ.update(dict.fromkeys(THREAD_VARIABLES, "1"))  # children read them before they import NumPy
    context = multiprocessing.get_context("spawn")
    listener, lifeline = context.Pipe(duplex=False)
    executor = ProcessPoolExecutor(count, mp_context=context, initializer=_hold, initargs=(listener,))
    try:
        yield executor
        executor.shutdown()
    finally:
        lifeline.close()
        executor.shutdown(cancel_futures=True)
        listener.close()
        for name, value in before.items():
            if value is None:
                os.environ.pop(name, None)
            else:
                os.environ[name] = value


def _hold(lifeline: Connection) -> None:
    """Tie the worker to the process that started it: it dies when the other end of the pipe is closed."""
    signal.signal(signal.SIGINT, signal.SIG_IGN)  # Ctrl-C is the parent's to handle

    def end_with_parent() -> None:
        lifeline.poll(None)
        os._exit(1)

    threading.Thread(target=end_with_parent, daemon=True).start()
