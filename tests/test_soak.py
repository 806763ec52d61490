"""The soak run goes on to the next goal, and tells how a drive ended."""

import json
from pathlib import Path

import pytest

from benchmarks import soak
from drake_starnav.scenario import parse_scenario


@pytest.mark.parametrize(("max_speed", "outcome"), [(0.8, "collision"), (0.01, "struck")])
def test_what_runs_into_the_robot_ends_the_drive(tmp_path: Path, max_speed: float, outcome: str, monkeypatch) -> None:
    """Something comes head on, faster than the robot can know."""
    content = {
        "meta": {"start": [0, 0, 0], "goal": [6, 0]},
        "worlds": [{"id": 0, "plugins": ["a"], "walls": []}],
        "trajectories": {"a": {"total": 10.0, "keys": [[0.0, 4.0, 0.0], [10.0, -16.0, 0.0]]}},
    }
    (tmp_path / "worlds.json").write_text(json.dumps(content))
    text = f"world: !DynaBarn {{file: {tmp_path / 'worlds.json'}}}\nrobot: {{max_speed: {max_speed}}}\n"
    text += "controller: {certificate: false, modulation: false, near_wall_term: false}\n"
    monkeypatch.setattr(soak, "random_place", lambda world, radius, rng: world.goal)
    leg = soak.Soak(parse_scenario(text, name="head on"), 0).drive(0)
    assert (leg.outcome, leg.goal) == (outcome, 0)
    assert leg.time_s < 1.7
