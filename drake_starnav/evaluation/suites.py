"""Named sets of trials, and the published figures for comparison."""

from collections.abc import Sequence
from dataclasses import dataclass, field

from drake_starnav.errors import shown
from drake_starnav.evaluation.jobs import Record
from drake_starnav.evaluation.summary import Table, compare, number, rate_text, summarise
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


_FOREST = {
    "star": Published(100.0, 100.0, 90.0, 3.98),
    "star_paper": Published(100.0, 100.0, 90.0, 3.98),
    "dsm": Published(89.8, 102.14, 73.3),
    "foa": Published(99.6, 109.9, 20.7),
    "foa_roadmap": Published(137.0, 108.6, 40.0),
}
_MAZE = {
    "star": Published(100.0, 100.0, 83.3, 4.37),
    "star_paper": Published(100.0, 100.0, 83.3, 4.37),
    "foa_roadmap": Published(115.8, 94.9, 80.0),
}
SUITES: dict[str, Suite] = {
    "table1": Suite(
        meaning="Table I of arXiv 2403.11484: all methods in forests and mazes",
        scenarios=("forest", "maze", "paper_forest"),
        methods=("star", "star_paper", "dsm", "foa", "foa_cluster", "foa_roadmap", "dwa"),
        references=("star", "star_paper"),
        published={
            (scenario, method): row
            for scenario, rows in (("forest", _FOREST), ("paper_forest", _FOREST), ("maze", _MAZE))
            for method, row in rows.items()
        },
    ),
}
"""The paper's own method stands beside both of ours, and its forest beside both of ours."""


def find_suite(name: str) -> Suite:
    """A suite by name; raises a `StarnavError` with the nearest name for an unknown one."""
    if name not in SUITES:
        raise unknown_name(f"suite {shown(name)}", name, SUITES)
    return SUITES[name]


def suite_table(suite: Suite, records: Sequence[Record], references: Sequence[str] = ()) -> Table:
    """A row for each scenario, method and reference, with each measured figure beside the published one.

    The references are the suite's unless others are given.
    """
    by_case: dict[tuple[str, str], list[Record]] = {}
    for record in records:
        by_case.setdefault((record["scenario"], record["method"]), []).append(record)
    rows = []
    for summary in summarise(records):
        case = (summary.scenario, summary.method)
        paper = suite.published.get(case, Published())
        for reference in references or suite.references:
            pair = compare(by_case[case], by_case.get((summary.scenario, reference), []))
            rows.append(
                (
                    *case, reference,
                    number(pair.time_ratio, 1, 100.0), number(paper.time_percent, 1),
                    number(pair.path_ratio, 1, 100.0), number(paper.path_percent, 1), str(pair.trials),
                    rate_text(summary.reached, summary.trials), number(paper.success_percent, 1),
                    number(summary.command_p50_s, 3, 1e3), number(paper.command_ms, 2),
                )
            )  # fmt: skip
    head = (
        "scenario", "method", "compared with", "TTR %", "published", "PLR %", "published", "of trials",
        "SR (95 % interval)", "published %", "command ms", "published",
    )  # fmt: skip
    return head, rows
