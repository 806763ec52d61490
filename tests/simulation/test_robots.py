"""Several robots in one world, each with navigation of its own."""

import json
from pathlib import Path

import numpy as np
import pytest

from drake_starnav import StarnavError, load_scenario, make_diagram, parse_scenario
from drake_starnav.cli.simulate import simulate
from drake_starnav.moving.certificate import ESCAPE, MOVING_MARGIN
from drake_starnav.simulation.robots import make_worlds_of_robots, run_robots

WORLD = "world: !Obstacles {bounds: [-1, -1.5, 5, 1.5]}\nlidar: {range_max: 10.0}\nrobot: {max_speed: 0.5}\n"
EAST, WEST = "start: [0, 0, 0], goal: [4, 0]", "start: [4, 0, 3.14], goals: [[2, -0.8], [0, 0]]"
PAIR = f"{WORLD}robots: [{{{EAST}}}, {{{WEST}}}]\nsimulation: {{timeout: 40}}\n"


def test_two_robots_change_places_and_each_has_a_record(tmp_path: Path, capsys) -> None:
    file, html, figures = (tmp_path / f"pair.{kind}" for kind in ("yaml", "html", "json"))
    file.write_text(PAIR)
    assert simulate([str(file), "--html", str(html), "--json", str(figures)]) == 0
    printed = capsys.readouterr().out
    records = json.loads(figures.read_text())["robots"]
    assert [record["robot"] for record in records] == ["starbot_1", "starbot_2"]
    for record, count in zip(records, (1, 2), strict=True):
        assert f"{record['robot']}  reached" in printed
        assert record["outcome"] == "reached" and len(record["goals_s"]) == count
        assert record["time_s"] == record["goals_s"][-1]
        assert 0.05 < record["min_gap_m"] == records[0]["min_gap_m"] < 2.0
        assert record["min_clearance_m"] > 0.0
    page = html.read_text()
    assert "trail" in page and "starbot_1: reached" in page and "starbot_2: reached" in page


def test_the_same_seed_gives_the_same_run_and_each_robot_has_noise_of_its_own() -> None:
    scenario = parse_scenario(PAIR, name="pair", overrides=["simulation.timeout=2"])
    first, second = (run_robots(scenario, seed=5) for _ in range(2))
    assert [each.trial.state_hash for each in first] == [each.trial.state_hash for each in second]
    assert first[0].trial.state_hash != first[1].trial.state_hash
    assert all(each.trial.outcome == "timeout" for each in first)


@pytest.mark.slow
def test_six_robots_of_three_kinds_change_places_without_a_contact() -> None:
    trials = run_robots(load_scenario("six_robots"), seed=0)
    assert [each.robot for each in trials] == [
        "starbot_1", "jackal_2", "carrier_3", "starbot_4", "jackal_5", "carrier_6",
    ]  # fmt: skip
    for each in trials:
        assert each.trial.outcome == "reached", each.trial.contact
        assert each.min_gap_m > 0.25 * (MOVING_MARGIN - ESCAPE) and each.trial.min_clearance_m > 0.0


@pytest.mark.slow
def test_in_a_corridor_for_one_robots_make_way_or_give_up_but_touch_nothing() -> None:
    robots = "[{start: [0, 0, 0], goal: [6, 0]}, {start: [6, 0, 3.14], goal: [0, 0]}]"
    world = WORLD.replace("[-1, -1.5, 5, 1.5]", "[-1, -0.45, 7, 0.45]")
    trials = run_robots(parse_scenario(f"{world}robots: {robots}\nsimulation: {{timeout: 90}}", name="corridor"))
    ends = sorted(  # who stood and waited is blocked, even if it just backs off once more as time is over
        "blocked" if each.trial.outcome == "timeout" and each.trial.blocked_s is not None else each.trial.outcome
        for each in trials
    )
    given_up = ["unreachable", "unreachable"]  # which of the four depends on the seed
    made_way = ["reached", "reached"]  # one backed out of the corridor, and came again
    assert ends in (made_way, ["reached", "unreachable"], ["blocked", "reached"], given_up), [
        t.trial.contact for t in trials
    ]
    assert trials[0].min_gap_m > 0.05 and min(each.trial.min_clearance_m for each in trials) > 0.0


def test_each_robot_has_the_world_up_to_its_own_top() -> None:
    robots = "[{model: starbot}, {model: jackal}]".replace("}", ", start: [1, 1, 0], goal: [4, 4]}", 1)
    robots = robots.replace("jackal}", "jackal, start: [1, 4, 0], goal: [4, 1]}")
    scenario = parse_scenario(f"world: !Maze {{family: open}}\nrobots: {robots}\n", name="balls")
    low, high = make_worlds_of_robots(scenario, 1)
    assert low.height == pytest.approx(0.13) and high.height > 0.15
    np.testing.assert_array_equal(low.spheres, high.spheres)


@pytest.mark.parametrize(
    ("robots", "said"),
    [
        (f"[{{{EAST}}}, {{start: [0.4, 0, 0], goal: [3, 1]}}]", "starts of starbot_1 and starbot_2 are 0.4 m apart"),
        (f"[{{{EAST}}}, {{start: [2, 1, 0], goal: [4, 0.3]}}]", "last goals of starbot_1 and starbot_2 are 0.3 m"),
        (f"[{{{EAST}}}, {{start: [5, 1, 0], goal: [2, 0]}}]", r"robot starbot_2: start is \[5, 1\]"),
    ],
)
def test_robots_that_cannot_drive_together_are_refused(robots: str, said: str) -> None:
    with pytest.raises(StarnavError, match=said):
        run_robots(parse_scenario(f"{WORLD}robots: {robots}", name="bad"))


def test_one_robot_alone_is_driven_otherwise() -> None:
    several = parse_scenario(PAIR, name="pair")
    with pytest.raises(StarnavError, match="scenario pair has 2 robots"):
        make_diagram(several)
    with pytest.raises(StarnavError, match="scenario starbot_1 has no robots"):
        run_robots(several.robots[0])
