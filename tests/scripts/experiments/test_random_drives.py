"""Drives at random: what is drawn can be loaded, and a contact is reported with all that repeats it."""

from drake_starnav.scenario import load_scenario
from scripts.experiments.random_drives import FAULTS, RANGES, SCENARIOS, drawn, report


def test_what_is_drawn_is_a_scenario_and_the_same_for_a_seed() -> None:
    cases = [drawn(seed) for seed in range(60)]
    assert cases == [drawn(seed) for seed in range(60)]
    for name, overrides in cases:
        assert load_scenario(name, overrides=overrides).simulation.timeout == 90.0
    keys = {text.partition("=")[0] for _, overrides in cases for text in overrides}
    assert {name for name, _ in cases} == set(SCENARIOS) and keys > set(RANGES) | set(FAULTS)


def test_a_contact_is_reported_with_what_repeats_it() -> None:
    touched = {"seed": 7, "scenario": "maze", "set": ["robot.radius=0.3"], "outcome": "collision", "contact": "hull"}
    touched |= {"path_m": 3.0, "min_clearance_m": -0.001}
    refused = {"seed": 8, "scenario": "room", "set": [], "outcome": "refused", "why": "too fast"}
    text = report([touched, refused, {**touched, "seed": 9, "outcome": "reached", "min_clearance_m": 0.02}])
    assert text.startswith("3 drives: 1 collision, 1 reached, 1 refused\n6 m driven; least clearance -1.0 mm")
    assert "seed 7: hull, maze robot.radius=0.3" in text and "seed 9" not in text
