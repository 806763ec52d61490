"""The tables of a report, as Markdown, as CSV, or as cells for a page."""

import csv
import io
import math
from collections.abc import Mapping, Sequence
from dataclasses import asdict
from typing import Any

import numpy as np

from drake_starnav.evaluation.jobs import Record
from drake_starnav.evaluation.report.results import Results
from drake_starnav.evaluation.suites import SUITES, make_suite_table
from drake_starnav.evaluation.summary import (
    PairedRatio,
    Table,
    compare_trials,
    escape_markdown,
    format_markdown_table,
    format_number,
    make_cost_table,
    make_outcome_table,
    split_by_robot,
    summarize_records,
)

TABLED_FIELDS = (
    "trial", "world", "seed", "time_s", "path_length_m", "shortest_path_m", "min_clearance_m", "mean_speed_mps",
    "nodes", "wall_s", "score", "straight_line_m", "tightest_gap_m",
)  # fmt: skip
"""Numbers of a record that other tables show, or whose mean has no meaning."""
UNITS = {
    "m": "m", "s": "s", "rad": "rad", "mps": "m/s", "mps2": "m/s²", "mps3": "m/s³", "m2ps": "m²/s", "radps": "rad/s",
    "radps2": "rad/s²",
}  # fmt: skip
"""Suffixes of a record's fields and the units they stand for."""


def list_further_figures(records: Sequence[Record]) -> list[str]:
    """Names of all other numbers in the records, in their order."""
    names = (name for record in records for name, value in record.items() if _is_number(value))
    return [name for name in dict.fromkeys(names) if name not in TABLED_FIELDS]


def make_suite_tables(results: Results) -> list[tuple[str, Table]]:
    """Title and cells of the table of each suite that the trials belong to."""
    suites = [SUITES[name] for name in results.suites if name in SUITES]
    return [(suite.meaning, make_suite_table(suite, results.records, results.given_references)) for suite in suites]


def make_result_tables(results: Results) -> list[tuple[str, Table]]:
    """Title and cells of each other table; the first one shows the outcomes, also of each of several robots."""
    summaries = summarize_records(split_by_robot(results.records))
    tables = [
        ("How the trials ended", make_outcome_table(summaries)),
        ("Paths, times and clearances", make_cost_table(summaries)),
    ]
    further = list_further_figures(results.records)
    if further:
        tables.append(
            ("Further figures, means over the trials that reached the goal", _make_further_table(results, further))
        )
    for reference in results.references if len(results.methods) > 1 else ():
        title = f"Compared with {reference}, times and paths on the trials that both reached"
        tables.append((title, make_comparison_table(results, reference)))
    return tables


def format_tables_markdown(results: Results) -> str:
    """The tables with their titles."""
    tables = make_suite_tables(results) + make_result_tables(results)
    return "\n\n".join(f"**{escape_markdown(title)}**\n\n{format_markdown_table(*table)}" for title, table in tables)


def format_summary_csv(results: Results) -> str:
    """One line for each scenario, each of its robots, and each method, with every figure at full precision."""
    summary_rows = []
    further = list_further_figures(results.records)
    summaries = summarize_records(split_by_robot(results.records))
    failures = dict.fromkeys(name for summary in summaries for name in summary.failures)
    for summary in summaries:
        summary_row: dict[str, Any] = {}
        for name, value in asdict(summary).items():
            summary_row |= {name: value.get(name, 0) for name in failures} if isinstance(value, dict) else {name: value}
        summary_row["success_low"], summary_row["success_high"] = summary_row.pop("interval")
        case = results.of(summary.scenario, summary.method)
        summary_row |= {name: compute_mean(case, name) for name in further if name not in summary_row}
        for reference in results.references:
            summary_row |= _list_comparison_figures(case, results.of(summary.scenario, reference), reference)
        summary_rows.append(summary_row)
    return format_csv(summary_rows)


def format_csv(rows: Sequence[Mapping[str, Any]]) -> str:
    """Rows as CSV, with a column for each name that any of them has; a value that is missing or NaN is empty."""
    column_names = list(dict.fromkeys(name for row in rows for name in row))
    csv_text = io.StringIO()
    writer = csv.writer(csv_text, lineterminator="\n", quoting=csv.QUOTE_NONNUMERIC)
    writer.writerow(column_names)
    known_rows = ({name: value for name, value in row.items() if value == value} for row in rows)  # NaN is not itself
    writer.writerows([row.get(name, "") for name in column_names] for row in known_rows)
    return csv_text.getvalue()


def _list_comparison_figures(case: Sequence[Record], others: Sequence[Record], reference: str) -> dict[str, Any]:
    """The figures of a comparison as columns of the CSV."""
    comparison = compare_trials(case, others)
    figures: dict[str, Any] = {"both_reached": comparison.trials}
    for name, ratio in (("time", comparison.time), ("path", comparison.path)):
        if ratio is not None:
            median_ratio, interval_start, interval_end = ratio.median
            figures |= {f"{name}_ratio_mean": ratio.mean, f"{name}_ratio_median": median_ratio}
            figures |= {f"{name}_ratio_median_low": interval_start, f"{name}_ratio_median_high": interval_end}
            figures[f"{name}_ratio_of_sums"] = ratio.of_sums
    figures |= {"reached_alone": comparison.reached_alone, "other_reached_alone": comparison.other_reached_alone}
    figures["success_p_value"] = comparison.success_p_value
    return {f"{name}_to_{reference}": figure for name, figure in figures.items()}


def compute_mean(records: Sequence[Record], name: str) -> float | None:
    """The mean of a figure over the trials that have it and reached the goal."""
    values = [r[name] for r in records if r["outcome"] == "reached" and _is_number(r.get(name))]
    return float(np.mean(values)) if values else None


def _is_number(value: Any) -> bool:
    return type(value) in (int, float)


def make_label(name: str) -> str:
    """A record's field in words: `min_clearance_m` -> "min clearance, m"."""
    words, _, unit = name.rpartition("_")
    return f"{words.replace('_', ' ')}, {UNITS[unit]}" if words and unit in UNITS else name.replace("_", " ")


def _make_further_table(results: Results, names: Sequence[str]) -> Table:
    rows = [
        (*pair, *(format_number(compute_mean(case, name), 3) for name in names)) for pair, case in results.cases.items()
    ]
    return ("scenario", "method", *map(make_label, names)), rows


def make_comparison_table(results: Results, reference: str) -> Table:
    """Each method against the reference: ratios in per cent, and the paired test of success."""
    rows = []
    for (scenario, method), case in results.cases.items():
        if method != reference:
            pair = compare_trials(case, results.of(scenario, reference))
            ratios = (cell for ratio in (pair.time, pair.path) for cell in format_ratio_cells(ratio))
            reached_alone = f"{pair.reached_alone} / {pair.other_reached_alone}"
            rows.append(
                (scenario, method, str(pair.trials), *ratios, reached_alone, format_number(pair.success_p_value, 4))
            )
    columns = [
        f"{name}, %: {kind}" for name in ("time", "path") for kind in ("mean of ratios", "median", "ratio of sums")
    ]
    return ("scenario", "method", "both reached", *columns, "only it / only the other reached", "p (McNemar)"), rows


def format_ratio_cells(ratio: PairedRatio | None) -> tuple[str, str, str]:
    """Mean, median with its 95 % interval if there is one, and ratio of sums, in per cent."""
    if ratio is None:
        return "-", "-", "-"
    median_ratio, low, high = ratio.median
    interval_text = "" if math.isnan(low) else f" ({format_number(low, 1, 100.0)} to {format_number(high, 1, 100.0)})"
    return (
        format_number(ratio.mean, 1, 100.0),
        format_number(median_ratio, 1, 100.0) + interval_text,
        format_number(ratio.of_sums, 1, 100.0),
    )
