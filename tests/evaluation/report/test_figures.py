"""The report's plots show the numbers of the records, told apart by more than colour."""

from dataclasses import replace

import numpy as np
import pytest

from drake_starnav.evaluation.jobs import make_cases
from drake_starnav.evaluation.report import figures
from drake_starnav.evaluation.report.results import make_results
from drake_starnav.evaluation.summary import cost_table, summarise, wilson_interval
from drake_starnav.evaluation.trial_file import make_header
from tests.helpers.trials import made_up, record

METHODS = ("star", "dsm", "foa", "foa_cluster", "foa_roadmap", "dwa", "star_paper", "other", "another")


def test_each_panel_has_the_rates_and_intervals_of_its_scenario() -> None:
    results = made_up()
    figure = figures.success_figure(results)
    assert [axes.get_title() for axes in figure.axes] == results.scenarios
    for axes, scenario in zip(figure.axes, results.scenarios, strict=True):
        for row, method in enumerate(results.methods):
            case = results.of(scenario, method)
            reached = sum(r["outcome"] == "reached" for r in case)
            bar, marker = axes.lines[2 * row : 2 * row + 2]
            assert bar.get_xdata() == pytest.approx(100.0 * np.array(wilson_interval(reached, len(case))))
            assert list(marker.get_xdata()) == [100.0 * reached / len(case)]
            assert axes.texts[row].get_text() == f"{100.0 * reached / len(case):.1f} %"


def test_the_chart_of_paths_has_the_numbers_of_the_table() -> None:
    results = made_up(trials=10)
    charted = [text.get_text() for axes in figures.path_figure(results).axes for text in axes.texts]
    head, rows = cost_table(summarise(results.records))
    assert charted == [row[head.index("path/shortest")] for row in rows]


def test_methods_differ_in_colour_or_line_and_mostly_in_both() -> None:
    looks = [figures.style(METHODS, method) for method in METHODS]
    assert len({(look["color"], look["linestyle"]) for look in looks}) == len(METHODS)
    assert len({look["marker"] for look in looks[:9]}) == 9


def test_bins_hold_about_as_many_worlds_each() -> None:
    results = made_up(trials=30)
    edges = figures.difficulty_edges(results.records, figures.gap)
    gaps = [record["tightest_gap_m"] for record in results.records if record["method"] == "star"]
    counts, _ = np.histogram(gaps, edges)
    assert counts.sum() == 60
    assert counts.max() - counts.min() <= 1
    assert len(figures.difficulty_edges(results.records[:7], figures.gap)) == 2


def test_difficulty_is_drawn_for_every_method_and_left_out_where_nothing_tells() -> None:
    results = made_up(trials=30)
    left, right = figures.difficulty_figure(results).axes
    for axes in (left, right):
        assert [line.get_label() for line in axes.lines if not line.get_label().startswith("_")] == results.methods
    rates = right.lines[0].get_ydata()
    assert list(rates) == [100.0] * 5  # star always arrives in these
    silent = replace(results, records=tuple({**r, "tightest_gap_m": None} for r in results.records))
    assert len(figures.difficulty_figure(silent).axes) == 1
    old = [{k: v for k, v in r.items() if k not in ("tightest_gap_m", "straight_line_m")} for r in results.records]
    assert figures.difficulty_figure(replace(results, records=tuple(old))) is None


def test_an_interval_that_cannot_be_told_is_not_drawn() -> None:
    header = made_up().headers[0]
    records = [record(trial=k) for k in range(12)]
    records += [record(method="star_paper", trial=k, time_s=21.0 if k == 0 else 20.0) for k in range(12)]
    figure = figures.comparison_figure(make_results([header], records), "time_s", "time")
    low, high = figure.axes[0].get_xlim()
    assert 99.0 < low < 100.4 < high < 102.0
    assert "100.4 %" in figures.svg(figure)


def test_trajectories_lie_over_their_worlds_and_failures_are_marked() -> None:
    results = made_up(trials=5)
    figure = figures.trajectory_figure(results, "forest", 3)
    drawn = [axes for axes in figure.axes if axes.get_title()]
    assert [axes.get_title().split(" · ")[0] for axes in drawn] == ["trial 0", "trial 1", "trial 2"]
    for trial, axes in enumerate(drawn):
        paths = {line.get_label(): line.get_xydata() for line in axes.lines if line.get_label() in results.methods}
        records = [r for r in results.records if r["scenario"] == "forest" and r["trial"] == trial]
        for r in records:
            np.testing.assert_array_equal(paths[r["method"]], r["path"])
        crosses = sum(line.get_marker() == "x" for line in axes.lines)
        assert crosses == sum(r["outcome"] != "reached" for r in records)
        assert len(axes.collections[0].get_paths()) > 10  # trees
    assert figures.trajectory_figure(results, "nowhere", 3) is None


def test_obstacles_of_a_model_file_are_drawn_too() -> None:
    case = make_cases(["kitchen"], ["star"])[0]
    header = make_header([case], 0)
    figure = figures.trajectory_figure(make_results([header], [record(scenario="kitchen")]), "kitchen", 1)
    axes = next(axes for axes in figure.axes if axes.get_title())
    assert sum(len(drawn.get_paths()) for drawn in axes.collections) > 10
