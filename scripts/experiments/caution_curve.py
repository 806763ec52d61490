"""Measure the cost of caution among moving obstacles.

Run: python scripts/experiments/caution_curve.py --trials 20 --out out/caution
"""

import argparse
import sys
from collections.abc import Sequence
from pathlib import Path

from drake_starnav.cli.options import add_overrides
from drake_starnav.evaluation.report.figures import svg
from drake_starnav.evaluation.summary import markdown_table, number, rate_text
from drake_starnav.visualization.world_figure import new_figure
from scripts.experiments.experiment import Results, count, experiment, experiment_parser, of_scenario, run_experiment

CAUTIONS = (1.0, 0.75, 0.5, 0.25, 0.0)
BLIND = "obstacles.max_speed=0"
"""The method for static worlds, as reference."""
OUTCOMES = ("collision", "struck", "timeout", "unreachable")


def main(arguments: Sequence[str] | None = None) -> int:
    """Run the curve; see `--help`. Returns the exit code."""
    parser = experiment_parser(
        "caution_curve.py", "Measure what caution costs.", ["crowd_room", "crowd_hall"], Path("out/caution")
    )
    parser.add_argument(
        "--cautions", nargs="+", type=float, default=CAUTIONS, metavar="C", help="from 0 to 1 (default: five of them)"
    )
    add_overrides(parser)
    return experiment(parser, measure_curve, arguments)


def measure_curve(options: argparse.Namespace) -> Results:
    """Run the trials, one file for each caution, then write the table and draw the curve."""
    keys = (BLIND, *(f"obstacles.caution={caution:g}" for caution in options.cautions))
    variants = {key: ("star", (*options.overrides, key)) for key in keys}
    return run_experiment(variants, options, {"caution.md": curve_table, "caution.svg": curve_figure})


def curve_table(results: Results, scenarios: Sequence[str]) -> str:
    """A Markdown table with a row for each caution and scenario."""
    rows = []
    for scenario in scenarios:
        for key in results:
            trials = of_scenario(results[key], scenario)
            times = [record["time_s"] for record in trials if record["outcome"] == "reached"]
            counts = [str(count(trials, outcome)) for outcome in OUTCOMES]
            mean = number(sum(times) / len(times), 1) if times else "-"
            rows.append((scenario, key, rate_text(count(trials, "reached"), len(trials)), *counts, mean))
    return markdown_table(("scenario", "setting", "reached (95 %)", *OUTCOMES, "mean time s"), rows)


def curve_figure(results: Results, scenarios: Sequence[str]) -> str:
    """Shares of trials that reached the goal and that collided over the caution, as SVG."""
    figure = new_figure(3.0)
    axes = figure.subplots()
    cautions = {float(key.partition("=")[2]): key for key in results if key != BLIND}
    for scenario in scenarios:
        shares = {}
        for outcome in ("reached", "collision"):
            trials = [of_scenario(results[key], scenario) for key in cautions.values()]
            shares[outcome] = [100.0 * count(records, outcome) / len(records) for records in trials]
        (line,) = axes.plot(list(cautions), shares["reached"], "o-", label=f"{scenario}: reached")
        axes.plot(list(cautions), shares["collision"], "x--", color=line.get_color(), label=f"{scenario}: collision")
    axes.set(xlabel="obstacles.caution", ylabel="% of trials", ylim=(-2.0, 102.0))
    axes.legend(fontsize="small", loc="center")
    return svg(figure)


if __name__ == "__main__":
    sys.exit(main())
