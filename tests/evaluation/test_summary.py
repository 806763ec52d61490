"""Figures of many trials, against values computed by hand."""

import numpy as np
import pytest

from drake_starnav.evaluation.summary import (
    by_robot,
    compare,
    cost_table,
    markdown_table,
    outcome_table,
    ratio_interval,
    summarise,
    wilson_interval,
)


def tables_of(summaries) -> str:
    """The tables of outcomes and of costs, as Markdown."""
    return f"{markdown_table(*outcome_table(summaries))}\n\n{markdown_table(*cost_table(summaries))}"


def record(trial: int, outcome: str = "reached", **fields) -> dict:
    step = {"count": 10, "mean_s": 2e-5, "p50_s": 2e-5, "p99_s": 5e-5}
    base = {
        "scenario": "forest", "method": "star", "trial": trial, "seed": trial, "outcome": outcome, "time_s": 10.0,
        "path_length_m": 6.0, "shortest_path_m": 5.0, "min_clearance_m": 0.02, "wall_s": 1.0, "command": step,
        "scan": step, "plan": step,
    }  # fmt: skip
    return {**base, **fields}


def test_summary_of_a_case() -> None:
    records = [
        record(0),
        record(1, path_length_m=9.0, time_s=20.0, wall_s=5.0, min_clearance_m=None),
        record(2, "collision", min_clearance_m=-0.01, path_length_m=1.0, time_s=2.0),
        record(3, "timeout", time_s=168.0),
        {"scenario": "forest", "method": "star", "trial": 4, "seed": 4, "outcome": "error", "message": "no world"},
    ]
    (summary,) = summarise(records)
    assert (summary.trials, summary.reached) == (5, 2)
    assert summary.interval == wilson_interval(2, 5)
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
    rows = summarise(by_robot([*trials, record(0, scenario="alone")]))
    assert [(row.scenario, row.trials, row.reached) for row in rows] == [
        ("forest", 2, 1), ("forest/a", 2, 2), ("forest/b", 2, 1), ("alone", 1, 1),
    ]  # fmt: skip
    assert rows[1].time_s == 7.0


def test_nothing_to_tell_is_a_dash() -> None:
    error = {"scenario": "maze", "method": "star", "trial": 0, "seed": 0, "outcome": "error", "message": "no world"}
    (summary,) = summarise([error])
    assert summary.path_mean is summary.time_s is summary.speed_mps is summary.wall_ratio is None
    tables = tables_of([summary])
    assert "0.0 % (0.0 to 79.3)" in tables
    assert tables.splitlines()[-1].count(" - ") >= 8


def test_score_is_the_mean_over_all_trials_of_a_benchmark() -> None:
    error = {"scenario": "forest", "method": "star", "trial": 2, "seed": 2, "outcome": "error", "message": "no world"}
    (summary,) = summarise([record(0, score=0.5), record(1, "collision", score=0.0), error, record(3, score=0.25)])
    assert summary.score == pytest.approx(0.75 / 4)
    assert "| score  |" in tables_of([summary])
    assert "0.1875" in tables_of([summary])
    (summary,) = summarise([record(0, score=None), record(1)])
    assert summary.score is None
    assert "score" not in tables_of([summary])


def test_unsupported_trials_are_counted_apart() -> None:
    unsupported = {"scenario": "forest", "method": "star", "trial": 1, "seed": 1, "outcome": "unsupported"}
    (summary,) = summarise([record(0), unsupported, record(2, "timeout")])
    assert (summary.trials, summary.reached) == (2, 1)
    assert summary.interval == wilson_interval(1, 2)
    assert summary.failures["unsupported"] == 1
    (never,) = summarise([unsupported])
    assert (never.trials, never.interval) == (0, (0.0, 1.0))
    assert "| unsupported" in tables_of([summary, never])


def test_comparison_uses_trials_that_both_reached() -> None:
    ours = [record(0, time_s=30.0), record(1, "timeout", time_s=500.0), record(2), record(3)]
    reference = [record(0), record(1), record(2, "collision"), record(3, path_length_m=3.0)]
    result = compare(ours, reference)
    assert (result.trials, result.time_ratio, result.path_ratio) == (2, pytest.approx(2.0), pytest.approx(12.0 / 9.0))
    assert compare(ours[1:2], reference).time_ratio is None
    other_world = [record(0, scenario="maze")]
    assert compare(other_world, reference).trials == 0


def test_table_is_markdown() -> None:
    assert markdown_table(("a", "bcd"), [("100", "2")]) == "| a   | bcd |\n| --- | --- |\n| 100 | 2   |"


def test_the_interval_holds_the_truth_about_as_often_as_it_says() -> None:
    rng = np.random.default_rng(2)
    held = 0
    for _ in range(200):
        below = rng.uniform(1.0, 3.0, 40)
        ratio, low, high = ratio_interval(below * rng.normal(1.3, 0.2, 40), below)
        assert low <= ratio <= high
        held += low <= 1.3 <= high
    assert 180 <= held <= 198
