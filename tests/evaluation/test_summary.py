"""Figures of many trials, against values computed by hand."""

import numpy as np
import pytest

from drake_starnav.evaluation.summary import (
    compare_trials,
    compute_median_interval,
    compute_wilson_interval,
    format_markdown_table,
    make_cost_table,
    make_outcome_table,
    split_by_robot,
    summarize_records,
)
from tests.helpers.trials import record as make_record


def tables_of(summaries) -> str:
    """The tables of outcomes and of costs, as Markdown."""
    return "\n\n".join(format_markdown_table(*table(summaries)) for table in (make_outcome_table, make_cost_table))


def record(trial: int, outcome: str = "reached", **fields) -> dict:
    """A record of a path of 6 m in 10 s, where 5 m were enough."""
    way = {"time_s": 10.0, "path_length_m": 6.0, "shortest_path_m": 5.0}
    return make_record(trial=trial, outcome=outcome, **(way | fields))


def test_summary_of_a_case() -> None:
    records = [
        record(0),
        record(1, path_length_m=9.0, time_s=20.0, wall_s=5.0, min_clearance_m=None),
        record(2, "collision", min_clearance_m=-0.01, path_length_m=1.0, time_s=2.0),
        record(3, "timeout", time_s=168.0),
        {"scenario": "forest", "method": "star", "trial": 4, "seed": 4, "outcome": "error", "message": "no world"},
    ]
    (summary,) = summarize_records(records)
    assert (summary.trials, summary.reached) == (5, 2)
    assert summary.interval == compute_wilson_interval(2, 5)
    assert summary.failures == {"collision": 1, "timeout": 1, "unreachable": 0, "error": 1}
    assert (summary.path_mean, summary.path_median) == (pytest.approx(1.5), pytest.approx(1.5))
    assert summary.path_p95 == pytest.approx(1.2 + 0.95 * 0.6)
    assert summary.time_s == pytest.approx(15.0)
    assert summary.speed_mps == pytest.approx(15.0 / 30.0)
    assert summary.clearance_m == -0.01
    assert (summary.command_p50_s, summary.command_p99_s) == (2e-5, 5e-5)
    assert summary.wall_ratio == pytest.approx(8.0 / 200.0)


def test_each_of_several_robots_has_a_row_below_that_of_all() -> None:
    robots = [record(0, robot="a", time_s=8.0), record(0, "timeout", robot="b"), record(1, robot="a", time_s=6.0)]
    trials = [record(0, "timeout", robots=robots[:2]), record(1, robots=[robots[2], record(1, robot="b")])]
    rows = summarize_records(split_by_robot([*trials, record(0, scenario="alone")]))
    assert [(row.scenario, row.trials, row.reached) for row in rows] == [
        ("forest", 2, 1), ("forest/a", 2, 2), ("forest/b", 2, 1), ("alone", 1, 1),
    ]  # fmt: skip
    assert rows[1].time_s == 7.0


def test_nothing_to_tell_is_a_dash() -> None:
    error = {"scenario": "maze", "method": "star", "trial": 0, "seed": 0, "outcome": "error", "message": "no world"}
    (summary,) = summarize_records([error])
    assert summary.path_mean is summary.time_s is summary.speed_mps is summary.wall_ratio is None
    tables = tables_of([summary])
    assert "0.0 % (0.0 to 79.3)" in tables
    assert tables.splitlines()[-1].count(" - ") >= 8


def test_score_is_the_mean_over_all_trials_of_a_benchmark() -> None:
    error = {"scenario": "forest", "method": "star", "trial": 2, "seed": 2, "outcome": "error", "message": "no world"}
    (summary,) = summarize_records(
        [record(0, score=0.5), record(1, "collision", score=0.0), error, record(3, score=0.25)]
    )
    assert summary.score == pytest.approx(0.75 / 4)
    assert "| score  |" in tables_of([summary])
    assert "0.1875" in tables_of([summary])
    (summary,) = summarize_records([record(0, score=None), record(1)])
    assert summary.score is None
    assert "score" not in tables_of([summary])


def test_unsupported_trials_are_counted_apart() -> None:
    unsupported = {"scenario": "forest", "method": "star", "trial": 1, "seed": 1, "outcome": "unsupported"}
    (summary,) = summarize_records([record(0), unsupported, record(2, "timeout")])
    assert (summary.trials, summary.reached) == (2, 1)
    assert summary.interval == compute_wilson_interval(1, 2)
    assert summary.failures["unsupported"] == 1
    (never,) = summarize_records([unsupported])
    assert (never.trials, never.interval) == (0, (0.0, 1.0))
    assert "| unsupported" in tables_of([summary, never])


def test_comparison_uses_trials_that_both_reached() -> None:
    ours = [record(0, time_s=30.0), record(1, "timeout", time_s=500.0), record(2), record(3)]
    reference = [record(0), record(1), record(2, "collision"), record(3, path_length_m=3.0)]
    result = compare_trials(ours, reference)
    assert result.trials == 2 and result.time is not None and result.path is not None
    assert (result.time.mean, result.time.of_sums) == (pytest.approx(2.0), pytest.approx(2.0))
    assert (result.path.mean, result.path.of_sums) == (pytest.approx(1.5), pytest.approx(12.0 / 9.0))
    assert compare_trials(ours[1:2], reference).time is None
    other_world = [record(0, scenario="maze")]
    assert compare_trials(other_world, reference).trials == 0


def test_success_is_compared_on_the_trials_in_which_one_method_alone_reached() -> None:
    unsupported = record(9, "unsupported")
    ours = [*map(record, range(9)), unsupported]
    theirs = [record(k, "reached" if k < 3 else "timeout") for k in range(10)]
    result = compare_trials(ours, theirs)
    assert (result.trials, result.reached_alone, result.other_reached_alone) == (3, 6, 0)
    assert result.success_p_value == pytest.approx(2 * 0.5**6)
    assert compare_trials(theirs, ours).success_p_value == result.success_p_value
    assert compare_trials(ours, ours).success_p_value == 1.0


def test_table_is_markdown() -> None:
    assert format_markdown_table(("a", "bcd"), [("100", "2")]) == "| a   | bcd |\n| --- | --- |\n| 100 | 2   |"


OUTLIERS = {"none": (0.0, 1.0), "rare and large": (0.1, 20.0), "many": (0.35, 3.0), "on the other side": (0.25, 0.05)}
"""Share of the ratios that are multiplied, and the factor."""


@pytest.mark.parametrize(("share", "factor"), OUTLIERS.values(), ids=OUTLIERS)
@pytest.mark.parametrize("count", [6, 9, 10, 30])
def test_the_interval_holds_its_level_for_few_pairs_with_outliers(count: int, share: float, factor: float) -> None:
    rng, samples = np.random.default_rng(2), 400

    def ratios(shape: tuple[int, ...]) -> np.ndarray:
        return rng.lognormal(0.0, 0.1, shape) * np.where(rng.random(shape) < share, factor, 1.0)

    truth = np.median(ratios((200_000,)))
    intervals = [compute_median_interval(sample) for sample in ratios((samples, count))]
    assert all(low <= value <= high for value, low, high in intervals)
    held = sum(low <= truth <= high for _, low, high in intervals)
    assert held >= 0.95 * samples - 3.0 * np.sqrt(0.05 * 0.95 * samples)


def test_an_outlier_does_not_stretch_the_interval_beyond_the_sample() -> None:
    value, low, high = compute_median_interval([1.05, 1.03, 0.94, 1.0, 2.72, 1.02])
    assert (value, low, high) == (pytest.approx(1.025), 0.94, 2.72)


@pytest.mark.parametrize("count", range(1, 6))
def test_fewer_than_six_pairs_have_no_interval(count: int) -> None:
    value, low, high = compute_median_interval([1.0] * count)
    assert value == 1.0 and np.isnan(low) and np.isnan(high)
