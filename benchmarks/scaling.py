"""Measure the cost of many trials: python -m benchmarks.scaling

Measures trials in one and in two processes in turn, the start of a worker, and how fast one process hands trials to a
Dask cluster and files what comes back; writes the figures to benchmarks/results/scaling.json, which docs/benchmark.md
quotes. It takes some minutes, on an otherwise idle machine with at least two cores.
"""

import argparse
import json
import math
import statistics
import sys
import tempfile
import time
from collections.abc import Sequence
from concurrent.futures import Executor
from pathlib import Path
from typing import Any

from drake_starnav.cli.options import check_numbers, run_for_exit_code
from drake_starnav.evaluation import workers as workers_module
from drake_starnav.evaluation.cluster import connect_dask_pool
from drake_starnav.evaluation.jobs import Job, Record, make_cases, make_jobs, run_job
from drake_starnav.evaluation.trial_file import TrialFile, find_processor_name, make_header
from drake_starnav.evaluation.workers import run_jobs, start_local_processes
from drake_starnav.utils.files import write_text

SCENARIOS = ("forest", "maze", "room")
FIGURES = Path(__file__).parent / "results" / "scaling.json"
PATH = [[0.01 * k, 0.02 * k] for k in range(30)]
"""About as long as in a real record."""


def measure(trials: int, rounds: int) -> dict[str, Any]:
    """The figures: `trials` of each scenario in a round, `rounds` in one and in two processes in turn."""
    jobs = make_jobs(make_cases(SCENARIOS, ["star"]), trials, seed=1000)
    times: dict[int, list[float]] = {1: [], 2: []}
    start = time.perf_counter()
    with start_local_processes(1) as one:
        one.submit(run_job, jobs[0]).result()
        first = time.perf_counter() - start
        start_s = first - timed_round(one, jobs[:1])[0]
        with start_local_processes(2) as two:
            timed_round(two, jobs[:4])  # both are up and have compiled
            longest = 0.0
            for _ in range(rounds):
                for count, executor in ((1, one), (2, two)):
                    seconds, records = timed_round(executor, jobs)
                    times[count].append(seconds)
                    longest = max(longest, *(record["wall_s"] for record in records))
    return {
        "processor": find_processor_name(),
        "scenarios": SCENARIOS,
        "trials": len(jobs),
        "rounds": rounds,
        "one_s": statistics.median(times[1]),
        "two_s": statistics.median(times[2]),
        "longest_s": longest,
        "start_s": start_s,
        "filed_per_s": filing_rate(5000),
    }


def timed_round(executor: Executor, jobs: Sequence[Job]) -> tuple[float, list[Record]]:
    """Duration of the trials, s, and their records."""
    start = time.perf_counter()
    records = list(executor.map(run_job, jobs))
    return time.perf_counter() - start, records


def filing_rate(count: int) -> float:
    """Trials per second that go to a cluster, come back at once and are filed, 1/s."""
    from distributed import LocalCluster

    cases = make_cases(SCENARIOS[:1], ["star"])
    jobs = make_jobs(cases, count, seed=0)
    kept = workers_module.run_job
    workers_module.run_job = at_once
    try:
        with (
            tempfile.TemporaryDirectory() as folder,
            LocalCluster(n_workers=2, threads_per_worker=1, host="127.0.0.1", dashboard_address=":0") as cluster,
            connect_dask_pool(cluster.scheduler_address) as pool,
            TrialFile(Path(folder) / "trials.jsonl", make_header(cases, 0)) as file,
        ):
            for record in run_jobs(jobs[:100], pool):  # the connections are up
                file.append(record)
            start = time.perf_counter()
            for record in run_jobs(jobs[100:], pool):
                file.append(record)
            return (count - 100) / (time.perf_counter() - start)
    finally:
        workers_module.run_job = kept


def at_once(job: Job) -> Record:
    """A record of realistic size, without a trial."""
    step = {"count": 900, "mean_s": 2.123456789e-05, "p50_s": 2.123456789e-05, "p99_s": 5.123456789e-05}
    return {
        "trial": job.trial, "scenario": job.case.scenario, "method": job.case.method, "seed": job.seed,
        "outcome": "reached", "path": PATH, **dict.fromkeys(("command", "scan", "plan"), step),
    }  # fmt: skip


def main(arguments: Sequence[str] | None = None) -> int:
    """Measure the scaling; see `--help`. Returns the exit code."""
    parser = argparse.ArgumentParser(prog="scaling", description=(__doc__ or "").partition("\n\n")[2])
    parser.add_argument("--trials", type=int, default=8, help="of each scenario in a round (default: 8)")
    parser.add_argument("--rounds", type=int, default=3, help="of one and of two processes (default: 3)")
    options = parser.parse_args(arguments)
    return run_for_exit_code(parser.prog, lambda: write_figures(options))


def write_figures(options: argparse.Namespace) -> int:
    """Measure, write the figures and print them; returns the exit code."""
    check_numbers(options, trials=(1, math.inf), rounds=(1, math.inf))
    text = json.dumps(measure(options.trials, options.rounds), indent=2)
    write_text(FIGURES, f"{text}\n")
    print(text)
    return 0


if __name__ == "__main__":
    sys.exit(main())
