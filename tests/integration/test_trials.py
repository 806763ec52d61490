"""The figures of a trial: its score, its shortest path, its goals."""

import math

import numpy as np
import pytest

from drake_starnav.errors import StarnavError
from drake_starnav.navigation import make_diagram
from drake_starnav.scenario.scenario_file import load_scenario, parse_scenario
from drake_starnav.simulation.run import run_trial
from drake_starnav.simulation.trial import compute_benchmark_score, find_omniscient_path
from drake_starnav.systems.goal_sequence import HEADING_TOLERANCE
from drake_starnav.worlds import World

SMALL = "world: !Obstacles {bounds: [-1, -2, 5, 2], cylinders: [[1.7, 0.1, 0.4]], goal: [3.5, 0.0]}\n"


@pytest.mark.parametrize(
    ("outcome", "time", "score"),
    [
        ("reached", 3.0, 0.5),
        ("reached", 10.0, 0.5),
        ("reached", 20.0, 0.25),
        ("reached", 90.0, 0.125),
        ("collision", 3.0, 0.0),
        ("timeout", 100.0, 0.0),
    ],
)
def test_benchmark_score(outcome: str, time: float, score: float) -> None:
    assert compute_benchmark_score(outcome, time, optimal_time=5.0) == pytest.approx(score)
    assert compute_benchmark_score(outcome, time, None) is None


def test_a_shipped_world_is_crossed_at_speed() -> None:
    trial = run_trial(load_scenario("barn", overrides=["world.id=10"]), seed=0)
    assert trial.outcome == "reached" and trial.score > 0.4  # the tightest of the shipped worlds
    assert trial.min_clearance_m > 0.007
    assert trial.mean_speed_mps > 0.8


def test_a_robot_that_drifts_ends_at_its_goal() -> None:
    """By odometry alone it ends where it believes the goal to be; the scans tell it where the goal is."""
    ends = {}
    for matching in ("true", "false"):
        overrides = ["localization.drift=0.1", f"localization.matching={matching}"]
        trial = run_trial(parse_scenario(SMALL, overrides=overrides, name="small"), seed=4)
        assert trial.outcome == "reached"
        ends[matching] = np.hypot(*(np.array(trial.path[-1]) - (3.5, 0.0)))
    assert ends["true"] < 0.35 < ends["false"]


def test_a_large_world_is_searched_on_a_coarser_grid():
    world = World(
        "field", (1.0, 1.0, 0.0), (190.0, 190.0), cylinders=np.array(((95.0, 95.0, 1.0),)), bounds=(0, 0, 200, 200)
    )
    found = find_omniscient_path(world, 0.25)
    assert found is not None and found[0] == pytest.approx(189.0 * math.sqrt(2.0), rel=0.001)


def test_a_robot_visits_its_goals_in_order_and_turns_to_the_last_heading() -> None:
    text = SMALL + "goals: [[3.5, 0], [3.5, 1.2], [2.5, 1.2, -1.57]]"
    poses = {}

    class Watch:
        def add_to(self, builder, navigation, scenario) -> None:
            pass

        def finish(self, lines, motion) -> None:
            poses["end"], poses["motion"] = motion.at(motion.duration), motion

    trial = run_trial(parse_scenario(text, name="round"), observer=Watch())
    assert trial.outcome == "reached" and len(trial.goals_s) == 3
    assert trial.goals_s == sorted(trial.goals_s) and trial.goals_s[-1] <= trial.time_s
    for time, goal in zip(trial.goals_s, ((3.5, 0.0), (3.5, 1.2), (2.5, 1.2)), strict=True):
        assert math.dist(poses["motion"].at(time)[:2], goal) < 0.31
    assert abs(math.remainder(poses["end"][2] + 1.57, 2.0 * math.pi)) < HEADING_TOLERANCE + 0.02
    assert trial.straight_line_m == pytest.approx(3.5 + 1.2 + 1.0)
    assert trial.shortest_path_m > trial.straight_line_m


def test_a_goal_that_cannot_be_driven_to_is_refused() -> None:
    scenario = parse_scenario(SMALL + "goals: [[3.5, 0, 1]]", name="refused", overrides=["goals=[[1.7, 0.1]]"])
    with pytest.raises(StarnavError, match=r"goals\[0\] is \[1.7, 0.1\], inside cylinders"):
        make_diagram(scenario)
