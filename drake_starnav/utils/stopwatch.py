"""Wall-clock times of the steps of the pipeline, kept beside the simulation and never part of its state."""

import time
from collections import defaultdict

import numpy as np

STEPS = ("command", "scan", "plan")
"""The timed steps of every trial, in the order of its fields."""


class Stopwatch:
    """Collects the durations of named steps. One per run; it only measures and has no effect on the run."""

    def __init__(self) -> None:
        self.seconds: dict[str, list[float]] = defaultdict(list)

    def count(self, name: str) -> int:
        """How often a step has been timed."""
        return len(self.seconds.get(name, ()))

    def note(self, name: str, begin: float, since: int | None = None) -> None:
        """Note a step that ends now, and began at the `time.perf_counter()` of `begin`.

        What was noted under this name since that `count` is part of the same step; None: nothing is.
        """
        step_times, time_spent = self.seconds[name], time.perf_counter() - begin
        if since is not None:
            time_spent += sum(step_times[since:])
            del step_times[since:]
        step_times.append(time_spent)

    def summarize(self, name: str) -> dict[str, float]:
        """`count`, `mean_s`, `p50_s` and `p99_s` of one step; zeros if it never ran."""
        times = self.seconds.get(name, [])
        if not times:
            return {"count": 0, "mean_s": 0.0, "p50_s": 0.0, "p99_s": 0.0}
        p50, p99 = np.percentile(times, (50, 99))
        return {"count": len(times), "mean_s": float(np.mean(times)), "p50_s": float(p50), "p99_s": float(p99)}
