"""Wall-clock times by name."""

import time

import numpy as np
import pytest

from drake_starnav.utils.stopwatch import Stopwatch


def test_what_never_ran_has_a_summary_of_zeros_and_leaves_no_trace() -> None:
    stopwatch = Stopwatch()
    assert stopwatch.summary("plan") == {"count": 0, "mean_s": 0.0, "p50_s": 0.0, "p99_s": 0.0}
    assert dict(stopwatch.seconds) == {}


def test_measures_the_body_each_time_and_nested(monkeypatch) -> None:
    now = iter([0.0, 1.0, 3.0, 6.0, 10.0, 10.5])
    monkeypatch.setattr(time, "perf_counter", lambda: next(now))
    stopwatch = Stopwatch()
    with stopwatch.measure("scan"), stopwatch.measure("fit"):
        pass
    with stopwatch.measure("scan"):
        pass
    assert stopwatch.seconds == {"scan": [6.0, 0.5], "fit": [2.0]}


def test_summary_is_of_all_times() -> None:
    stopwatch = Stopwatch()
    times = np.random.default_rng(0).uniform(0.0, 1.0, 200)
    stopwatch.seconds["plan"].extend(times)
    summary = stopwatch.summary("plan")
    assert summary["count"] == 200
    assert summary["mean_s"] == pytest.approx(times.mean())
    assert summary["p50_s"] == pytest.approx(np.median(times))
    assert (times <= summary["p99_s"]).mean() == pytest.approx(0.99)


def test_two_stopwatches_share_nothing_and_errors_pass_through() -> None:
    one, other = Stopwatch(), Stopwatch()
    with pytest.raises(ValueError, match="broken"), one.measure("scan"):
        raise ValueError("broken")
    with one.measure("scan"):
        pass
    assert one.summary("scan")["count"] == 1  # a step that failed is not counted
    assert other.summary("scan")["count"] == 0
