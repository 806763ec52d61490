"""The goal of a live run stays where the world has it until a slider is moved."""

import numpy as np
import pytest
from pydrake.geometry import Meshcat, MeshcatParams
from pydrake.systems.analysis import Simulator

from drake_starnav.visualization.goal_sliders import SliderGoal, add_goal_sliders
from drake_starnav.worlds.world import World

WORLD = World("open", (0, 0, 0), (1.2345, -0.5678), bounds=(-1.0, -2.0, 6.0, 2.0))


def test_the_goal_is_the_worlds_until_a_slider_moves() -> None:
    meshcat = Meshcat(MeshcatParams(host="localhost", show_stats_plot=False))
    system = SliderGoal(WORLD.goal, add_goal_sliders(meshcat, WORLD), period=0.1)
    simulator = Simulator(system)
    port = system.GetOutputPort("goal")
    simulator.AdvanceTo(1.0)
    assert np.array_equal(port.Eval(simulator.get_context()), WORLD.goal)
    meshcat.SetSliderValue("goal x", 4.0)
    simulator.AdvanceTo(1.25)
    assert port.Eval(simulator.get_context()) == pytest.approx([4.0, WORLD.goal[1]], abs=0.005)
