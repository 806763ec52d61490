"""Drive different robots with different lidars through the same kinds of worlds; nothing but these two is declared.

Run: python scripts/experiments/robots_and_lidars.py --trials 7 --out out/robots_and_lidars
"""

import argparse
import sys
from collections.abc import Sequence
from pathlib import Path

from drake_starnav.evaluation.summary import markdown_table, number, rate_text
from drake_starnav.scenario import load_scenario
from drake_starnav.scenario.error_budget import error_budget
from scripts.experiments.experiment import Results, count, experiment, experiment_parser, of_scenario, run_experiment

ROBOT, LIDAR = ("model", "radius", "max_speed", "max_acceleration"), ("beams", "range_max", "rate", "noise")
DECLARED = (
    ("starbot", 0.15, 0.4, 1.0, 90, 3.5, 5.0, 0.01),
    ("starbot", 0.15, 3.0, 3.0, 720, 30.0, 40.0, 0.03),
    ("starbot", 0.2, 0.8, 1.0, 180, 5.0, 10.0, 0.02),
    ("starbot", 0.25, 0.4, 1.0, 180, 10.0, 5.0, 0.03),
    ("starbot", 0.25, 1.5, 2.0, 360, 10.0, 20.0, 0.01),
    ("starbot", 0.25, 3.0, 3.0, 720, 30.0, 40.0, 0.001),
    ("starbot", 0.35, 0.8, 1.0, 360, 3.5, 10.0, 0.02),
    ("jackal", 0.334, 0.8, 1.0, 180, 30.0, 20.0, 0.001),
    ("jackal", 0.334, 1.5, 2.0, 720, 10.0, 40.0, 0.03),
    ("jackal", 0.5, 1.5, 2.0, 360, 30.0, 20.0, 0.001),
)  # fmt: skip
"""Robots and their lidars: the values of ROBOT and LIDAR."""


def main(arguments: Sequence[str] | None = None) -> int:
    """Run the combinations; see `--help`. Returns the exit code."""
    parser = experiment_parser(
        "robots_and_lidars.py",
        "Drive different robots with different lidars.",
        ["forest", "maze", "room"],
        Path("out/robots_and_lidars"),
    )
    return experiment(parser, measure, arguments)


def measure(options: argparse.Namespace) -> Results:
    """Run the trials, one file for each combination, then write the table."""
    keys = [*(f"robot.{key}" for key in ROBOT), *(f"lidar.{key}" for key in LIDAR)]
    variants = {
        " ".join(map(str, values)): ("star", [f"{key}={value}" for key, value in zip(keys, values, strict=True)])
        for values in DECLARED
    }
    margins = {
        name: error_budget(load_scenario(options.scenario[0], overrides=overrides)).total
        for name, (_, overrides) in variants.items()
    }
    return run_experiment(
        variants, options, {"robots_and_lidars.md": lambda results, scenarios: table(results, scenarios, margins)}
    )


def table(results: Results, scenarios: Sequence[str], margins: dict[str, float]) -> str:
    """A Markdown table with a row for each combination."""
    rows = []
    for name, records in results.items():
        reached = [record for record in records if record["outcome"] == "reached"]
        least = min((record["min_clearance_m"] for record in reached), default=None)
        speeds = [
            f"{sum(r['mean_speed_mps'] for r in trials) / len(trials):.2f}" if trials else "-"
            for trials in (of_scenario(reached, scenario) for scenario in scenarios)
        ]
        rows.append(
            (
                *name.split(" "),
                f"{1e3 * margins[name]:.0f}",
                rate_text(len(reached), len(records)),
                str(count(records, "collision")),
                number(least, 0, 1e3),
                *speeds,
            )
        )
    head = ("model", "radius m", "max_speed m/s", "max_acceleration", "beams", "range m", "rate Hz", "noise m")
    return markdown_table(
        (*head, "margin mm", "reached (95 %)", "collisions", "least clearance mm", *(f"{s}: m/s" for s in scenarios)),
        rows,
    )


if __name__ == "__main__":
    sys.exit(main())
