"""Measure the growth of a worker's memory over many trials: python -m benchmarks.memory [SCENARIO ...] [--trials 300]

One worker process runs short trials of all scenarios and methods in turn, as `scripts/benchmark.py --jobs 1` would.
The exit code is 1 if the worker's memory grows by more than a bound after the first trials.
"""

import argparse
import sys
from collections.abc import Sequence

from benchmarks.soak import memory_mb
from drake_starnav.cli.options import add_overrides, run_for_exit_code
from drake_starnav.errors import StarnavError
from drake_starnav.evaluation.jobs import make_cases, make_jobs, run_job
from drake_starnav.evaluation.workers import start_local_processes

SCENARIOS = ("forest", "maze", "room", "crowd_room")
WARM = 20
"""Number of trials after which a worker has loaded everything it needs."""
BOUND = 30.0
"""Allowed growth of its memory from then on, MB."""
SHORT = 2.0
"""Time limit of a trial, s."""


def main(arguments: Sequence[str] | None = None) -> int:
    """Run the trials and print the worker's memory; returns the exit code."""
    parser = argparse.ArgumentParser(prog="memory", description=(__doc__ or "").partition("\n\n")[2])
    parser.add_argument("scenario", nargs="*", default=SCENARIOS, help=f"default: {' '.join(SCENARIOS)}")
    parser.add_argument("--method", nargs="+", default=["star"], help="default: star")
    parser.add_argument("--trials", type=int, default=300, help="in all (default: 300)")
    parser.add_argument("--timeout", type=float, default=SHORT, help=f"of a trial, s (default: {SHORT:g})")
    add_overrides(parser)
    options = parser.parse_args(arguments)
    return run_for_exit_code(parser.prog, lambda: run(options))


def run(options: argparse.Namespace) -> int:
    """Run the trials one after another in one process, and query its memory in between."""
    if options.trials <= WARM:
        raise StarnavError(f"--trials is {options.trials}; allowed: a whole number > {WARM}")
    overrides = [f"simulation.timeout={options.timeout}", *options.overrides]
    cases = make_cases(options.scenario, options.method, overrides)
    jobs = make_jobs(cases, -(-options.trials // len(cases)), seed=0)[: options.trials]
    held = {}
    with start_local_processes(1) as worker:
        for count, job in enumerate(jobs, 1):
            record = worker.submit(run_job, job).result()
            if record["outcome"] == "error":
                raise StarnavError(f"{job.case.scenario} {job.case.method} trial {job.trial}: {record['message']}")
            if count % WARM == 0 or count == len(jobs):
                held[count] = worker.submit(memory_mb).result()
                print(f"after {count:4} trials: {held[count]:.1f} MB", flush=True)
    growth = held[len(jobs)] - held[WARM]
    print(f"{growth:+.1f} MB since trial {WARM}; allowed: at most {BOUND:g} MB")
    return 0 if growth <= BOUND else 1


if __name__ == "__main__":
    sys.exit(main())
