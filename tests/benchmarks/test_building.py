"""The building's tour is free of obstacles, and its log is replayed."""

import numpy as np
import pytest

from benchmarks.building import replayed
from benchmarks.building_world import CLEARANCE, building, tour
from drake_starnav.worlds.clearance import clearance

pytestmark = pytest.mark.slow


def test_the_tour_of_somebody_else_touches_nothing() -> None:
    world, middles = building(1)
    path = tour(world, middles, 40.0, 1)
    assert np.hypot(*np.diff(path, axis=0).T).sum() > 39.0
    assert clearance(world, path).min() > CLEARANCE - 1e-3


def test_a_replay_times_every_scan_and_repeats_itself() -> None:
    pipelines = [replayed(8, 0.3, 1) for _ in range(2)]
    for pipeline in pipelines:
        assert len(pipeline.timed.scan) == len(pipeline.timed.update) == 8
        assert pipeline.timed.nodes[-1] >= 3
        assert "| cost-to-go |" in pipeline.timed.table()
    assert pipelines[0].timed.digest == pipelines[1].timed.digest
