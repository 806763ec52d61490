"""The tables of a report, as Markdown, as CSV, or as cells for a page."""

import csv
import io
from collections.abc import Sequence
from dataclasses import asdict
from typing import Any

import numpy as np

from drake_starnav.evaluation.jobs import Record
from drake_starnav.evaluation.report.results import Results
from drake_starnav.evaluation.suites import SUITES, suite_table
from drake_starnav.evaluation.summary import (
    Table,
    by_robot,
    compare,
    cost_table,
    markdown_table,
    markdown_text,
    number,
    outcome_table,
    summarise,
)

TABLED = (
    "trial", "world", "seed", "time_s", "path_length_m", "shortest_path_m", "min_clearance_m", "mean_speed_mps",
    "nodes", "wall_s", "score", "straight_line_m", "tightest_gap_m",
)  # fmt: skip
"""Numbers of a record that other tables show, or whose mean has no meaning."""
UNITS = {
    "m": "m", "s": "s", "rad": "rad", "mps": "m/s", "mps2": "m/s²", "mps3": "m/s³", "m2ps": "m²/s", "radps": "rad/s",
    "radps2": "rad/s²",
}  # fmt: skip
"""Suffixes of a record's fields and the units they stand for."""


def further_figures(records: Sequence[Record]) -> list[str]:
    """Names of all other numbers in the records, in their order."""
    names = (name for record in records for name, value in record.items() if _is_number(value))
    return [name for name in dict.fromkeys(names) if name not in TABLED]


def suite_tables(results: Results) -> list[tuple[str, Table]]:
    """Title and cells of the table of each suite that the trials belong to."""
    suites = [SUITES[name] for name in results.suites if name in SUITES]
    return [(suite.meaning, suite_table(suite, results.records)) for suite in suites]


def result_tables(results: Results) -> list[tuple[str, Table]]:
    """Title and cells of each other table; the first one shows the outcomes, also of each of several robots."""
    summaries = summarise(by_robot(results.records))
    tables = [
        ("How the trials ended", outcome_table(summaries)),
        ("Paths, times and clearances", cost_table(summaries)),
    ]
    further = further_figures(results.records)
    if further:
        tables.append(("Further figures, means over the trials that reached the goal", _further(results, further)))
    if len(results.methods) > 1:
        title = f"Compared with {results.methods[0]}, on the trials that both reached"
        tables.append((title, _comparison(results)))
    return tables


def tables_markdown(results: Results) -> str:
    """The tables with their titles."""
    tables = suite_tables(results) + result_tables(results)
    return "\n\n".join(f"**{markdown_text(title)}**\n\n{markdown_table(*table)}" for title, table in tables)


def summary_csv(results: Results) -> str:
    """One line for each scenario, each of its robots, and each method, with every figure at full precision."""
    rows = []
    further = further_figures(results.records)
    summaries = summarise(by_robot(results.records))
    failures = dict.fromkeys(name for summary in summaries for name in summary.failures)
    for summary in summaries:
        row: dict[str, Any] = {}
        for name, value in asdict(summary).items():
            row |= {name: value.get(name, 0) for name in failures} if isinstance(value, dict) else {name: value}
        row["success_low"], row["success_high"] = row.pop("interval")
        case = results.of(summary.scenario, summary.method)
        rows.append(row | {name: mean_of(case, name) for name in further if name not in row})
    names = list(dict.fromkeys(name for row in rows for name in row))
    text = io.StringIO()
    writer = csv.writer(text, lineterminator="\n", quoting=csv.QUOTE_NONNUMERIC)
    writer.writerow(names)
    writer.writerows([row.get(name, "") for name in names] for row in rows)
    return text.getvalue()


def mean_of(records: Sequence[Record], name: str) -> float | None:
    """The mean of a figure over the trials that have it and reached the goal."""
    values = [r[name] for r in records if r["outcome"] == "reached" and _is_number(r.get(name))]
    return float(np.mean(values)) if values else None


def _is_number(value: Any) -> bool:
    return type(value) in (int, float)


def label_of(name: str) -> str:
    """A record's field in words: `min_clearance_m` -> "min clearance, m"."""
    words, _, unit = name.rpartition("_")
    return f"{words.replace('_', ' ')}, {UNITS[unit]}" if words and unit in UNITS else name.replace("_", " ")


def _further(results: Results, names: Sequence[str]) -> Table:
    rows = [(*pair, *(number(mean_of(case, name), 3) for name in names)) for pair, case in results.cases.items()]
    return ("scenario", "method", *map(label_of, names)), rows


def _comparison(results: Results) -> Table:
    rows = []
    for (scenario, method), case in results.cases.items():
        if method != results.methods[0]:
            result = compare(case, results.of(scenario, results.methods[0]))
            ratios = number(result.time_ratio, 1, 100.0), number(result.path_ratio, 1, 100.0)
            rows.append((scenario, method, str(result.trials), *ratios))
    return ("scenario", "method", "both reached", "time, %", "path length, %"), rows
