"""Measure what each part of the method contributes.

Run: python scripts/experiments/ablate.py --trials 20 --out out/ablation
"""

import argparse
import io
import sys
from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path

from drake_starnav.cli.experiment import (
    Results,
    add_rows,
    check_rows,
    comparison_cells,
    comparison_head,
    count,
    experiment,
    experiment_parser,
    of_scenario,
    run_experiment,
)
from drake_starnav.evaluation import compare, wilson_interval
from drake_starnav.evaluation.report.figures import COLORS, MARKERS, new_figure
from drake_starnav.evaluation.summary import markdown_table


@dataclass(frozen=True)
class Ablation:
    """One row of the table.

    Attributes:
        name: also the name of its file of trials.
        meaning: difference from the full method, in a few words.
        overrides: "section.key=value" texts that define the variant.
        reference: section of the paper (arXiv 2403.11484) or of docs/method.md that describes the part.
        method: see `drake_starnav.scenario.METHODS`.
    """

    name: str
    meaning: str
    overrides: tuple[str, ...]
    reference: str
    method: str = "star"


REFERENCE = Ablation("star", "the full method", (), "paper III; method 1 to 9")
"""The reference for all rows."""

ABLATIONS = (
    REFERENCE,
    Ablation("no_certificate", "no braking certificate", ("controller.certificate=false",), "method 9"),
    Ablation(
        "no_protection",
        "no certificate, modulation and near-wall term",
        ("controller.certificate=false", "controller.modulation=false", "controller.near_wall_term=false"),
        "paper III-C.3; method 7, 9",
    ),
    Ablation("no_erosion", "ranges less the radius instead of eroded ones", ("planner.erosion=radial",), "method 1"),
    Ablation("two_sided_fit", "cubics through the samples, not inside", ("planner.one_sided_fit=false",), "method 2"),
    Ablation(
        "fixed_segments",
        "16 equal segments",
        ("planner.segmentation=fixed", "planner.segments=16"),
        "paper III-B.1, fig. 5; method 2",
    ),
    Ablation("dbscan_frontiers", "the paper's frontiers", ("planner.frontiers=dbscan",), "paper III-B.2; method 4"),
    Ablation("no_virtual_frontiers", "targets are frontiers only", ("planner.virtual_frontiers=false",), "method 6"),
    Ablation("no_blacklist", "dead ends are not remembered", ("planner.blacklist=false",), "method 4"),
    Ablation(
        "straight_cost_to_go",
        "frontiers ranked by the straight line to the goal",
        ("planner.cost_to_go=straight",),
        "paper III-C.2; method 6",
    ),
    Ablation("no_string_pulling", "the path runs over the nodes", ("planner.string_pulling=false",), "method 6"),
    Ablation("no_anticipation", "each frontier is driven to first", ("planner.anticipation=false",), "method 6"),
    Ablation("no_replanning", "a blocked path does not trigger planning", ("planner.replanning=false",), "method 6"),
    Ablation("no_inspection", "dead ends are judged from afar", ("planner.inspection_detour=20",), "method 6"),
    Ablation("any_bend", "no limit to the turn by modulation", ("controller.max_bend=3.2",), "method 7"),
    Ablation("clipped_weights", "regions weighted by min(Gamma, 8)", ("controller.weights=clipped",), "method 7"),
    Ablation(
        "paper_weights",
        "the paper's sum: by max(Gamma, 1), of vectors as long as they are",
        ("controller.weights=paper",),
        "paper III-C.3; method 7",
    ),
    Ablation("wide_near_wall_zone", "near-wall zone of 0.10 m", ("controller.near_wall_zone=0.10",), "method 7"),
    Ablation(
        "no_free_heading",
        "straight on where the certificate refuses it",
        ("controller.free_heading_range=0",),
        "method 9",
    ),
    Ablation("one_scan", "safety star from the last scan only", ("controller.scan_memory=1",), "method 9"),
    Ablation("noisy_lidar", "range noise of 3 cm", ("lidar.noise=0.03",), "method, what each part is worth"),
    Ablation("star_paper", "the paper's configuration", (), "paper III, IV; method, star_paper", "star_paper"),
    Ablation(
        "star_paper_fast",
        "the paper's, but driven at 0.8 m/s",
        ("controller.tracking=law",),
        "paper III; method 8",
        "star_paper",
    ),
    Ablation(
        "star_paper_slow",
        "the paper's, but driven at 0.4 m/s",
        ("controller.tracking=law", "robot.max_speed=0.4"),
        "paper III; method 8",
        "star_paper",
    ),
)
"""All rows. The paper's PID settles at 0.33 m/s whatever the limit, hence the last two rows."""

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
    check_rows(options, BY_NAME)
    new_figure(1.0)  # raises before any trial runs if matplotlib is missing
    rows = [row for row in ABLATIONS if row.name in options.rows or row is REFERENCE]
    variants = {row.name: (row.method, row.overrides) for row in rows}
    return run_experiment(variants, options, {"ablation.md": ablation_table, "ablation.png": ablation_plot})


def ablation_table(results: Results, scenarios: Sequence[str]) -> str:
    """A Markdown table with a row for each ablation; times are compared on trials that both reached."""
    rows = []
    for name, records in results.items():
        cells = comparison_cells(records, results[REFERENCE.name], scenarios)
        rows.append((name, BY_NAME[name].meaning, *cells, BY_NAME[name].reference))
    head = ("variant", "meaning", *comparison_head(scenarios, REFERENCE.name), "described in")
    return markdown_table(head, rows)


def ablation_plot(results: Results, scenarios: Sequence[str]) -> bytes:
    """Success with its 95 % interval, collisions and time ratio of each row, in three panels, as PNG.

    Raises:
        StarnavError: matplotlib is not installed.
    """
    figure = new_figure(1.6 + 0.42 * len(results), 12.0)
    success, collisions, ratio = figure.subplots(1, 3, sharey=True, width_ratios=(2, 1, 1.4))
    offsets = [0.22 * (k - (len(scenarios) - 1) / 2) for k in range(len(scenarios))]
    for k, scenario in enumerate(scenarios):
        colour, marker = COLORS[k % len(COLORS)], MARKERS[k % len(MARKERS)]
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
    file = io.BytesIO()
    figure.savefig(file, dpi=130, format="png")
    return file.getvalue()


if __name__ == "__main__":
    sys.exit(main())
