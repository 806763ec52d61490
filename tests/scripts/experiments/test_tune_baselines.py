"""How baselines are tuned: what counts in one trial, and which parameters come first."""

import runpy
from pathlib import Path

from drake_starnav.scenario.schema import Scenario

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
