"""Measure the cost of faults in sensing and drive.

Run: python scripts/experiments/fault_table.py --trials 50 --out out/faults
"""

import argparse
import sys
from collections.abc import Sequence
from pathlib import Path

from drake_starnav.evaluation.summary import markdown_table, number
from scripts.experiments.experiment import (
    Results,
    add_rows,
    check_rows,
    comparison_cells,
    comparison_head,
    experiment,
    experiment_parser,
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


def main(arguments: Sequence[str] | None = None) -> int:
    """Run the table; see `--help`. Returns the exit code."""
    parser = experiment_parser(
        "fault_table.py", "Measure what faults cost.", ["forest", "maze", "room"], Path("out/faults")
    )
    add_rows(parser, ROWS)
    return experiment(parser, measure_faults, arguments)


def measure_faults(options: argparse.Namespace) -> Results:
    """Run the rows, one file of trials each, then write the table."""
    check_rows(options, ROWS)
    variants = {name: ("star", row) for name, row in ROWS.items() if name in options.rows or not row}
    return run_experiment(variants, options, {"faults.md": fault_table})


def fault_table(results: Results, scenarios: Sequence[str]) -> str:
    """A Markdown table with a row for each fault; times are compared with the first row's, where both reached."""
    rows = []
    for name, records in results.items():
        clearances = [r["min_clearance_m"] for r in records if r.get("min_clearance_m") is not None]
        cells = comparison_cells(records, results["none"], scenarios)
        rows.append((", ".join(ROWS[name]) or name, *cells, number(min(clearances, default=None), 0, 1e3)))
    return markdown_table(("faults", *comparison_head(scenarios, "none"), "least clearance mm"), rows)


if __name__ == "__main__":
    sys.exit(main())
