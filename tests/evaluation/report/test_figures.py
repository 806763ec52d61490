"""The report's plots show the numbers of the records, told apart by more than colour."""

from dataclasses import replace

import numpy as np
import pytest

from drake_starnav.evaluation.report import figures
from drake_starnav.evaluation.summary import compute_wilson_interval
from tests.helpers.trials import made_up


def test_each_panel_has_the_rates_and_intervals_of_its_scenario() -> None:
    results = made_up()
    figure = figures.draw_success_figure(results)
    assert [axes.get_title() for axes in figure.axes] == results.scenarios
    for axes, scenario in zip(figure.axes, results.scenarios, strict=True):
        for row, method in enumerate(results.methods):
            case = results.of(scenario, method)
            reached = sum(r["outcome"] == "reached" for r in case)
            bar, marker = axes.lines[2 * row : 2 * row + 2]
            assert bar.get_xdata() == pytest.approx(100.0 * np.array(compute_wilson_interval(reached, len(case))))
            assert list(marker.get_xdata()) == [100.0 * reached / len(case)]
            assert axes.texts[row].get_text() == f"{100.0 * reached / len(case):.1f} %"


def test_difficulty_is_drawn_for_every_method_and_left_out_where_nothing_tells() -> None:
    results = made_up(trials=30)
    left, right = figures.draw_difficulty_figure(results).axes
    for axes in (left, right):
        assert [line.get_label() for line in axes.lines if not line.get_label().startswith("_")] == results.methods
    rates = right.lines[0].get_ydata()
    assert list(rates) == [100.0] * 5  # star always arrives in these
    silent = replace(results, records=tuple({**r, "tightest_gap_m": None} for r in results.records))
    assert len(figures.draw_difficulty_figure(silent).axes) == 1
    old = [{k: v for k, v in r.items() if k not in ("tightest_gap_m", "straight_line_m")} for r in results.records]
    assert figures.draw_difficulty_figure(replace(results, records=tuple(old))) is None


def test_trajectories_lie_over_their_worlds_and_failures_are_marked() -> None:
    results = made_up(trials=5)
    figure = figures.draw_trajectory_figure(results, "forest", 3)
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
    assert figures.draw_trajectory_figure(results, "nowhere", 3) is None


def test_the_data_of_the_figures_are_what_they_show() -> None:
    results = made_up(trials=30)
    rows = figures.collect_figure_data(results)
    success = [row for row in rows if row["figure"] == "success"]
    drawn = [line.get_xdata()[0] for axes in figures.draw_success_figure(results).axes for line in axes.lines[1::2]]
    assert [row["y"] for row in success] == pytest.approx(drawn)
    harder = figures.DIFFICULTIES[1][0]
    lines = [
        line for line in figures.draw_difficulty_figure(results).axes[1].lines if line.get_label() in results.methods
    ]
    assert [row["y"] for row in rows if row["figure"] == harder] == [y for line in lines for y in line.get_ydata()]
    assert len({(line.get_marker(), line.get_linestyle()) for line in lines}) == len(results.methods)
    assert sum(row["figure"] == "trajectories" for row in rows) == sum(len(r["path"]) for r in results.records)
