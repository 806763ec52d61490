"""Run cases and collect the trials' records, in a file that survives interruption."""

import time
from collections import Counter, defaultdict
from collections.abc import Callable, Sequence
from contextlib import closing
from heapq import heapify, heapreplace
from statistics import fmean

from drake_starnav.errors import one_line
from drake_starnav.evaluation.jobs import Case, Job, Record, make_jobs
from drake_starnav.evaluation.summary import UNSUPPORTED
from drake_starnav.evaluation.trial_file import TrialFile, record_key
from drake_starnav.evaluation.workers import Pool, run_jobs
from drake_starnav.utils.interrupts import held
from drake_starnav.utils.progress import Progress


class TimeLeft:
    """Estimates how long a batch takes yet, from the times of the trials that have ended."""

    def __init__(self, jobs: Sequence[Job], workers: int, clock: Callable[[], float] = time.monotonic) -> None:
        """
        Args:
            jobs: all trials of the batch.
            workers: number of trials that run at a time.
            clock: tells the time, s.
        """
        self._waiting, self._clock = Counter(job.case for job in jobs), clock
        self._begun = [clock()] * min(workers, len(jobs))  # of the trials under way
        self._workers, self._ended = workers, 0
        self._times: defaultdict[Case, list[float]] = defaultdict(list)
        self._first_times: defaultdict[Case, list[float]] = defaultdict(list)

    def add(self, job: Job, seconds: float) -> None:
        """A trial has ended, which took so long."""
        now = self._clock()
        self._waiting[job.case] -= 1
        self._begun.remove(min(self._begun, key=lambda begun: abs(now - seconds - begun)))
        if self._waiting.total() > len(self._begun):
            self._begun.append(now)
        self._ended += 1  # the first of a worker takes longer: it loads what is compiled
        (self._first_times if self._ended <= self._workers else self._times)[job.case].append(seconds)

    def seconds(self) -> float | None:
        """The estimate, s: cases of which none has ended are as long as the others; None if none of any has."""
        known = {case: self._times[case] or self._first_times[case] for case in self._waiting if self._has(case)}
        if not known:
            return None
        lengths, usual = [length for times in known.values() for length in times], fmean(map(fmean, known.values()))
        work = sum(count * fmean(known.get(case, (usual,))) for case, count in self._waiting.items())
        mean, now = work / max(self._waiting.total(), 1), self._clock()
        free = [_rest(now - begun, lengths) for begun in self._begun]  # when each worker is
        heapify(free)
        for _ in range(self._waiting.total() - len(free)):
            heapreplace(free, free[0] + mean)
        return max(free, default=0.0)

    def _has(self, case: Case) -> bool:
        return bool(self._times[case] or self._first_times[case])


def _rest(age: float, lengths: list[float]) -> float:
    """What a trial takes yet that has run for some time, s: as those that took longer; or else half as long again."""
    longer = [length - age for length in lengths if length > age]
    return fmean(longer) if longer else 0.5 * age


def announcement(jobs: Sequence[Job], workers: int) -> str:
    """The size of a batch."""
    cases = len({(job.case.scenario, job.case.method) for job in jobs})
    return f"{len(jobs)} trial{'s' * (len(jobs) > 1)} of {cases} case{'s' * (cases > 1)}, {workers} at a time"


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
        cases: see `make_cases`.
        trials: of each case, see `make_jobs`; further trials in the file are kept.
        seed: of the batch; see `trial_seed`.
        pool: where the trials run.
        file: stores the records and holds those of earlier runs; None to store none.
        title: of the progress bar and of reports about failed trials.

    Raises:
        StarnavError: the file can no longer be written, or the workers cannot be started or reached.
    """
    records = {record_key(record): record for record in file.records} if file else {}
    done = {key for key, record in records.items() if record["outcome"] != "error"}
    jobs = make_jobs(cases, trials, seed, done)
    if not jobs:
        return list(records.values())
    total = (trials if isinstance(trials, int) else len(trials)) * len(cases)
    untried: set[tuple[str, str]] = set()
    left = TimeLeft(jobs, pool.workers)
    try:
        with Progress(title or "trials") as bar, closing(run_jobs(jobs, pool, left.add)) as results:
            bar.say(one_line(f"{title} {announcement(jobs, pool.workers)}".lstrip()))
            bar.show(1.0 - len(jobs) / total, f"{total - len(jobs)} of {total}")
            for ended, record in enumerate(results, start=1 + total - len(jobs)):
                with held():
                    if file and record != records.get(record_key(record)):
                        file.append(record)
                    records[record_key(record)] = record
                case = record["scenario"], record["method"]
                known = record["outcome"] == "reached" or (record["outcome"] == UNSUPPORTED and case in untried)
                if not known:
                    bar.say(one_line(f"{title} {_failure(record)}".lstrip()))
                if record["outcome"] == UNSUPPORTED:
                    untried.add(case)
                bar.show(ended / total, f"{ended} of {total}", left.seconds)
    except KeyboardInterrupt:
        raise BatchInterrupted(list(records.values()), total) from None
    return list(records.values())


class BatchInterrupted(KeyboardInterrupt):
    """Ctrl-C while a batch runs.

    Attributes:
        records: of the trials that have ended.
    """

    def __init__(self, records: list[Record], total: int) -> None:
        super().__init__(f"{len(records)} of {total} trials ended")
        self.records = records


def _failure(record: Record) -> str:
    """One line that identifies a failed trial and its outcome."""
    message = f": {record['message']}" if "message" in record else ""
    return (
        f"{record['scenario']} {record['method']} trial {record['trial']} seed {record['seed']}: "
        f"{record['outcome']}{message}"
    )
