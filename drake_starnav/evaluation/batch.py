"""Run cases and collect the trials' records, in a file that survives interruption."""

import sys
from collections.abc import Sequence
from contextlib import closing

from tqdm import tqdm

from drake_starnav.errors import one_line
from drake_starnav.evaluation.jobs import Case, Job, Record, make_jobs
from drake_starnav.evaluation.summary import UNSUPPORTED
from drake_starnav.evaluation.trial_file import TrialFile, record_key
from drake_starnav.evaluation.workers import Pool, run_jobs

TYPICAL_WALL_S = {"star": 1.0}
OTHER_WALL_S = 12.0
"""Time of a trial on one core, s: what `star` took in forests, mazes and rooms, and what took methods that often run
into the time limit."""


def announcement(jobs: Sequence[Job], workers: int) -> str:
    """The size of a batch and a rough estimate of its time, which the progress bar soon improves."""
    seconds = sum(TYPICAL_WALL_S.get(job.case.method, OTHER_WALL_S) for job in jobs) / max(min(workers, len(jobs)), 1)
    amount, unit = next((seconds / s, unit) for s, unit in ((3600.0, "h"), (60.0, "min"), (1.0, "s")) if seconds >= s)
    cases = len({(job.case.scenario, job.case.method) for job in jobs})
    count = f"{len(jobs)} trial{'s' * (len(jobs) > 1)} of {cases} case{'s' * (cases > 1)}"
    return f"{count}, {workers} at a time: about {max(amount, 1.0):.2g} {unit}"


def run_batch(
    cases: Sequence[Case],
    *,
    trials: int | Sequence[int],
    seed: int,
    pool: Pool,
    file: TrialFile | None = None,
    quiet: bool = False,
    title: str = "",
) -> list[Record]:
    """Run the trials that `file` lacks or in which an error occurred, append each as it ends, and return all.

    Args:
        cases: see `make_cases`.
        trials: of each case, see `make_jobs`; further trials in the file are kept.
        seed: of the batch; see `trial_seed`.
        pool: where the trials run.
        file: stores the records and holds those of earlier runs; None to store none.
        quiet: show no progress, and report neither failed trials nor the first unsupported one of each case.
        title: of the progress bar and of reports about failed trials.

    Raises:
        StarnavError: the file can no longer be written, or the workers cannot be started or reached.
    """
    records = {record_key(record): record for record in file.records} if file else {}
    done = {key for key, record in records.items() if record["outcome"] != "error"}
    jobs = make_jobs(cases, trials, seed, done)
    total = (trials if isinstance(trials, int) else len(trials)) * len(cases)
    if jobs and not quiet:
        print(one_line(f"{title} {announcement(jobs, pool.workers)}".lstrip()), file=sys.stderr, flush=True)
    untried: set[tuple[str, str]] = set()
    bar = tqdm(total=total, initial=total - len(jobs), desc=title, unit="trial", disable=quiet or None, leave=False)
    with bar, closing(run_jobs(jobs, pool)) as results:
        for record in results:
            if file and record != records.get(record_key(record)):
                file.append(record)
            records[record_key(record)] = record
            bar.update()
            case = record["scenario"], record["method"]
            known = record["outcome"] == "reached" or (record["outcome"] == UNSUPPORTED and case in untried)
            if not known and not quiet:
                bar.write(one_line(f"{title} {_failure(record)}".lstrip()), file=sys.stderr)
            if record["outcome"] == UNSUPPORTED:
                untried.add(case)
    return list(records.values())


def _failure(record: Record) -> str:
    """One line that identifies a failed trial and its outcome."""
    message = f": {record['message']}" if "message" in record else ""
    return (
        f"{record['scenario']} {record['method']} trial {record['trial']} seed {record['seed']}: "
        f"{record['outcome']}{message}"
    )
