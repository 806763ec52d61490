"""Summarise many trials by the figures that compare methods, with their intervals, as tables."""

import re
from collections import Counter
from collections.abc import Callable, Sequence
from dataclasses import dataclass
from typing import NamedTuple

import numpy as np

from drake_starnav.errors import one_line
from drake_starnav.evaluation.jobs import Record

OUTCOMES = ("collision", "timeout", "unreachable", "error")
"""Ways in which a trial may fail, in the order of the tables' columns."""
UNSUPPORTED = "unsupported"
"""The outcome of a method that does not support the trial's world; neither a success nor a failure."""


def compute_wilson_interval(successes: int, trials: int) -> tuple[float, float]:
    """The 95 % Wilson score interval of a rate, valid for few trials and for rates of 0 and 1; (0, 1) of 0 trials.

    Source: E. B. Wilson, Probable inference, the law of succession, and statistical inference, 1927.
    """
    from scipy.stats import binomtest  # late: it takes half the time that a command needs to start

    if trials == 0:
        return 0.0, 1.0
    interval = binomtest(successes, trials).proportion_ci(method="wilson")
    return float(interval.low), float(interval.high)


class Median(NamedTuple):
    """A median and its 95 % confidence interval; the ends are NaN where the sample is too small for one."""

    value: float
    low: float
    high: float


def compute_median_interval(values: Sequence[float]) -> Median:
    """Return the median of n >= 1 values with its exact interval, which has no ends for n < 6.

    The ends are values of the sample, by the sign test. The interval holds its level for every distribution, whatever
    its outliers, which no interval of a mean does: a few values say nothing about rare large ones.

    Source: W. J. Conover, Practical nonparametric statistics, 1999, 3.2.
    """
    from scipy.stats import quantile_test  # late, as above

    interval = quantile_test(values, q=0.0, p=0.5).confidence_interval(0.95)
    return Median(float(np.median(values)), float(interval.low), float(interval.high))


@dataclass(frozen=True)
class Summary:
    """The figures of one case; None where no trial has the data.

    Attributes:
        trials: all but the unsupported ones; a trial that could not be run counts as not reached.
        reached: how many reached the goal.
        interval: 95 % confidence interval of the success rate.
        failures: number of trials by outcome, of `OUTCOMES` and any other such as `UNSUPPORTED`.
        path_mean, path_median, path_p95: path over the omniscient shortest one, where the goal was reached.
        time_s: mean time where the goal was reached.
        speed_mps: total path over total time where the goal was reached.
        score: mean if a benchmark scored any of the trials; trials that could not be run count as 0.
        clearance_m: the minimum over all trials.
        command_p50_s, command_p99_s, scan_p50_s, plan_p50_s: median over the trials of the percentile in each.
        wall_ratio: wall-clock time over simulated time.
    """

    scenario: str
    method: str
    trials: int
    reached: int
    interval: tuple[float, float]
    failures: dict[str, int]
    path_mean: float | None
    path_median: float | None
    path_p95: float | None
    time_s: float | None
    speed_mps: float | None
    score: float | None
    clearance_m: float | None
    command_p50_s: float | None
    command_p99_s: float | None
    scan_p50_s: float | None
    plan_p50_s: float | None
    wall_ratio: float | None


def split_by_robot(records: Sequence[Record]) -> list[Record]:
    """The records, each followed by those of its robots, if it is of several: their scenario is SCENARIO/ROBOT."""
    return [
        each
        for record in records
        for each in (record, *({**r, "scenario": f"{r['scenario']}/{r['robot']}"} for r in record.get("robots", ())))
    ]


def group_by_case(records: Sequence[Record]) -> dict[tuple[str, str], list[Record]]:
    """The records of each scenario and method, in the order in which they first appear."""
    case_records: dict[tuple[str, str], list[Record]] = {}
    for record in records:
        case_records.setdefault((record["scenario"], record["method"]), []).append(record)
    return case_records


def summarize_records(records: Sequence[Record]) -> list[Summary]:
    """A summary for each scenario and method, in the order in which they first appear."""
    return [_summarize_trials(*names, case) for names, case in group_by_case(records).items()]


def _summarize_trials(scenario: str, method: str, records: list[Record]) -> Summary:
    run_records = [record for record in records if "time_s" in record]
    reached_records = [record for record in run_records if record["outcome"] == "reached"]
    path_ratios = [r["path_length_m"] / r["shortest_path_m"] for r in reached_records if r["shortest_path_m"]]
    clearances = [r["min_clearance_m"] for r in run_records if r["min_clearance_m"] is not None]
    scores = [r["score"] for r in run_records if r.get("score") is not None]
    outcome_counts = Counter(record["outcome"] for record in records)
    outcome_counts.pop("reached", None)
    trial_count = len(records) - outcome_counts[UNSUPPORTED]

    def median(step: str, figure: str) -> float | None:
        return _compute_figure(np.median, [r[step][figure] for r in run_records if r[step]["count"]])

    return Summary(
        scenario=scenario,
        method=method,
        trials=trial_count,
        reached=len(reached_records),
        interval=compute_wilson_interval(len(reached_records), trial_count),
        failures={name: outcome_counts[name] for name in dict.fromkeys((*OUTCOMES, *sorted(outcome_counts)))},
        path_mean=_compute_figure(np.mean, path_ratios),
        path_median=_compute_figure(np.median, path_ratios),
        path_p95=_compute_figure(lambda values: np.percentile(values, 95), path_ratios),
        time_s=_compute_figure(np.mean, [r["time_s"] for r in reached_records]),
        speed_mps=_compute_total_ratio(reached_records, "path_length_m", "time_s"),
        score=sum(scores) / trial_count if scores else None,
        clearance_m=_compute_figure(np.min, clearances),
        command_p50_s=median("command", "p50_s"),
        command_p99_s=median("command", "p99_s"),
        scan_p50_s=median("scan", "p50_s"),
        plan_p50_s=median("plan", "p50_s"),
        wall_ratio=_compute_total_ratio(run_records, "wall_s", "time_s"),
    )


@dataclass(frozen=True)
class PairedRatio:
    """A figure of one method over that of another, on the same trials.

    Attributes:
        mean: of the trials' ratios, as the paper's TTR and PLR.
        median: of them, with its interval.
        of_sums: ratio of the figures' sums, in which long trials weigh more.
    """

    mean: float
    median: Median
    of_sums: float


@dataclass(frozen=True)
class Comparison:
    """One method against another, on the same trials.

    Attributes:
        trials: number of trials in which both reached the goal; times and paths are compared on these.
        time, path: ratios of the times and the path lengths; None if there is no such trial.
        reached_alone, other_reached_alone: number of trials in which only one of the methods reached the goal.
        success_p_value: of the exact McNemar test that both reach the goal equally often; 1 without such trials.
    """

    trials: int
    time: PairedRatio | None
    path: PairedRatio | None
    reached_alone: int
    other_reached_alone: int
    success_p_value: float

    @property
    def time_ratio(self) -> float | None:
        """Mean of the ratios of times, the paper's TTR as a fraction; None if there is no trial."""
        return None if self.time is None else self.time.mean

    @property
    def path_ratio(self) -> float | None:
        """Mean of the ratios of path lengths, the paper's PLR as a fraction; None if there is no trial."""
        return None if self.path is None else self.path.mean


def compare_trials(records: Sequence[Record], reference: Sequence[Record]) -> Comparison:
    """Compare two sets of trials with the same batch seed; trials are paired by scenario and number."""
    from scipy.stats import binomtest  # late, as above

    own_records, other_records = (
        {(r["scenario"], r["trial"]): r for r in side if r["outcome"] != UNSUPPORTED} for side in (records, reference)
    )
    record_pairs = [(own_records[key], other_records[key]) for key in own_records if key in other_records]
    reached_pairs = [pair for pair in record_pairs if all(r["outcome"] == "reached" for r in pair)]
    first, second = (sum(pair[k]["outcome"] == "reached" for pair in record_pairs) - len(reached_pairs) for k in (0, 1))
    return Comparison(
        len(reached_pairs),
        _compare_pairs(reached_pairs, "time_s"),
        _compare_pairs(reached_pairs, "path_length_m"),
        first,
        second,
        float(binomtest(first, first + second).pvalue) if first + second else 1.0,
    )


def _compare_pairs(pairs: Sequence[tuple[Record, Record]], field: str) -> PairedRatio | None:
    pair_ratios = [one[field] / other[field] for one, other in pairs if other[field] > 0.0]
    if not pair_ratios:
        return None
    of_sums = sum(one[field] for one, _ in pairs) / sum(other[field] for _, other in pairs)
    return PairedRatio(float(np.mean(pair_ratios)), compute_median_interval(pair_ratios), of_sums)


def _compute_figure(function: Callable[[list[float]], float], values: list[float]) -> float | None:
    return float(function(values)) if values else None


def _compute_total_ratio(records: Sequence[Record], numerator: str, denominator: str) -> float | None:
    denominator_sum = sum(record[denominator] for record in records)
    return sum(record[numerator] for record in records) / denominator_sum if denominator_sum > 0.0 else None


Table = tuple[Sequence[str], Sequence[Sequence[str]]]
"""Head and rows."""


def make_outcome_table(summaries: Sequence[Summary]) -> Table:
    """Outcomes of the trials."""
    other_outcomes = sorted({name for s in summaries for name in s.failures} - set(OUTCOMES))
    rows = [
        (
            s.scenario, s.method, str(s.trials), str(s.reached), format_rate(s.reached, s.trials),
            *(str(s.failures.get(name, 0)) for name in (*OUTCOMES, *other_outcomes)),
        )
        for s in summaries
    ]  # fmt: skip
    return ("scenario", "method", "trials", "reached", "success (95 % interval)", *OUTCOMES, *other_outcomes), rows


def make_cost_table(summaries: Sequence[Summary]) -> Table:
    """Path length, time and clearance on the way to the goal, and computation times; scores if there are any."""
    table_rows = [
        (
            s.scenario, s.method,
            format_number(s.path_mean, 3), format_number(s.path_median, 3), format_number(s.path_p95, 2),
            format_number(s.time_s, 1), format_number(s.speed_mps, 3), format_number(s.score, 4),
            format_number(s.clearance_m, 1, 1e3),
            f"{format_number(s.command_p50_s, 0, 1e6)} / {format_number(s.command_p99_s, 0, 1e6)}",
            format_number(s.scan_p50_s, 0, 1e6), format_number(s.plan_p50_s, 0, 1e6), format_number(s.wall_ratio, 3),
        )
        for s in summaries
    ]  # fmt: skip
    column_names = (
        "scenario", "method", "path/shortest", "median", "p95", "time s", "speed m/s", "score",
        "clearance mm", "command us p50 / p99", "scan us", "plan us", "wall/simulated",
    )  # fmt: skip
    if any(s.score is not None for s in summaries):
        return column_names, table_rows
    return (*column_names[:7], *column_names[8:]), [(*row[:7], *row[8:]) for row in table_rows]


def format_rate(successes: int, trials: int) -> str:
    """A success rate with its 95 % interval, in per cent."""
    if trials == 0:
        return "-"
    interval_start, interval_end = compute_wilson_interval(successes, trials)
    return f"{100 * successes / trials:.1f} % ({100 * interval_start:.1f} to {100 * interval_end:.1f})"


def format_number(value: float | None, digits: int, scale: float = 1.0) -> str:
    """A number in a table; a dash for None."""
    return "-" if value is None else f"{value * scale:.{digits}f}"


def escape_markdown(text: str) -> str:
    """A text in one line, escaped so that Markdown shows it literally, also inside a table cell."""
    text = one_line(" ".join(text.split())).replace("&", "&amp;").replace("<", "&lt;").replace(">", "&gt;")
    return re.sub(r"([\\|`*\[\]~$]|(?<!\w)_|_(?!\w))", r"\\\1", text)


def format_markdown_table(head: Sequence[str], rows: Sequence[Sequence[str]]) -> str:
    """A Markdown table with padded columns, readable as plain text."""
    escaped_cells = [[escape_markdown(cell) for cell in row] for row in (head, *rows)]
    column_widths = [max(map(len, column)) for column in zip(*escaped_cells, strict=True)]
    table_lines = [[cell.ljust(width) for cell, width in zip(row, column_widths, strict=True)] for row in escaped_cells]
    table_lines.insert(1, ["-" * width for width in column_widths])
    return "\n".join(f"| {' | '.join(line)} |" for line in table_lines)
