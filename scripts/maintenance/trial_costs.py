"""The cost of many trials, from the figures of benchmarks/scaling.py, as a section of docs/benchmark.md."""

import json
from dataclasses import dataclass
from pathlib import Path

from drake_starnav.evaluation.summary import markdown_table

COMMAND = "python -m benchmarks.scaling"
"""Measures the figures."""
WANTED = 100_000
"""The page states the cost of this many trials."""
CORES = (1, 100, 1000)


@dataclass(frozen=True)
class Costs:
    """The measured figures.

    Attributes:
        processor: its name.
        scenarios: of the trials.
        trials: in each round, over all scenarios.
        rounds: in which one and two processes took turns.
        one_s, two_s: median time of a round in one and in two processes, s.
        longest_s: the longest trial, s.
        start_s: from asking for a process until Drake is loaded there, s.
        filed_per_s: trials that one process can hand out and file, 1/s.
    """

    processor: str
    scenarios: list[str]
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
        """Time for a number of trials, limited by the cores or by the filing, s."""
        return self.start_s + max(trials * self.trial_s / cores, trials / self.filed_per_s) + self.longest_s


def read_costs(path: Path) -> Costs:
    """Read the figures from a file that `COMMAND` wrote."""
    return Costs(**json.loads(path.read_text(encoding="utf-8")))


def costs_section(costs: Costs) -> str:
    """The text of the section."""
    rows = []
    for cores in CORES:
        wall = costs.wall_s(WANTED, cores)
        limit = "filing" if WANTED / costs.filed_per_s > WANTED * costs.trial_s / cores else "the trials"
        rows.append((f"{cores:,}", duration(wall), f"{WANTED * costs.trial_s / 3600.0:.0f}", limit))
    return f"""Measured by `{COMMAND}` on {costs.processor}, {costs.rounds} rounds of {costs.trials} trials
({", ".join(costs.scenarios)}, method `star`):

{
        markdown_table(
            ("figure", "value"),
            (
                ("core time of a trial", f"{costs.trial_s:.2f} s"),
                ("longest trial", f"{costs.longest_s:.1f} s"),
                ("two processes over one", f"{costs.speedup:.2f} times as many trials"),
                ("start of a worker", f"{costs.start_s:.1f} s"),
                ("handed out through Dask and filed by one process", f"{costs.filed_per_s:.0f} trials/s"),
            ),
        )
    }

{WANTED:,} trials cost:

{markdown_table(("cores", "time", "core hours", "limited by"), rows)}"""


def duration(seconds: float) -> str:
    """A time in a suitable unit."""
    if seconds < 600.0:
        return f"{seconds:.0f} s"
    return f"{seconds / 60.0:.0f} min" if seconds < 7200.0 else f"{seconds / 3600.0:.1f} h"
