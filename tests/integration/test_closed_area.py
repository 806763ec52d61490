"""An area that only a certificate closes: the planner does not know it, but finds another way."""

import numpy as np
import pytest

from drake_starnav.control import KeepOut
from drake_starnav.navigation import Parts
from drake_starnav.scenario.scenario_file import load_scenario
from drake_starnav.simulation.run import run_trial

pytestmark = pytest.mark.slow


def test_a_robot_that_the_shield_keeps_out_of_an_area_drives_round_it() -> None:
    scenario = load_scenario("forest", overrides=["simulation.timeout=90"])
    world = scenario.world.make(np.random.default_rng(1), scenario.robot.radius)
    start, goal = np.array(world.start[:2]), np.array(world.goal)
    ahead = (goal - start) / np.hypot(*(goal - start))
    sides = np.array(((0.3, 0.9), (-0.3, 0.9), (-0.3, -0.9), (0.3, -0.9)))
    area = 0.5 * (start + goal) + sides @ np.array((ahead, (-ahead[1], ahead[0])))
    assert run_trial(scenario, Parts(world, certificates=(KeepOut(area),)), seed=1).outcome == "reached"
