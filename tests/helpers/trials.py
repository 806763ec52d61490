"""Results for the tests of reports, made up except for their worlds; and trials that run in this process."""

import random
from concurrent.futures import Executor, Future
from contextlib import nullcontext

from drake_starnav.evaluation import workers
from drake_starnav.evaluation.jobs import derive_trial_seed, make_cases
from drake_starnav.evaluation.report.results import Results, make_results
from drake_starnav.evaluation.trial_file import make_header

STEP = {"count": 10, "mean_s": 2e-5, "p50_s": 2e-5, "p99_s": 5e-5}


class AtOnce(Executor):
    """Runs each call at once, in this process."""

    def submit(self, function, /, *args, **kwargs) -> Future:
        """Return a future that has the result."""
        future: Future = Future()
        future.set_result(function(*args, **kwargs))
        return future


def run_trials_here(monkeypatch) -> None:
    """Run the trials of batches in this process instead of starting others."""
    monkeypatch.setattr(workers, "start_local_processes", lambda count: nullcontext(AtOnce()))


def record(scenario: str = "forest", method: str = "star", trial: int = 0, outcome: str = "reached", **fields) -> dict:
    """A record with every field that a trial has."""
    return {
        "trial": trial, "scenario": scenario, "method": method, "seed": derive_trial_seed(5, trial), "outcome": outcome,
        "time_s": 20.0, "path_length_m": 14.0, "shortest_path_m": 13.0, "straight_line_m": 12.0,
        "tightest_gap_m": 0.9, "min_clearance_m": 0.02, "mean_speed_mps": 0.7, "nodes": 9, "wall_s": 1.0,
        "score": None, "state_hash": "0", "command": STEP, "scan": STEP, "plan": STEP,
        "path": [[0.5, 0.0], [6.0, 0.3], [12.0, 0.0]], **fields,
    }  # fmt: skip


def made_up(scenarios=("forest", "room"), methods=("star", "star_paper"), trials: int = 12, **fields) -> Results:
    """Results of several cases in which the later methods fare worse, the same for the same arguments."""
    chance = random.Random(0)
    records = []
    for scenario in scenarios:
        for trial in range(trials):
            gap, straight = chance.uniform(0.6, 2.0), chance.uniform(10.0, 13.0)
            for k, method in enumerate(methods):
                outcome = "collision" if chance.random() < 0.15 * k / gap else "reached"
                way = 13.0 + k * chance.random()
                bow = chance.uniform(-1.0, 1.0)
                driven = {"time_s": way / 0.7, "path_length_m": way, "path": [[0.5, 0.0], [6.0, bow], [11.0, 0.0]]}
                given = {"tightest_gap_m": gap, "straight_line_m": straight}
                records.append(record(scenario, method, trial, outcome, **driven, **given, **fields))
    header = make_header(
        make_cases(scenarios, ["star"]), 5, command=f"starnav benchmark {' '.join(scenarios)} --json a.jsonl"
    )
    header["cases"] = [{**case, "method": method} for case in header["cases"] for method in methods]
    return make_results([header], records)
