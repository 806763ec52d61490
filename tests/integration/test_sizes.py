"""Robots of any size drive alike in worlds of their size: no length is tuned for one robot."""

import functools

import numpy as np
import pytest

from drake_starnav.loading import parse_scenario
from drake_starnav.scenario.margins import derive_margins
from drake_starnav.simulation.run import run_trial
from tests.helpers.sizes import driven_states, ratios, scaled_margins, sized

usual = functools.cache(functools.partial(ratios, scale=1.0))


@pytest.mark.parametrize("scale", [0.32, 4.0], ids=["radius 0.08 m", "radius 1 m"])
def test_a_small_and_a_large_robot_cross_a_room_like_the_usual_one(scale: float) -> None:
    seeds = range(1000, 1001)
    assert ratios("room", scale, seeds) == pytest.approx(usual("room", seeds=seeds), rel=0.05)


@pytest.mark.parametrize("scale", [0.25, 2.0])
@pytest.mark.parametrize(("name", "commands"), [("room", 400), ("maze", 600)])
def test_perception_planner_and_controller_know_no_length(name: str, commands: int, scale: float) -> None:
    """By powers of two, so that numbers are rounded alike; lengths that numerics ask for are below a millionth."""
    usual_size, other = (sized(name, each, 1000) for each in (1.0, scale))
    margins = derive_margins(usual_size)
    found = driven_states(other, scaled_margins(margins, scale), 1000, commands)
    for key, expected in driven_states(usual_size, margins, 1000, commands).items():
        units = np.array({"poses": (scale, scale, 1.0), "twists": (scale, 1.0)}.get(key, scale))
        np.testing.assert_allclose(found[key], expected * units, atol=1e-6 * scale, err_msg=key)


@pytest.mark.slow
@pytest.mark.parametrize("model", ["starbot", "carrier"])
def test_a_robot_that_gains_speed_slowly_is_not_given_up_meanwhile(model: str) -> None:
    """It took longer than `planner.progress_timeout` to get ahead, and its way was closed."""
    world = "{bounds: [-1.5, -2, 4, 2], cylinders: [[1.5, 0.1, 0.3]], start: [0, 0, 2.5], goal: [3, 0]}"
    robot = f"model: {model}, max_speed: 0.03, max_acceleration: 0.01, max_yaw_rate: 0.3, max_yaw_acceleration: 0.1"
    text = f"world: !Obstacles {world}\nrobot: {{{robot}}}\nsimulation: {{timeout: 300}}\n"
    trial = run_trial(parse_scenario(text, name="slow"), seed=1)
    assert trial.outcome == "reached"
    assert trial.path_length_m < 4.0
