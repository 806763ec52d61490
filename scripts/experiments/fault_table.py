"""What faults of sensing and drive cost: python scripts/experiments/fault_table.py --trials 50 --out out/faults"""

import argparse
import sys
from collections.abc import Sequence
from pathlib import Path

from drake_starnav.cli.experiment import (
    Results,
    add_rows,
    check_rows,
    count,
    experiment,
    experiment_parser,
    of_scenario,
    run_variants,
)
from drake_starnav.evaluation import compare
from drake_starnav.evaluation.summary import markdown_table, number, rate_text
from drake_starnav.utils.files import write_text

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
"""Each fault alone at three levels."""
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
"""All together, at a moderate level."""
ROWS: dict[str, tuple[str, ...]] = {
    "none": (),
    **{f"{key}_{level:g}": (f"{key}={level:g}",) for key, row in LEVELS.items() for level in row},
    "all_moderate": TOGETHER,
}
"""The overrides of each row; the first is what the others are compared with."""


def main(arguments: Sequence[str] | None = None) -> int:
    """Run the table; see `--help`. Returns the exit code."""
    parser = experiment_parser(
        "fault_table.py", "Measure what faults cost.", ["forest", "maze", "room"], Path("out/faults")
    )
    add_rows(parser, ROWS)
    return experiment(parser, measure_faults, arguments)


def measure_faults(options: argparse.Namespace) -> Results:
    """Run the rows, one file of trials each, then write the table."""
    table = options.out / "faults.md"
    check_rows(options, ROWS)
    chosen = {name: ("star", row) for name, row in ROWS.items() if name in options.rows or not row}
    results, scenarios = run_variants(chosen, options, [table])
    text = fault_table(results, scenarios)
    write_text(table, text + "\n")
    if not options.quiet:
        print(text)
        print(f"wrote {table} and a file of trials for each row")
    return results


def fault_table(results: Results, scenarios: Sequence[str]) -> str:
    """A Markdown table with a row for each fault; times are compared with the first row's, where both reached."""
    rows = []
    for name, records in results.items():
        cells = [", ".join(ROWS[name]) or name]
        for scenario in scenarios:
            trials = of_scenario(records, scenario)
            cells += [
                rate_text(count(trials, "reached"), len(trials)),
                str(count(trials, "collision")),
                number(compare(trials, of_scenario(results["none"], scenario)).time_ratio, 2),
            ]
        clearances = [r["min_clearance_m"] for r in records if r.get("min_clearance_m") is not None]
        rows.append((*cells, number(min(clearances, default=None), 0, 1e3)))
    head = ["faults"]
    for scenario in scenarios:
        head += [f"{scenario}: reached (95 %)", "collisions", "time / none"]
    return markdown_table((*head, "least clearance mm"), rows)


if __name__ == "__main__":
    sys.exit(main())
