"""Cases and a number of trials -> their records, in a file that survives interruption."""

import sys
from collections.abc import Sequence
from contextlib import closing

from tqdm import tqdm

from drake_starnav.errors import one_line
from drake_starnav.evaluation.jobs import Case, Record, make_jobs
from drake_starnav.evaluation.summary import UNSUPPORTED
from drake_starnav.evaluation.trial_file import TrialFile, record_key
from drake_starnav.evaluation.workers import Pool, run_jobs


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
    """Run the trials that `file` does not hold yet or that could not be run, append each as it ends, and return all.

    Args:
        cases: see `make_cases`.
        trials: of each case, see `make_jobs`; a file that holds more of them keeps them.
        seed: of the batch; see `trial_seed`.
        pool: where they run.
        file: where to keep the records, and which trials are done; None to keep none.
        quiet: neither show progress nor name the trials that fail or, of each case, the first that cannot be tried.
        title: of the progress bar and of what is said about failed trials.

    Raises:
        StarnavError: the file cannot be written any more, or the workers not be started or reached.
    """
    records = {record_key(record): record for record in file.records} if file else {}
    done = {key for key, record in records.items() if record["outcome"] != "error"}
    jobs = make_jobs(cases, trials, seed, done)
    total = (trials if isinstance(trials, int) else len(trials)) * len(cases)
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
    """One line that says how to see a failed trial."""
    message = f": {record['message']}" if "message" in record else ""
    return (
        f"{record['scenario']} {record['method']} trial {record['trial']} seed {record['seed']}: "
        f"{record['outcome']}{message}"
    )
