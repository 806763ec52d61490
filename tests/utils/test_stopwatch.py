"""Wall-clock times by name."""

import time

import numpy as np
import pytest

from drake_starnav.utils.stopwatch import Stopwatch


def test_what_never_ran_has_a_summary_of_zeros_and_leaves_no_trace() -> None:
    stopwatch = Stopwatch()
    assert stopwatch.summary("plan") == {"count": 0, "mean_s": 0.0, "p50_s": 0.0, "p99_s": 0.0}
    assert dict(stopwatch.seconds) == {}


def test_what_was_noted_since_a_count_is_part_of_the_step(monkeypatch) -> None:
    now = iter([1.0, 3.0, 9.0])
    monkeypatch.setattr(time, "perf_counter", lambda: next(now))
    stopwatch = Stopwatch()
    stopwatch.note("command", 0.0)
    count = stopwatch.count("command")
    stopwatch.note("command", 2.5)
    stopwatch.note("command", 8.0, since=count)
    assert stopwatch.seconds == {"command": [1.0, 1.5]}


def test_summary_is_of_all_times() -> None:
    stopwatch = Stopwatch()
    times = np.random.default_rng(0).uniform(0.0, 1.0, 200)
    stopwatch.seconds["plan"].extend(times)
    summary = stopwatch.summary("plan")
    assert summary["count"] == 200
    assert summary["mean_s"] == pytest.approx(times.mean())
    assert summary["p50_s"] == pytest.approx(np.median(times))
    assert (times <= summary["p99_s"]).mean() == pytest.approx(0.99)
