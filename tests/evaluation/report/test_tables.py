"""The tables of reports agree with the records, in every form."""

import csv
import io

import pytest

from drake_starnav.evaluation.report.results import make_results
from drake_starnav.evaluation.report.tables import (
    format_summary_csv,
    format_tables_markdown,
    list_further_figures,
    make_result_tables,
)
from tests.helpers.trials import made_up, record


def test_csv_has_a_line_for_each_case_with_all_figures() -> None:
    results = made_up(trials=6, mean_clearance_m=0.5)
    rows = list(csv.DictReader(io.StringIO(format_summary_csv(results))))
    assert [(row["scenario"], row["method"]) for row in rows] == [
        ("forest", "star"), ("forest", "star_paper"), ("room", "star"), ("room", "star_paper"),
    ]  # fmt: skip
    for row in rows:
        case = results.of(row["scenario"], row["method"])
        assert int(row["trials"]) == len(case) == 6
        assert int(row["reached"]) == sum(r["outcome"] == "reached" for r in case)
        assert int(row["collision"]) == sum(r["outcome"] == "collision" for r in case)
        assert float(row["success_low"]) <= int(row["reached"]) / 6 <= float(row["success_high"])
        assert float(row["mean_clearance_m"]) == pytest.approx(0.5)


def test_figures_of_later_days_are_shown_where_a_goal_was_reached() -> None:
    header = made_up().headers[0]
    records = [
        record(trial=0, world=7, stops=2, jerk_mps3=1.0),
        record(trial=1, stops=4),
        record("forest", "star", 2, "collision", stops=90),
        record("room", "star", 0, "unsupported"),
    ]
    results = make_results([header], records)
    assert list_further_figures(records) == ["stops", "jerk_mps3"]
    (head, rows) = dict(make_result_tables(results))["Further figures, means over the trials that reached the goal"]
    assert head == ("scenario", "method", "stops", "jerk, m/s³")
    assert list(rows) == [("forest", "star", "3.000", "1.000"), ("room", "star", "-", "-")]
    assert "unsupported" in format_tables_markdown(results)
