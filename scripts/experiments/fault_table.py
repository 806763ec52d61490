"""Measure the cost of faults in sensing and drive.

Run: python scripts/experiments/fault_table.py --trials 50 --out out/faults

scripts/maintenance/write_tables.py writes the table of what benchmarks/results/faults holds into docs/faults.md.
"""

import argparse
import sys
from collections.abc import Sequence
from pathlib import Path

from drake_starnav.evaluation.summary import compare_trials, format_markdown_table, format_number
from drake_starnav.evaluation.trial_file import read_trials
from scripts.experiments.experiment import (
    Results,
    count,
    experiment,
    experiment_parser,
    of_scenario,
    run_experiment,
)

LEVELS = {
    "lidar.noise": (0.02, 0.03, 0.05),
    "lidar.dropout": (0.1, 0.2, 0.4),
    "lidar.outliers": (0.01, 0.02, 0.05),
    "lidar.delay": (0.05, 0.1, 0.2),
    "lidar.scan_loss": (0.1, 0.3, 0.5),
    "localization.drift": (0.01, 0.02, 0.05),
    "localization.jump": (0.05, 0.1, 0.2),
    "drive.delay": (0.02, 0.05, 0.1),
    "drive.slip": (0.02, 0.05, 0.1),
    "robot.mass_error": (-0.2, 0.2, 0.5),
}
"""Three levels of each single fault."""
TOGETHER = (
    "lidar.noise=0.02",
    "lidar.dropout=0.1",
    "lidar.outliers=0.01",
    "lidar.delay=0.05",
    "lidar.scan_loss=0.05",
    "localization.drift=0.01",
    "drive.delay=0.02",
    "drive.slip=0.02",
    "robot.mass_error=0.1",
)
"""All faults together, at a moderate level."""
ROWS: dict[str, tuple[str, ...]] = {
    "none": (),
    **{f"{key}_{level:g}": (f"{key}={level:g}",) for key, row in LEVELS.items() for level in row},
    "all_moderate": TOGETHER,
}
"""The overrides of each row; the first row is the reference."""
Row = tuple[str, ...]


def main(arguments: Sequence[str] | None = None) -> int:
    """Run the table; see `--help`. Returns the exit code."""
    parser = experiment_parser(
        "fault_table.py", "Measure what faults cost.", ["forest", "maze", "room"], Path("out/faults")
    )
    parser.add_argument("--rows", nargs="+", default=list(ROWS), choices=list(ROWS), metavar="ROW")
    return experiment(parser, measure_faults, arguments)


def measure_faults(options: argparse.Namespace) -> Results:
    """Run the rows, one file of trials each, then write the table."""
    variants = {name: ("star", row) for name, row in ROWS.items() if name in options.rows or not row}
    return run_experiment(variants, options, "faults.md", fault_table)


def fault_table(results: Results, scenarios: Sequence[str]) -> str:
    """Return the table as Markdown."""
    return format_markdown_table(*head_and_rows(results, scenarios))


def head_and_rows(results: Results, scenarios: Sequence[str]) -> tuple[Row, list[Row]]:
    """Return the table's head, and a row for each fault; times are over the first row's, where both reached."""
    head = ("declared", "reached", "collisions", f"time / none: {', '.join(scenarios)}", "least clearance, mm")
    rows: list[Row] = []
    for name, records in results.items():
        clearances = [r["min_clearance_m"] for r in records if r.get("min_clearance_m") is not None]
        pairs = [(of_scenario(records, each), of_scenario(results["none"], each)) for each in scenarios]
        times = ", ".join(format_number(compare_trials(*pair).time_ratio, 2) for pair in pairs)
        reached = f"{count(records, 'reached')} of {len(records)}"
        least = format_number(min(clearances, default=None), 0, 1e3)
        declared = ROWS[name][0] if len(ROWS[name]) == 1 else name
        rows.append((declared, reached, str(count(records, "collision")), times, least))
    return head, rows


def stored_table(folder: Path) -> tuple[Row, list[Row]]:
    """Return head and rows of the table of the trials that a folder holds."""
    files = {name: read_trials(folder / f"{name}.jsonl") for name in ROWS}
    scenarios = list(dict.fromkeys(case["scenario"] for case in files["none"][0]["cases"]))
    return head_and_rows({name: records for name, (_, records) in files.items()}, scenarios)


if __name__ == "__main__":
    sys.exit(main())
