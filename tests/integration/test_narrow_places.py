"""Passages that leave the robot little room, and goals close to walls, driven with rigid bodies."""

import pytest

from drake_starnav.scenario.scenario_file import load_scenario
from drake_starnav.simulation.run import run_trial
from drake_starnav.worlds.generators import channel

pytestmark = pytest.mark.slow


def trial(scenario: str, seed: int, *overrides: str):
    return run_trial(load_scenario(scenario, overrides=overrides), seed=seed)


@pytest.mark.parametrize(
    ("shape", "seed"), [("serpentine", 3), ("spiral", 7), ("u_turn", 11), ("any", 3081312463)], ids=str
)
def test_a_winding_passage_that_leaves_35_mm_on_each_side_is_driven_through(
    shape: str, seed: int, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(channel, "_LANES", (3, 4))
    driven = trial("channel", seed, f"world.shape={shape}", "world.clearance=0.035")
    assert driven.outcome == "reached"


def test_a_straight_passage_is_not_crept_through(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(channel, "_LENGTHS", (10.0, 10.0))
    driven = trial("channel", 0, "world.shape=corridor", "world.clearance=0.035")
    assert driven.outcome == "reached" and driven.mean_speed_mps > 0.3


@pytest.mark.parametrize("place", ["wall", "corner", "niche"])
def test_a_goal_close_to_a_wall_is_not_driven_past(place: str) -> None:
    near, far = (
        trial("rooms", 2, f"world.goal={place}", f"world.goal_clearance={clearance}") for clearance in (0.01, 0.1)
    )
    assert near.outcome == far.outcome == "reached"
    assert near.path_length_m < 1.1 * far.path_length_m


def test_a_rectangle_whose_odometry_drifts_passes_doors() -> None:
    rectangle = "[[0.254, 0.215], [-0.254, 0.215], [-0.254, -0.215], [0.254, -0.215]]"
    shape = "robot.model=jackal", f"robot.footprint={rectangle}", "world.door=0.9"
    driven = trial("rooms", 1, *shape, "localization.drift=0.02", "simulation.timeout=90")
    assert driven.outcome == "reached" and driven.stuck_s < 2.0
