"""Show that a change keeps the behaviour: python scripts/maintenance/trial_hashes.py --check out/hashes.json

Runs a fixed list of trials and compares the hash of each one's plant states with a file that `--write` left before the
change, on the same machine.
"""

import argparse
import json
import sys
from collections.abc import Iterator, Sequence
from concurrent.futures import ProcessPoolExecutor
from multiprocessing import get_context
from pathlib import Path
from typing import NamedTuple

from drake_starnav import load_scenario, run_trial

RECORDS = Path(__file__).resolve().parents[2] / "benchmarks" / "results" / "star.jsonl"
RECORDED, FEW = 20, 5
"""Trials of each recorded scenario, and of each other one."""
FAULTS = (
    ("lidar.noise=0.03",),
    ("localization.drift=0.02",),
    ("drive.delay=0.1",),
    ("drive.slip=0.1",),
    ("lidar.outliers=0.02",),
)
METHODS = ("star_paper", "dsm", "foa", "foa_cluster", "foa_roadmap", "dwa")


class Run(NamedTuple):
    """One trial."""

    scenario: str
    seed: int
    method: str = "star"
    overrides: tuple[str, ...] = ()

    def name(self) -> str:
        """Its key in the file of hashes."""
        return " ".join((self.scenario, self.method, str(self.seed), *self.overrides))


def runs() -> Iterator[Run]:
    """The list of trials."""
    with RECORDS.open(encoding="utf-8") as file:
        records = [json.loads(line) for line in list(file)[1:]]
    for scenario in ("forest", "maze", "room"):
        seeds = [record["seed"] for record in records if record["scenario"] == scenario]
        yield from (Run(scenario, seed) for seed in seeds[:RECORDED])
    for number in range(FEW):
        yield Run("barn", number, overrides=(f"world.id={number}",))
        yield Run("crowd_room", number)
        yield Run("forest", number, overrides=FAULTS[number])
    yield from (Run("forest", number, method) for number, method in enumerate(METHODS))


def state_hash(run: Run) -> str:
    """Outcome and hash of a trial."""
    scenario = load_scenario(run.scenario, method=run.method, overrides=run.overrides)
    trial = run_trial(scenario, method=run.method, seed=run.seed)
    return f"{trial.outcome} {trial.state_hash}"


def main(arguments: Sequence[str] | None = None) -> int:
    """Run the trials; see `--help`. Returns 1 where a hash differs from the file's."""
    parser = argparse.ArgumentParser(description="Compare the state hashes of a fixed list of trials.")
    parser.add_argument("--jobs", type=int, default=1, metavar="N", help="number of processes (default: 1)")
    goal = parser.add_mutually_exclusive_group(required=True)
    goal.add_argument("--write", type=Path, metavar="FILE", help="write the hashes to a JSON file")
    goal.add_argument("--check", type=Path, metavar="FILE", help="compare with such a file")
    options = parser.parse_args(arguments)
    expected = {} if options.check is None else json.loads(options.check.read_text(encoding="utf-8"))
    listed, found = list(runs()), {}
    with ProcessPoolExecutor(options.jobs, mp_context=get_context("spawn")) as executor:
        for run, value in zip(listed, executor.map(state_hash, listed), strict=True):
            found[run.name()] = value
            changed = options.check is not None and expected.get(run.name()) != value
            remark = f"  was {expected.get(run.name(), 'not in the file')}" if changed else ""
            print(f"{run.name()}: {value}{remark}", flush=True)
    if options.write is not None:
        options.write.write_text(json.dumps(found, indent=1) + "\n", encoding="utf-8")
        return 0
    differing = sum(expected.get(name) != value for name, value in found.items())
    print(f"{differing} of {len(found)} trials differ")
    return 1 if differing else 0


if __name__ == "__main__":
    sys.exit(main())
