"""Rooms in which a robot that trusts what stands was run into while it drove: now it never is."""

import json
from pathlib import Path

import numpy as np
import pytest

from drake_starnav.navigation import Parts
from drake_starnav.scenario.scenario_file import load_scenario
from drake_starnav.simulation.run import run_trial
from drake_starnav.worlds import MovingObstacles, World

pytestmark = pytest.mark.slow

ROOMS = json.loads((Path(__file__).parents[1] / "data" / "stop_and_go.json").read_text(encoding="utf-8"))
"""Twenty seconds of eight discs that stand for two to four seconds, then walk at the largest speed declared."""


@pytest.mark.parametrize("seed", range(len(ROOMS)))
def test_discs_that_start_are_not_run_into(seed: int) -> None:
    room = ROOMS[seed]
    world = World(
        name="stop_and_go",
        start=(0.8, 3.0, 0.0),
        goal=(9.2, 3.0),
        bounds=(0.0, 0.0, 10.0, 6.0),
        moving_obstacles=MovingObstacles(room["radii"], tuple(np.array(path) for path in room["paths"])),
    )
    declared = [f"obstacles.max_speed={room['max_speed']}", "simulation.timeout=20"]
    trial = run_trial(load_scenario("stop_and_go", overrides=declared), Parts(world), seed=seed)
    assert trial.outcome in ("reached", "struck", "timeout")
