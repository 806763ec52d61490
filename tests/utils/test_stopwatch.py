"""Wall-clock times by name."""

import time

from drake_starnav.utils.stopwatch import Stopwatch


def test_what_never_ran_has_a_summary_of_zeros_and_leaves_no_trace() -> None:
    stopwatch = Stopwatch()
    assert stopwatch.summarize("plan") == {"count": 0, "mean_s": 0.0, "p50_s": 0.0, "p99_s": 0.0}
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
