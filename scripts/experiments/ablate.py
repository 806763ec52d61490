"""Measure what each part of the method contributes.

Run: python scripts/experiments/ablate.py --trials 20 --out out/ablation
"""

import argparse
import sys
from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import Any

from drake_starnav.evaluation.summary import format_markdown_table
from scripts.experiments import replacements
from scripts.experiments.experiment import (
    Results,
    comparison_cells,
    comparison_head,
    experiment,
    experiment_parser,
    run_experiment,
)
from scripts.experiments.replacements import replacing_pool

REFERENCE = "star"
"""The default method, with which all rows are compared."""
FOLLOWING = "drake_starnav.control.path_following"
PLANNER, ROUTE = "drake_starnav.planning.planner", "drake_starnav.planning.route"
CUBIC = "drake_starnav.surroundings.piecewise_cubic"
INTERPRETED = {
    f"{FOLLOWING}._follow_guidance": replacements.interpreted_followed,
    f"{FOLLOWING}.guiding_vector": replacements.interpreted_guiding_vector,
}
UNTURNED = {f"{FOLLOWING}.find_free_heading": replacements.same_direction}
UNCERTIFIED = {
    **INTERPRETED,
    **UNTURNED,
    "drake_starnav.systems.twist_shield.shield_twist": replacements.uncertified_twist,
}
ABLATIONS: dict[str, Mapping[str, Any]] = {
    REFERENCE: {},
    "no_erosion": {"drake_starnav.surroundings.erosion.compute_disc_range": replacements.shortened_range},
    "two_sided_fit": {f"{CUBIC}.fit_adaptively": replacements.two_sided_fit},
    "fixed_segments": {f"{CUBIC}.fit_adaptively": replacements.equal_segments},
    "free_unknown": {"drake_starnav.planning.cost_field.UNKNOWN_COST": 0.0},
    "no_shift": {f"{ROUTE}.find_frontier_point": replacements.nothing},
    "no_string_pulling": {
        f"{ROUTE}.pull_string": replacements.first_argument,
        f"{PLANNER}.drop_passed_points": replacements.along_cells,
    },
    "no_anticipation": {"drake_starnav.planning.state.look_ahead": replacements.nothing},
    "no_replanning": {f"{PLANNER}.discard_blocked_path": replacements.first_argument},
    "no_closures": {f"{PLANNER}.close_path": replacements.first_argument},
    "no_reopening": {f"{PLANNER}.reopen_closures": replacements.first_argument},
    "no_doubt": {f"{ROUTE}.compute_clearance_uncertainty": replacements.zero},
    "paper_modulation": {**INTERPRETED, f"{FOLLOWING}.modulate_direction": replacements.paper_direction},
    "no_free_heading": {**INTERPRETED, **UNTURNED},
    "no_certificate": UNCERTIFIED,
    "one_scan": {"drake_starnav.surroundings.recent_hits.RECENT_SCANS": 1},
    "no_protection": {**UNCERTIFIED, f"{FOLLOWING}.modulate_direction": replacements.same_direction},
    "star_paper": {},
}
"""By row, in the order of docs/method.md, which says what each goes without: what takes the place of functions and
constants, by dotted name; see `replacements`. The last row is a method of its own."""


def main(arguments: Sequence[str] | None = None) -> int:
    """Run the table; see `--help`. Returns the exit code."""
    parser = experiment_parser(
        "ablate.py", "Measure what each part of the method is worth.", ["forest", "maze", "room"], Path("out/ablation")
    )
    parser.add_argument("--rows", nargs="+", default=list(ABLATIONS), choices=list(ABLATIONS), metavar="ROW")
    return experiment(parser, ablate, arguments)


def ablate(options: argparse.Namespace) -> Results:
    """Run the rows, one file of trials each, then write the table."""
    rows = [name for name in ABLATIONS if name in options.rows or name == REFERENCE]
    variants = {name: (name if name == "star_paper" else REFERENCE, ()) for name in rows}
    return run_experiment(
        variants, options, "ablation.md", ablation_table, lambda pool, name: replacing_pool(pool, ABLATIONS[name])
    )


def ablation_table(results: Results, scenarios: Sequence[str]) -> str:
    """A Markdown table with a row for each ablation; times are compared on trials that both reached."""
    rows = [(name, *comparison_cells(records, results[REFERENCE], scenarios)) for name, records in results.items()]
    return format_markdown_table(("without", *comparison_head(scenarios, REFERENCE)), rows)


if __name__ == "__main__":
    sys.exit(main())
