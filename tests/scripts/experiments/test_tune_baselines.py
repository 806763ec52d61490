"""How baselines are tuned: what counts in one trial, and which parameters come first."""

import runpy
from pathlib import Path

import numpy as np
import pytest

from drake_starnav.control.inputs import Proposal
from drake_starnav.scenario.scenario_file import load_scenario
from drake_starnav.scenario.schema import Scenario
from drake_starnav.worlds import World

SCRIPT = runpy.run_path(str(Path(__file__).parents[3] / "scripts" / "experiments" / "tune_baselines.py"))
NAMES = SCRIPT["tune"].__globals__
ENDS = {0.4: (("reached", 20.0), ("reached", 22.0)), 0.6: (("reached", 30.0),) * 2, 0.8: (("reached", 5.0), None)}
FAIL = ("timeout", 75.0)


def test_most_trials_reached_come_first_then_least_time(monkeypatch) -> None:
    def drive(scenario: Scenario, seed: int) -> tuple[str, float]:
        return ENDS[scenario.foa.max_speed][seeds.index(seed)] or FAIL

    seeds = [SCRIPT["trial_seed"](SCRIPT["SEED"], k) for k in range(2)]
    monkeypatch.setitem(NAMES, "drive", drive)
    monkeypatch.setitem(NAMES, "GRIDS", {"foa": {"foa.max_speed": ("0.8", "0.6", "0.4")}})
    rows = [row.split("|")[1:-1] for row in SCRIPT["tune"]("foa", 2).splitlines()[2:]]
    cells = [[cell.strip() for cell in row] for row in rows]
    assert cells == [
        ["foa.max_speed=0.4", "2", "0", "0", "2", "0", "0", "21.0"],
        ["foa.max_speed=0.6", "2", "0", "0", "2", "0", "0", "30.0"],
        ["foa.max_speed=0.8", "1", "0", "1", "1", "0", "1", "5.0"],
    ]


def test_constants_are_replaced_for_one_combination() -> None:
    dwa = SCRIPT["dwa"]
    with SCRIPT["replaced_constants"](["dwa.PERIOD=0.125", "dwa.margin=0.1"]) as overrides:
        assert (dwa.PERIOD, overrides) == (0.125, ["dwa.margin=0.1"])
    assert dwa.PERIOD == 0.25


@pytest.mark.parametrize(
    ("cylinders", "speed", "outcome", "way"),
    [
        ([], 0.5, "reached", 3.0 - 0.3),
        ([(2.0, 0.0, 0.3)], 0.5, "collision", 2.0 - 0.3 - 0.25),
        ([], -0.5, "timeout", 0.5 * SCRIPT["TIMEOUT"]),
    ],
)
def test_a_trial_without_dynamics_ends_as_one_with_them(cylinders, speed, outcome, way, monkeypatch) -> None:
    world = World("straight", (0.0, 0.0, 0.0), (3.0, 0.0), cylinders=cylinders)
    monkeypatch.setitem(NAMES, "cached_world", lambda scenario, seed: world)
    monkeypatch.setitem(NAMES, "baseline_step", lambda *now: Proposal(np.array((speed, 0.0)), np.zeros(2)))
    scenario = load_scenario("forest", method="foa", overrides=["simulation.goal_tolerance=0.3"])
    assert scenario.robot.radius == 0.25
    ended, time = SCRIPT["drive"](scenario, 0)
    ramp = 0.0 if outcome == "timeout" else 0.5 * 0.5 / scenario.robot.max_acceleration  # lost by accelerating
    assert (ended, time) == (outcome, pytest.approx(way / 0.5 + ramp, abs=1.01 / scenario.controller.rate))
