"""The worlds of arXiv 2403.11484: what stands in them, where drives begin and end, and the dead end of the room."""

import numpy as np
import pytest

from drake_starnav import load_scenario, run_trial
from drake_starnav.worlds import PaperRoom, make_world


@pytest.mark.parametrize(
    ("method", "seed"), [("star", 0), *(pytest.param("star", seed, marks=pytest.mark.slow) for seed in range(1, 10))]
)
def test_in_the_room_the_robot_enters_the_dead_end_and_leaves_it(method, seed, tmp_path):
    scenario = load_scenario("paper_room", method=method)
    world = make_world(PaperRoom(), seed, 0.2)
    trial = run_trial(scenario, method=method, seed=seed, csv=tmp_path / "trail.csv")
    _, x, y, *_ = np.genfromtxt(tmp_path / "trail.csv", delimiter=",", skip_header=1).T
    sides = sorted(world.polygons[k][:, 0].mean() for k in (2, 6))  # of the pocket
    back = world.polygons[5][:, 1].mean()
    inside = (sides[0] < x) & (x < sides[1]) & (y > world.polygons[1][:, 1].max()) & (y < back)
    assert trial.outcome == "reached"
    assert 0.5 * (world.polygons[1][:, 1].max() + back) < y[inside].max()
    assert not inside[-1]
