"""Recordings and comparisons show obstacles that move where they were."""

import numpy as np
import pytest

from drake_starnav.scenario.scenario_file import parse_scenario
from drake_starnav.simulation.records import record_comparison
from drake_starnav.simulation.run import run_trial
from drake_starnav.visualization.meshes import LAYERS, MOVING_OBSTACLES, ROBOT, add_scene_layers
from drake_starnav.visualization.plot import draw_moment
from drake_starnav.visualization.recorder import Recorder
from drake_starnav.worlds import Crowd, World, make_world, moving_obstacle_states
from tests.helpers.camera import plotted

pytestmark = pytest.mark.slow

TEXT = "world: !Crowd {moving_obstacles: [4, 4]}\nsimulation: {timeout: 2.5}\n"
SEED = 1
TIMES = (0.0, 2.0)


@pytest.fixture(scope="module")
def recorded(tmp_path_factory):
    """The world of a trial and a comparison, and what was recorded of each."""
    folder = tmp_path_factory.mktemp("moving")
    scenario = parse_scenario(TEXT, name="moving")
    recorder = Recorder(folder / "one.html")
    run_trial(scenario, seed=SEED, observer=recorder)
    recorded = record_comparison({"star": scenario}, SEED, folder / "two.html")
    world = make_world(scenario.world, SEED, scenario.robot.radius)
    return world, recorder.recorded, recorded


def rears(world: World, time: float) -> np.ndarray:
    """A place (n, 2) on each moving obstacle, W, m, behind its middle, where the arrow of its velocity begins."""
    (positions,), (velocities,) = moving_obstacle_states(world.moving_obstacles, np.array([time]))
    speed = np.maximum(np.hypot(*velocities.T), 1e-9)
    return positions - (0.6 * world.moving_obstacles.radii / speed)[:, None] * velocities


@pytest.mark.parametrize("k", [0, 1])
@pytest.mark.parametrize("time", TIMES)
def test_plot_shows_moving_obstacles(recorded, k: int, time: float) -> None:
    world, recorded = recorded[0], recorded[1 + k]
    picture = draw_moment(recorded, time)
    image = np.asarray(picture, dtype=float) / 255.0
    for place in rears(world, time):
        assert image[plotted(recorded, place, picture)] == pytest.approx(MOVING_OBSTACLES.color, abs=0.02)


def test_legend_names_moving_obstacles_only_if_any() -> None:
    nobody = make_world(Crowd(moving_obstacles=(0, 0)), 0, 0.25)
    assert add_scene_layers(LAYERS, nobody) == {**LAYERS, "robot": ROBOT}
    assert MOVING_OBSTACLES in add_scene_layers(LAYERS, make_world(Crowd(), 0, 0.25)).values()
