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

    def measure(self, name: str, since: int | None = None) -> "_Timing":
        """Times the body of a `with` statement under `name`; a body that fails is not counted.

        What was timed under this name since that `count` is part of the same step; None: nothing is.
        """
        return _Timing(self.seconds, name, since)

    def summary(self, name: str) -> dict[str, float]:
        """`count`, `mean_s`, `p50_s` and `p99_s` of one step; zeros if it never ran."""
        times = self.seconds.get(name, [])
        if not times:
            return {"count": 0, "mean_s": 0.0, "p50_s": 0.0, "p99_s": 0.0}
        p50, p99 = np.percentile(times, (50, 99))
        return {"count": len(times), "mean_s": float(np.mean(times)), "p50_s": float(p50), "p99_s": float(p99)}


class _Timing:
    """One body of a `with` statement being timed: a class, for a generator costs as much as some of the steps."""

    __slots__ = ("_name", "_seconds", "_since", "_start")

    def __init__(self, seconds: dict[str, list[float]], name: str, since: int | None) -> None:
        self._seconds, self._name, self._since = seconds, name, since

    def __enter__(self) -> None:
        self._start = time.perf_counter()

    def __exit__(self, kind: type[BaseException] | None, *error: object) -> None:
        if kind is None:
            times, spent = self._seconds[self._name], time.perf_counter() - self._start
            if self._since is not None:
                spent += sum(times[self._since :])
                del times[self._since :]
            times.append(spent)
