"""Run trials through a `concurrent.futures.Executor`, such as processes of this machine."""

import multiprocessing
import os
import threading
from collections import Counter, deque
from collections.abc import Callable, Generator, Iterable, Iterator
from concurrent.futures import BrokenExecutor, Executor, Future, ProcessPoolExecutor
from contextlib import AbstractContextManager, contextmanager
from dataclasses import dataclass
from multiprocessing.connection import Connection
from multiprocessing.synchronize import Semaphore
from queue import SimpleQueue
from typing import Any

from drake_starnav.errors import StarnavError
from drake_starnav.evaluation.jobs import Job, Record, error_record, run_job
from drake_starnav.utils.interrupts import kept_from_children
from drake_starnav.utils.progress import Progress

THREAD_VARIABLES = ("OMP_NUM_THREADS", "OPENBLAS_NUM_THREADS", "MKL_NUM_THREADS", "NUMBA_NUM_THREADS")
"""Each worker has one core: these variables keep its libraries from starting threads of their own."""
LONE_CRASHES = 2
"""A trial is given up after it has killed its worker this many times while running alone."""


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


def local_pool(count: int) -> Pool:
    """`count` processes of this machine."""
    return Pool(lambda: local_processes(count), 2 * count, count)


def run_jobs(jobs: Iterable[Job], pool: Pool) -> Generator[Record, None, None]:
    """Run trials in a pool and yield the record of each as it ends; trials of a lost worker are retried.

    Trials that were running when a worker was lost run again one at a time, which identifies the culprit. If its worker
    is lost again, it yields a record with the outcome `error`.

    Raises:
        StarnavError: the workers cannot be started, or can no longer be reached.
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
    """Run jobs from the queue until it is empty or the executor breaks; returns those with a lost worker."""
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
        error = future.exception()  # never the trial's own: run_job turns that into a record
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


class _Processes(ProcessPoolExecutor):
    """Starts its processes as they are needed, and leaves Ctrl-C to this one."""

    def submit(self, function: Callable, /, *args: Any, **kwargs: Any) -> Future:
        with kept_from_children():
            return super().submit(function, *args, **kwargs)


@contextmanager
def local_processes(count: int) -> Iterator[Executor]:
    """So many spawned processes of this machine, with one thread each.

    They end at once if the context is left by an exception or this process is killed. They are spawned, not forked:
    forking with Drake's threads deadlocks. The first of them shows what it compiles, if this process may.
    """
    before = {name: os.environ.get(name) for name in THREAD_VARIABLES}
    os.environ.update(dict.fromkeys(THREAD_VARIABLES, "1"))  # children read them before they import NumPy
    context = multiprocessing.get_context("spawn")
    listener, lifeline = context.Pipe(duplex=False)
    voice = context.Semaphore(0 if Progress.silent else 1)
    executor = _Processes(count, mp_context=context, initializer=_hold, initargs=(listener, voice))
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


def _hold(lifeline: Connection, voice: Semaphore) -> None:
    """Tie the worker to its parent process: it exits when the other end of the pipe is closed."""

    def end_with_parent() -> None:
        lifeline.poll(None)
        os._exit(1)

    threading.Thread(target=end_with_parent, daemon=True).start()
    Progress.silent = not voice.acquire(block=False)
