"""Drives at random: what is drawn can be loaded, and a contact is reported with all that repeats it."""

from drake_starnav.scenario.scenario_file import load_scenario
from scripts.experiments.random_drives import BODIES, FAULTS, RANGES, SCENARIOS, drawn, driven


def test_what_is_drawn_is_a_scenario_and_the_same_for_a_seed() -> None:
    cases = [drawn(seed) for seed in range(150)]
    assert cases == [drawn(seed) for seed in range(150)]
    robots, lidars, limited = set(), set(), 0
    for name, overrides, mounts in cases:
        scenario = load_scenario(name, overrides=overrides)
        assert scenario.simulation.timeout == 90.0 and len(scenario.all_lidars) == max(len(mounts), 1)
        lidars.add(len(mounts))
        limited += len(mounts) == 1 and not scenario.lidar.field_of_view.full_circle
        robots.add((scenario.robot.model, scenario.robot.base, len(scenario.robot.shape.parts)))
    assert robots == {(b.model, b.base, 0 if b.radii else 1 + b.notched) for b in BODIES} and lidars == {0, 1, 2}
    assert limited > 5  # elsewhere than on the axis
    keys = {text.partition("=")[0] for _, overrides, _ in cases for text in overrides}
    assert {name for name, _, _ in cases} == set(SCENARIOS) and keys > set(RANGES) | set(FAULTS)


def test_random_commands_reach_obstacles_and_touch_none() -> None:
    records = [driven(seed, commands=8000) for seed in (11, 13, 22)]  # a disc, a car with two lidars, an omni-drive
    assert {record["outcome"] for record in records} == {"driven"}
    assert 0.0 < min(record["min_clearance_m"] for record in records) < 0.1
    assert all(record["commands"] >= 8000 and record["path_m"] > 0.5 for record in records)
    assert {**driven(11, commands=8000), "time_s": records[0]["time_s"]} == records[0]
