"""Measure what each part of the method contributes.

Run: python scripts/experiments/ablate.py --trials 20 --out out/ablation
"""

import argparse
import sys
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

from drake_starnav.evaluation.summary import markdown_table
from drake_starnav.evaluation.workers import Pool
from scripts.experiments import replacements
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


@dataclass(frozen=True)
class Ablation:
    """One row of the table: a part of the default method, left out or replaced.

    Attributes:
        name: also the name of its file of trials.
        paper: what the paper does (arXiv 2403.11484).
        star: what the default method does, which the row goes without.
        section: of docs/method.md.
        replaced: what takes the place of functions and constants, by dotted name; see `replacements`.
        method: see `drake_starnav.scenario.shipped.METHODS`.
    """

    name: str
    paper: str
    star: str
    section: str
    replaced: Mapping[str, Any] = field(default_factory=dict)
    method: str = "star"


REFERENCE = Ablation("star", "", "all below", "1 to 9")
"""The reference for all rows."""

FOLLOWING = "drake_starnav.control.path_following"
PLANNER, ROUTE = "drake_starnav.planning.planner", "drake_starnav.planning.route"
CUBIC = "drake_starnav.surroundings.piecewise_cubic"
INTERPRETED = {
    f"{FOLLOWING}._follow_guidance": replacements.interpreted_followed,
    f"{FOLLOWING}.guiding_vector": replacements.interpreted_guiding_vector,
}
UNCERTIFIED = {
    **INTERPRETED,
    "drake_starnav.systems.twist_shield.shield_twist": replacements.uncertified_twist,
    f"{FOLLOWING}.free_heading": replacements.same_direction,
}


ABLATIONS = (
    REFERENCE,
    Ablation(
        "no_erosion",
        "the hits bound the region; the radius enters with the nearest point",
        "each hit excludes a disc as wide as the robot; without it, ranges less the radius",
        "1",
        {"drake_starnav.surroundings.erosion.disc_range": replacements.shortened_range},
    ),
    Ablation(
        "two_sided_fit",
        "cubics through the samples",
        "cubics below all samples",
        "2",
        {f"{CUBIC}.fit_adaptively": replacements.two_sided_fit},
    ),
    Ablation(
        "fixed_segments",
        "segments by the slope",
        "segments by jump and error; without them, 16 equal ones",
        "2",
        {f"{CUBIC}.fit_adaptively": replacements.equal_segments},
    ),
    Ablation(
        "free_unknown",
        "straight lines from nodes to the goal",
        "an optimistic path, for which the unknown is dearer",
        "6",
        {"drake_starnav.planning.cost_field.UNKNOWN_COST": 0.0},
    ),
    Ablation(
        "no_shift",
        "frontier points in the middle of gaps",
        "where the path crosses the gap, shifted towards its middle",
        "6",
        {f"{ROUTE}.find_frontier_point": replacements.nothing},
    ),
    Ablation(
        "no_string_pulling",
        "from node to node",
        "the path is pulled tight within the regions",
        "6",
        {
            f"{ROUTE}.pull_string": replacements.first_argument,
            f"{PLANNER}.drop_passed_points": replacements.along_cells,
        },
    ),
    Ablation(
        "no_anticipation",
        "each short-term goal is driven to",
        "it is left as soon as the way beyond is seen",
        "6",
        {"drake_starnav.planning.state.look_ahead": replacements.nothing},
    ),
    Ablation(
        "no_replanning",
        "plans on arrival",
        "plans when a hit blocks the path ahead, too",
        "6",
        {f"{PLANNER}.discard_blocked_path": replacements.first_argument},
    ),
    Ablation(
        "no_closures",
        "frontier points become stuck",
        "ways that failed are closed",
        "6",
        {f"{PLANNER}.close_path": replacements.first_argument},
    ),
    Ablation(
        "no_reopening",
        "stuck for ever",
        "closures open again where no way is left",
        "6",
        {f"{PLANNER}.reopen_closures": replacements.first_argument},
    ),
    Ablation(
        "no_doubt",
        "a gap is open or it is not",
        "gaps that hits may only seem to close are looked at",
        "6",
        {f"{ROUTE}.clearance_uncertainty": replacements.zero},
    ),
    Ablation(
        "paper_modulation",
        "weights max(Gamma, 1), inward motion damped, too",
        "weights Gamma - 1, outward motion damped",
        "7",
        {**INTERPRETED, f"{FOLLOWING}.modulate_direction": replacements.paper_direction},
    ),
    Ablation(
        "no_free_heading",
        "-",
        "the vector turns to the nearest bearing that the certified star leaves",
        "9",
        {**INTERPRETED, f"{FOLLOWING}.free_heading": replacements.same_direction},
    ),
    Ablation("no_certificate", "nothing is certified", "only twists from which the robot can stop", "9", UNCERTIFIED),
    Ablation(
        "one_scan",
        "-",
        "the certified star remembers the last scans",
        "9",
        {"drake_starnav.surroundings.recent_hits.RECENT_SCANS": 1},
    ),
    Ablation(
        "no_protection",
        "modulation and nearest point",
        "certificate and modulation",
        "7, 9",
        {**UNCERTIFIED, f"{FOLLOWING}.modulate_direction": replacements.same_direction},
    ),
    Ablation("star_paper", "as printed", "all above", "1 to 9", method="star_paper"),
)
"""All rows, in the order of docs/method.md."""

BY_NAME = {row.name: row for row in ABLATIONS}


def main(arguments: Sequence[str] | None = None) -> int:
    """Run the table; see `--help`. Returns the exit code."""
    parser = experiment_parser(
        "ablate.py", "Measure what each part of the method is worth.", ["forest", "maze", "room"], Path("out/ablation")
    )
    add_rows(parser, BY_NAME)
    return experiment(parser, ablate, arguments)


def ablate(options: argparse.Namespace) -> Results:
    """Run the rows, one file of trials each, then write the table."""
    check_rows(options, BY_NAME)
    rows = [row for row in ABLATIONS if row.name in options.rows or row is REFERENCE]
    variants = {row.name: (row.method, ()) for row in rows}
    return run_experiment(variants, options, {"ablation.md": ablation_table}, pool_of=ablated_pool)


def ablated_pool(pool: Pool, name: str) -> Pool:
    """The pool in which the trials of a row run."""
    return replacements.replacing_pool(pool, BY_NAME[name].replaced)


def ablation_table(results: Results, scenarios: Sequence[str]) -> str:
    """A Markdown table with a row for each ablation; times are compared on trials that both reached."""
    rows = []
    for name, records in results.items():
        cells = comparison_cells(records, results[REFERENCE.name], scenarios)
        row = BY_NAME[name]
        rows.append((name, row.paper, row.star, row.section, *cells))
    head = ("without it", "the paper", "`star`", "section", *comparison_head(scenarios, REFERENCE.name))
    return markdown_table(head, rows)


if __name__ == "__main__":
    sys.exit(main())
