"""Wall-clock times of the steps of the pipeline, kept beside the simulation and never part of its state."""

import time
from collections import defaultdict
from collections.abc import Iterator
from contextlib import contextmanager

import numpy as np


class Stopwatch:
    """Collects how long named steps took. One per run; it only measures, and nothing reads it back."""

    def __init__(self) -> None:
        self.seconds: dict[str, list[float]] = defaultdict(list)

    @contextmanager
    def measure(self, name: str) -> Iterator[None]:
        """Times the body of a `with` statement under `name`."""
        start = time.perf_counter()
        yield
        self.seconds[name].append(time.perf_counter() - start)

    def summary(self, name: str) -> dict[str, float]:
        """`count`, `mean_s`, `p50_s` and `p99_s` of one step; zeros if it never ran."""
        times = self.seconds.get(name, [])
        if not times:
            return {"count": 0, "mean_s": 0.0, "p50_s": 0.0, "p99_s": 0.0}
        p50, p99 = np.percentile(times, (50, 99))
        return {"count": len(times), "mean_s": float(np.mean(times)), "p50_s": float(p50), "p99_s": float(p99)}
