"""The report draws what its labels say, and puts each world into the bin where a histogram would."""

import numpy as np
import pytest

from drake_starnav.evaluation.report import figures, page
from drake_starnav.evaluation.report.results import make_results
from tests.helpers.trials import made_up, record


@pytest.mark.parametrize(("field", "percent"), [("time_s", "150.0 %"), ("path_length_m", "200.0 %")])
def test_a_comparison_is_of_the_field_that_is_asked_for(field: str, percent: str) -> None:
    slow = record(method="star_paper", time_s=30.0, path_length_m=28.0)
    results = make_results([made_up().headers[0]], [record(), slow])
    assert figures.comparison_figure(results, field, "it").axes[0].texts[0].get_text() == percent


def test_the_page_compares_times_and_paths(monkeypatch) -> None:
    asked: list[tuple[str, str]] = []
    monkeypatch.setattr(figures, "comparison_figure", lambda results, field, label: asked.append((field, label)))
    page.write_page(page.Report(made_up(trials=2), worlds=1))
    assert asked == [("time_s", "time"), ("path_length_m", "path length")]


def test_a_world_between_two_bins_is_in_the_upper_one() -> None:
    gaps = np.arange(11.0) + 1.0
    outcomes = ["collision" if gap == 6.0 else "reached" for gap in gaps]
    records = [record(trial=k, outcome=outcomes[k], tightest_gap_m=gap) for k, gap in enumerate(gaps)]
    results = make_results([made_up(methods=("star",)).headers[0]], records)
    edges = figures.difficulty_edges(records, figures.gap)
    assert list(edges) == [1.0, 6.0, 11.0]
    (axes,) = figures.difficulty_figure(results).axes
    counts, _ = np.histogram(gaps, edges)
    assert axes.lines[0].get_ydata() == pytest.approx([100.0, 100.0 * (counts[1] - 1) / counts[1]])
    assert axes.lines[0].get_xdata() == pytest.approx([3.0, 8.5])
