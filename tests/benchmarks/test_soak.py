"""The soak run goes on to the next goal, and tells how a drive ended."""

from pathlib import Path

import pytest

from benchmarks import soak
from tests.helpers.head_on import head_on


@pytest.mark.parametrize(("max_speed", "outcome"), [(0.8, "collision"), (0.01, "struck")])
def test_what_runs_into_the_robot_ends_the_drive(tmp_path: Path, max_speed: float, outcome: str, monkeypatch) -> None:
    monkeypatch.setattr(soak, "random_place", lambda world, radius, rng: world.goal)
    leg = soak.Soak(head_on(tmp_path, max_speed), 0).drive(0)
    assert (leg.outcome, leg.goal) == (outcome, 0)
    assert leg.time_s < 1.7
