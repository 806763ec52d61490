"""What each part of the method is worth: python scripts/experiments/ablate.py --trials 20 --out out/ablation"""

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
from drake_starnav.evaluation import compare, wilson_interval
from drake_starnav.evaluation.ablation import ABLATIONS, REFERENCE
from drake_starnav.evaluation.report.figures import new_figure
from drake_starnav.evaluation.summary import markdown_table, number, rate_text
from drake_starnav.utils.files import write_text

STYLES = (("#0072B2", "o"), ("#D55E00", "s"), ("#009E73", "^"), ("#CC79A7", "D"), ("#E69F00", "v"))
"""Colour and marker of each scenario: the palette of Okabe and Ito, told apart by shape as well."""
BY_NAME = {row.name: row for row in ABLATIONS}


def main(arguments: Sequence[str] | None = None) -> int:
    """Run the table; see `--help`. Returns the exit code."""
    parser = experiment_parser(
        "ablate.py", "Measure what each part of the method is worth.", ["forest", "maze", "room"], Path("out/ablation")
    )
    add_rows(parser, BY_NAME)
    return experiment(parser, ablate, arguments)


def ablate(options: argparse.Namespace) -> Results:
    """Run the rows, one file of trials each, then write table and plot."""
    table, picture = options.out / "ablation.md", options.out / "ablation.png"
    check_rows(options, BY_NAME)
    new_figure(1.0)  # tells whether there is a matplotlib before anything runs
    rows = [row for row in ABLATIONS if row.name in options.rows or row is REFERENCE]
    results, scenarios = run_variants(
        {row.name: (row.method, row.overrides) for row in rows}, options, [table, picture]
    )
    text = ablation_table(results, scenarios)
    write_text(table, text + "\n")
    draw(results, scenarios, picture)
    if not options.quiet:
        print(text)
        print(f"wrote {table}, {picture} and a file of trials for each row")
    return results


def ablation_table(results: Results, scenarios: list[str]) -> str:
    """A Markdown table with a row for each ablation; times are compared on trials that both reached."""
    reference = results[REFERENCE.name]
    rows = []
    for name, records in results.items():
        cells = [name, BY_NAME[name].meaning]
        for scenario in scenarios:
            trials = of_scenario(records, scenario)
            cells += [
                rate_text(count(trials, "reached"), len(trials)),
                str(count(trials, "collision")),
                number(compare(trials, reference).time_ratio, 2),
            ]
        rows.append((*cells, BY_NAME[name].reference))
    head = ["variant", "meaning"]
    for scenario in scenarios:
        head += [f"{scenario}: reached (95 %)", "collisions", f"time / {REFERENCE.name}"]
    return markdown_table((*head, "described in"), rows)


def draw(results: Results, scenarios: list[str], path: Path) -> None:
    """Success with its 95 % interval, collisions and time ratio of each row, in three panels.

    Raises:
        StarnavError: matplotlib is not installed.
    """
    figure = new_figure(1.6 + 0.42 * len(results), 12.0)
    success, collisions, ratio = figure.subplots(1, 3, sharey=True, width_ratios=(2, 1, 1.4))
    offsets = [0.22 * (k - (len(scenarios) - 1) / 2) for k in range(len(scenarios))]
    for k, scenario in enumerate(scenarios):
        colour, marker = STYLES[k % len(STYLES)]
        style = {"color": colour, "marker": marker, "linestyle": "none", "markersize": 5, "label": scenario}
        for y, records in enumerate(results.values()):
            trials = of_scenario(records, scenario)
            reached = count(trials, "reached")
            low, high = wilson_interval(reached, len(trials))
            success.plot([100 * low, 100 * high], [y + offsets[k]] * 2, color=colour, linewidth=1.2)
            success.plot(100 * reached / len(trials), y + offsets[k], **style)
            collisions.plot(100 * count(trials, "collision") / len(trials), y + offsets[k], **style)
            time_ratio = compare(trials, results[REFERENCE.name]).time_ratio
            if time_ratio is not None:
                ratio.plot(time_ratio, y + offsets[k], **style)
    success.set_yticks(range(len(results)), [BY_NAME[name].meaning for name in results])
    success.invert_yaxis()
    success.set_xlim(-3.0, 103.0)
    success.set_xlabel("reached, % (95 % interval)")
    collisions.set_xlim(-1.0, max(5.0, collisions.get_xlim()[1]))
    collisions.set_xlabel("collided, %")
    ratio.set_xlabel(f"time / {REFERENCE.name}, both reached")
    ratio.axvline(1.0, color="0.6", linewidth=0.8)
    for axes in (success, collisions, ratio):
        axes.grid(axis="x", color="0.9")
        axes.spines[["top", "right"]].set_visible(False)
    handles, labels = success.get_legend_handles_labels()
    unique = dict(zip(labels, handles, strict=True))
    figure.legend(unique.values(), unique.keys(), loc="outside upper center", ncols=len(unique), frameon=False)
    figure.savefig(path, dpi=130)


if __name__ == "__main__":
    sys.exit(main())
