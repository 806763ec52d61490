"""The building's tour is free of obstacles, and its log is replayed."""

import pytest

from benchmarks.building import replayed

pytestmark = pytest.mark.slow


def test_a_replay_times_every_scan_and_repeats_itself() -> None:
    pipelines = [replayed(8, 0.3, 1) for _ in range(2)]
    for pipeline in pipelines:
        assert len(pipeline.timed.scan) == len(pipeline.timed.update) == 8
        assert pipeline.timed.nodes[-1] >= 3
        assert "| cost-to-go |" in pipeline.timed.table()
    assert pipelines[0].timed.digest == pipelines[1].timed.digest
