"""Named sets of trials, and the published figures for comparison."""

from collections.abc import Sequence
from dataclasses import dataclass, field

from drake_starnav.errors import shown
from drake_starnav.evaluation.jobs import Record
from drake_starnav.evaluation.summary import (
    Table,
    compare_trials,
    format_number,
    format_rate,
    group_by_case,
    summarize_records,
)
from drake_starnav.parameters import unknown_name


@dataclass(frozen=True)
class Published:
    """A row of a published table; None where it has no figure.

    Attributes:
        time_percent, path_percent: time and path length over the reference method's on trials that both finished, %.
        success_percent: of the trials, %.
        command_ms: mean time of a command.
    """

    time_percent: float | None = None
    path_percent: float | None = None
    success_percent: float | None = None
    command_ms: float | None = None


@dataclass(frozen=True)
class Suite:
    """A set of trials that `benchmark.py --suite` runs.

    Attributes:
        meaning: its purpose, in a few words.
        scenarios, methods: each scenario is run with each method.
        references: the methods that times and paths are compared with.
        published: figures by scenario and method.
    """

    meaning: str
    scenarios: tuple[str, ...]
    methods: tuple[str, ...]
    references: tuple[str, ...] = ("star",)
    published: dict[tuple[str, str], Published] = field(default_factory=dict)


_PUBLISHED = {
    "paper_forest": {
        "star": Published(100.0, 100.0, 90.0, 3.98),
        "star_paper": Published(100.0, 100.0, 90.0, 3.98),
        "dsm": Published(89.8, 102.14, 73.3),
        "foa": Published(99.6, 109.9, 20.7),
        "foa_roadmap": Published(137.0, 108.6, 40.0),
    },
    "paper_maze": {
        "star": Published(100.0, 100.0, 83.3, 4.37),
        "star_paper": Published(100.0, 100.0, 83.3, 4.37),
        "foa_roadmap": Published(115.8, 94.9, 80.0),
    },
}
"""The paper's own method stands beside both of ours."""
SUITES: dict[str, Suite] = {
    "table1": Suite(
        meaning="Table I of arXiv 2403.11484: all methods in the authors' forest and maze, at 0.4 m/s",
        scenarios=("paper_forest", "paper_maze"),
        methods=("star", "star_paper", "dsm", "foa", "foa_cluster", "foa_roadmap", "dwa", "grid_astar"),
        references=("star", "star_paper"),
        published={(scenario, method): row for scenario, rows in _PUBLISHED.items() for method, row in rows.items()},
    )
}


def find_suite(name: str) -> Suite:
    """A suite by name; raises a `StarnavError` with the nearest name for an unknown one."""
    if name not in SUITES:
        raise unknown_name(f"suite {shown(name)}", name, SUITES)
    return SUITES[name]


def make_suite_table(suite: Suite, records: Sequence[Record], references: Sequence[str] = ()) -> Table:
    """A row for each scenario and method, with the figures to each reference and the published ones.

    The references are the suite's unless others are given.
    """
    references, by_case, table_rows = references or suite.references, group_by_case(records), []
    for summary in summarize_records(records):
        case_names = (summary.scenario, summary.method)
        paper = suite.published.get(case_names, Published())
        failure_text = ", ".join(f"{count} {outcome}" for outcome, count in summary.failures.items() if count)
        pairs = [compare_trials(by_case[case_names], by_case.get((summary.scenario, name), [])) for name in references]
        table_rows.append(
            (
                *case_names,
                str(summary.trials), format_rate(summary.reached, summary.trials),
                format_number(paper.success_percent, 1), failure_text or "-",
                *(_format_ratio(pair.time_ratio, pair.trials) for pair in pairs), format_number(paper.time_percent, 1),
                *(_format_ratio(pair.path_ratio, pair.trials) for pair in pairs), format_number(paper.path_percent, 1),
                f"{format_number(summary.command_p50_s, 3, 1e3)} / {format_number(summary.command_p99_s, 3, 1e3)}",
                format_number(paper.command_ms, 2),
            )
        )  # fmt: skip
    time_columns, path_columns = ([f"{figure} % to {name}" for name in references] for figure in ("TTR", "PLR"))
    column_names = (
        "scenario", "method", "trials", "SR (95 % interval)", "published", "failed", *time_columns, "published",
        *path_columns, "published", "command ms p50 / p99", "published",
    )  # fmt: skip
    return column_names, table_rows


def _format_ratio(ratio: float | None, trials: int) -> str:
    """A mean of ratios in per cent, and of how many trials that both finished."""
    return "-" if ratio is None else f"{100.0 * ratio:.1f} ({trials})"
