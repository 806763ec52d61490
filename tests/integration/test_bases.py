"""Every base among what moves, beside other robots, and with every fault that it can have."""

import pytest

from drake_starnav.loading import load_scenario
from drake_starnav.scenario.scenario_file import parse_scenario
from drake_starnav.simulation.robots import run_robots
from drake_starnav.simulation.run import run_trial

pytestmark = pytest.mark.slow

MODELS = ("starbot", "carrier", "omnibot", "carbot")
FAULTS = (
    ("drive.delay=0.1",),
    ("localization.drift=0.02",),
    ("localization.jump=0.1", "localization.jump_interval=3"),
    ("drive.delay=0.05", "lidar.delay=0.05", "lidar.noise=0.01", "localization.drift=0.02", "localization.jump=0.05"),
)


@pytest.mark.parametrize(
    ("model", "faults"), [*((model, FAULTS[-1]) for model in MODELS), *(("carbot", faults) for faults in FAULTS[:-1])]
)
def test_it_arrives_whatever_errs(model: str, faults: tuple[str, ...]) -> None:
    trial = run_trial(load_scenario("room", overrides=[f"robot.model={model}", *faults]), seed=0)
    assert trial.outcome == "reached" and trial.min_clearance_m > 0.0


@pytest.mark.parametrize(("model", "late"), [*((model, "0") for model in MODELS), ("carrier", "0.05")])
def test_it_makes_its_way_among_what_moves(model: str, late: str) -> None:
    scenario = load_scenario(
        "crowd_room", overrides=[f"robot.model={model}", "lidar.range_max=10", f"drive.delay={late}"]
    )
    trials = [run_trial(scenario, seed=seed) for seed in (1, 2, 5)]
    assert "collision" not in {trial.outcome for trial in trials}
    assert sum(trial.outcome == "reached" for trial in trials) >= 2


def test_robots_of_all_bases_meet() -> None:
    pairs = zip(
        MODELS, ((0, 0, 0, 8, 0), (8, 0, 3.14, 0, 0), (4, -3.5, 1.57, 4, 3.5), (4, 3.5, -1.57, 4, -3.5)), strict=True
    )
    robots = ", ".join(f"{{model: {m}, start: [{x}, {y}, {a}], goal: [{u}, {v}]}}" for m, (x, y, a, u, v) in pairs)
    text = f"world: !Obstacles {{bounds: [-2, -5, 10, 5]}}\nrobots: [{robots}]\nsimulation: {{timeout: 90}}"
    trials = run_robots(parse_scenario(text, name="bases"), seed=0)
    assert {each.trial.outcome for each in trials} == {"reached"}
    assert min(each.min_gap_m for each in trials) > 0.0


@pytest.mark.parametrize("model", MODELS)
@pytest.mark.parametrize("goals", ["[[3.9, -0.97, -2.85], [0, 0, 0.5]]", "[[3.9, 1.2, 1.57]]", "[[3.9, 1.2, -1.57]]"])
def test_it_ends_with_the_heading_of_its_goal(model: str, goals: str) -> None:
    """In the open, and forwards and backwards in a bay of 1.4 m; a car manoeuvres."""
    bay = "[[2.6, 1], [3.2, 1], [3.2, 2.4], [2.6, 2.4]], [[4.6, 1], [5.2, 1], [5.2, 2.4], [4.6, 2.4]]"
    walls = f", polygons: [{bay}]" if "1.57" in goals else ""
    world = f"world: !Obstacles {{bounds: [-2, -2.5, 6, 2.5], start: [0, 0, 0], goal: [4, 0]{walls}}}"
    text = f"{world}\nrobot: {{model: {model}}}\ngoals: {goals}\nsimulation: {{timeout: 60}}"
    trial = run_trial(parse_scenario(text, name="dock"), seed=0)
    assert trial.outcome == "reached" and trial.min_clearance_m > 0.0
