"""CPU time of whole trials, per simulated second, and beside another version of the code.

Run in the checkout: python -m benchmarks.whole [--against REF] [--trials 5] [--scenario forest maze room]

With a git reference, its code is checked out beside this one and both drive the same trials in turn, each in a process
of its own, so that both see the same load of the machine. The time begins when the simulator has started, and ends
with the last whole second of the trial; `trial` is all of it, from making the world to the metrics.
"""

import argparse
import contextlib
import json
import os
import subprocess
import sys
import tempfile
import time
from collections.abc import Callable, Iterator
from functools import partial
from pathlib import Path
from typing import TypeVar

ROOT = Path(__file__).resolve().parents[1]
FIRST_SEED = 1000
Found = TypeVar("Found")


class Driver:
    """A process that drives trials with the code of one folder."""

    def __init__(self, folder: Path) -> None:
        environment = os.environ | {"PYTHONPATH": str(folder), "OMP_NUM_THREADS": "1"}
        self._process = subprocess.Popen(
            [sys.executable, "-P", __file__, "--work"],
            cwd=folder,
            env=environment,
            stdin=subprocess.PIPE,
            stdout=subprocess.PIPE,
            text=True,
        )

    def drive(self, scenario: str, seed: int) -> dict[str, float]:
        """Milliseconds of CPU per simulated second (`ms`), seconds of the trial's (`trial`), and what it simulated."""
        assert self._process.stdin is not None and self._process.stdout is not None
        print(scenario, seed, file=self._process.stdin, flush=True)
        line = self._process.stdout.readline()
        if not line:
            raise SystemExit(f"a worker died on {scenario} seed {seed}")
        return json.loads(line)

    def close(self) -> None:
        """End the process."""
        self._process.communicate()


def timed(run: Callable[..., Found]) -> tuple[Found, float, float]:
    """What a run that takes `progress` returns; its CPU time per simulated second, ms, and of all of it, s."""
    marks: list[tuple[float, float]] = []
    begin = time.process_time()
    found = run(progress=lambda now, limit: marks.append((now, time.process_time())))
    total = time.process_time() - begin
    (first, start), (last, end) = marks[0], marks[-1]
    return found, (end - start) / max(last - first, 1e-9) * 1e3, total


def work() -> None:
    """Drive the trials that come in by standard input; only what every version has is used."""
    from drake_starnav import load_scenario, run_trial

    answers, sys.stdout = sys.stdout, sys.stderr
    for line in sys.stdin:
        scenario, seed = line.split()
        trial, ms, total = timed(partial(run_trial, load_scenario(scenario), seed=int(seed)))
        found = {"ms": ms, "trial": total, "time": trial.time_s, "reached": trial.outcome == "reached"}
        print(json.dumps(found), file=answers, flush=True)


@contextlib.contextmanager
def checked_out(reference: str) -> Iterator[Path]:
    """A folder with the code of a git reference, which is removed afterwards."""
    with tempfile.TemporaryDirectory() as folder:
        path = Path(folder) / "code"
        subprocess.run(["git", "worktree", "add", "--quiet", "--detach", path, reference], cwd=ROOT, check=True)
        try:
            yield path
        finally:
            subprocess.run(["git", "worktree", "remove", "--force", path], cwd=ROOT, check=True)


def compare(folders: dict[str, Path], scenarios: list[str], trials: int) -> None:
    """Print a line per scenario and version, each with its ratio to the first version."""
    drivers = {name: Driver(folder) for name, folder in folders.items()}
    for scenario in scenarios:
        found: dict[str, list[dict[str, float]]] = {name: [] for name in drivers}
        for k in range(-trials, trials):
            for name in list(drivers)[:: 1 - 2 * (k % 2)]:
                row = drivers[name].drive(scenario, FIRST_SEED + k % trials)
                found[name] += [row] * (k >= 0)  # before, what it takes is compiled
        base: dict[str, float] = {}
        for name, rows in found.items():
            simulated = sum(row["time"] for row in rows)
            ms = sum(row["ms"] * row["time"] for row in rows) / simulated
            seconds = sum(row["trial"] for row in rows) / trials
            base = base or {"ms": ms, "trial": seconds}
            reached = sum(bool(row["reached"]) for row in rows)
            print(
                f"{scenario:8s} {name:10s} {ms:6.1f} ms per simulated second ({ms / base['ms']:.3f}), a trial "
                f"{seconds:5.2f} s ({seconds / base['trial']:.3f}), {reached} of {trials} reached",
                flush=True,
            )
    for driver in drivers.values():
        driver.close()


def main() -> None:
    """Measure; see `--help`."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--against", metavar="REF", help="git reference of the code to compare with")
    parser.add_argument("--trials", type=int, default=5)
    parser.add_argument("--scenario", nargs="+", default=["forest", "maze", "room"])
    parser.add_argument("--work", action="store_true", help=argparse.SUPPRESS)
    options = parser.parse_args()
    if options.work:
        work()
    elif options.against is None:
        compare({"this": ROOT}, options.scenario, options.trials)
    else:
        with checked_out(options.against) as folder:
            compare({options.against: folder, "this": ROOT}, options.scenario, options.trials)


if __name__ == "__main__":
    main()
