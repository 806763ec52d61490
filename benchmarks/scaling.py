"""What many trials cost: python -m benchmarks.scaling

Measures trials in one and in two processes in turn, the start of a worker, and how fast one process hands trials to a
Dask cluster and files what comes back; writes the figures to benchmarks/results/scaling.json and what follows from
them to docs/scaling.md. It takes some minutes, on a machine with at least two cores that is otherwise idle.
"""

import argparse
import json
import statistics
import sys
import tempfile
import time
from collections.abc import Sequence
from concurrent.futures import Executor
from dataclasses import asdict, dataclass
from pathlib import Path

from drake_starnav.cli.options import exit_code
from drake_starnav.errors import StarnavError
from drake_starnav.evaluation import Job, TrialFile, dask_pool, make_cases, make_header, make_jobs, run_job, run_jobs
from drake_starnav.evaluation import workers as workers_module
from drake_starnav.evaluation.jobs import Record
from drake_starnav.evaluation.summary import markdown_table
from drake_starnav.evaluation.trial_file import processor_name
from drake_starnav.evaluation.workers import local_processes
from scripts.maintenance.record_results import FOLDER, ROOT, with_section

SCENARIOS = ("forest", "maze", "room")
COMMAND = "python -m benchmarks.scaling"
FIGURES, PAGE = FOLDER / "scaling.json", ROOT / "docs" / "scaling.md"
WANTED = 100_000
"""Trials that the page tells the cost of."""
CORES = (1, 100, 1000)
PATH = [[0.01 * k, 0.02 * k] for k in range(30)]
"""About as much as a real record has."""


@dataclass(frozen=True)
class Scaling:
    """What was measured.

    Attributes:
        processor: its name.
        trials: in each round, over SCENARIOS.
        rounds: in which one and two processes took turns.
        one_s, two_s: median time of a round in one and in two processes, s.
        longest_s: the longest trial, s.
        start_s: from asking for a process until Drake is loaded there, s.
        filed_per_s: trials that one process can hand out and file, 1/s.
    """

    processor: str
    trials: int
    rounds: int
    one_s: float
    two_s: float
    longest_s: float
    start_s: float
    filed_per_s: float

    @property
    def speedup(self) -> float:
        """Of two processes over one."""
        return self.one_s / self.two_s

    @property
    def trial_s(self) -> float:
        """Core time of one trial while the other cores are busy too, s."""
        return 2.0 * self.two_s / self.trials

    def wall_s(self, trials: int, cores: int) -> float:
        """How long so many trials take: the cores' work or the filing, whichever is slower, s."""
        return self.start_s + max(trials * self.trial_s / cores, trials / self.filed_per_s) + self.longest_s


def measure(trials: int, rounds: int) -> Scaling:
    """Take the figures; arguments as in `Scaling`, but `trials` of each scenario."""
    jobs = make_jobs(make_cases(SCENARIOS, ["star"]), trials, seed=1000)
    times: dict[int, list[float]] = {1: [], 2: []}
    start = time.perf_counter()
    with local_processes(1) as one:
        one.submit(run_job, jobs[0]).result()
        first = time.perf_counter() - start
        start_s = first - timed_round(one, jobs[:1])[0]
        with local_processes(2) as two:
            timed_round(two, jobs[:4])  # both are up and have compiled
            longest = 0.0
            for _ in range(rounds):
                for count, executor in ((1, one), (2, two)):
                    seconds, records = timed_round(executor, jobs)
                    times[count].append(seconds)
                    longest = max(longest, *(record["wall_s"] for record in records))
    return Scaling(
        processor_name(), len(jobs), rounds, statistics.median(times[1]), statistics.median(times[2]), longest,
        start_s, filing_rate(5000),
    )  # fmt: skip


def timed_round(executor: Executor, jobs: Sequence[Job]) -> tuple[float, list[Record]]:
    """How long the trials take, s, and their records."""
    start = time.perf_counter()
    records = list(executor.map(run_job, jobs))
    return time.perf_counter() - start, records


def filing_rate(count: int) -> float:
    """Trials per second that go to a cluster, come back at once and are filed, 1/s."""
    cases = make_cases(SCENARIOS[:1], ["star"])
    jobs = make_jobs(cases, count, seed=0)
    kept = workers_module.run_job
    workers_module.run_job = at_once
    try:
        with (
            tempfile.TemporaryDirectory() as folder,
            dask_pool("local", 2) as pool,
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
    """A record as large as a real one, without a trial."""
    step = {"count": 900, "mean_s": 2.123456789e-05, "p50_s": 2.123456789e-05, "p99_s": 5.123456789e-05}
    return {
        "trial": job.trial, "scenario": job.case.scenario, "method": job.case.method, "seed": job.seed,
        "outcome": "reached", "path": PATH, **dict.fromkeys(("command", "scan", "fit", "plan"), step),
    }  # fmt: skip


def section(scaling: Scaling) -> str:
    """What docs/scaling.md says of the figures."""
    rows = []
    for cores in CORES:
        wall = scaling.wall_s(WANTED, cores)
        limit = "filing" if WANTED / scaling.filed_per_s > WANTED * scaling.trial_s / cores else "the trials"
        rows.append((f"{cores:,}", duration(wall), f"{WANTED * scaling.trial_s / 3600.0:.0f}", limit))
    return f"""Measured by `{COMMAND}` on {scaling.processor}, {scaling.rounds} rounds of {scaling.trials} trials
({", ".join(SCENARIOS)}, method `star`):

{
        markdown_table(
            ("figure", "value"),
            (
                ("core time of a trial", f"{scaling.trial_s:.2f} s"),
                ("longest trial", f"{scaling.longest_s:.1f} s"),
                ("two processes over one", f"{scaling.speedup:.2f} times as many trials"),
                ("start of a worker", f"{scaling.start_s:.1f} s"),
                ("handed out through Dask and filed by one process", f"{scaling.filed_per_s:.0f} trials/s"),
            ),
        )
    }

{WANTED:,} trials cost:

{markdown_table(("cores", "time", "core hours", "limited by"), rows)}"""


def duration(seconds: float) -> str:
    """A time in the unit that suits it."""
    if seconds < 600.0:
        return f"{seconds:.0f} s"
    return f"{seconds / 60.0:.0f} min" if seconds < 7200.0 else f"{seconds / 3600.0:.1f} h"


def main(arguments: Sequence[str] | None = None) -> int:
    """Measure the scaling; see `--help`. Returns the exit code."""
    parser = argparse.ArgumentParser(prog="scaling", description=(__doc__ or "").partition("\n\n")[2])
    parser.add_argument("--trials", type=int, default=8, help="of each scenario in a round (default: 8)")
    parser.add_argument("--rounds", type=int, default=3, help="of one and of two processes (default: 3)")
    options = parser.parse_args(arguments)
    return exit_code(parser.prog, lambda: write_page(options))


def write_page(options: argparse.Namespace) -> int:
    """Measure, and write the figures and the page; returns the exit code."""
    for name in ("trials", "rounds"):
        if getattr(options, name) < 1:
            raise StarnavError(f"--{name} is {getattr(options, name)}; allowed: a whole number >= 1")
    scaling = measure(options.trials, options.rounds)
    FIGURES.write_text(json.dumps(asdict(scaling), indent=2) + "\n", encoding="utf-8")
    PAGE.write_text(page(scaling), encoding="utf-8")
    print(section(scaling))
    return 0


def page(scaling: Scaling) -> str:
    """The text of docs/scaling.md, with its section brought up to date."""
    return with_section(PAGE.read_text(encoding="utf-8"), "figures", COMMAND, section(scaling))


if __name__ == "__main__":
    sys.exit(main())
