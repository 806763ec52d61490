"""Run cases and collect the trials' records, in a file that survives interruption."""

from collections.abc import Sequence
from contextlib import closing

from drake_starnav.errors import one_line
from drake_starnav.evaluation.jobs import Case, Job, Record, make_jobs
from drake_starnav.evaluation.summary import UNSUPPORTED
from drake_starnav.evaluation.trial_file import TrialFile, record_key
from drake_starnav.evaluation.workers import Pool, run_jobs
from drake_starnav.utils.interrupts import held
from drake_starnav.utils.progress import Progress


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
        cases, trials, seed: see `make_jobs`; further trials in the file are kept.
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
    try:
        with Progress(title or "trials") as bar, closing(run_jobs(jobs, pool)) as results:
            bar.say(one_line(f"{title} {announcement(jobs, pool.workers)}".lstrip()))
            for ended, record in enumerate(results, start=1):
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
                bar.count(ended, len(jobs))
    except KeyboardInterrupt:
        raise BatchInterrupted(list(records.values()), total) from None
    return list(records.values())


class BatchInterrupted(KeyboardInterrupt):
    """Ctrl-C while a batch runs; it has the records of the trials that have ended."""

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
