"""The worlds of arXiv 2403.11484: what stands in them, where drives begin and end, and the dead end of the room."""

import numpy as np
import pytest

from drake_starnav import load_scenario, run_trial
from drake_starnav.worlds import PaperForest, PaperMaze, PaperRoom, make_world


def test_the_forest_has_the_authors_cylinders_and_ranges():
    for seed in range(10):
        world = make_world(PaperForest(), seed, 0.2)
        assert world.cylinders.shape == (11, 3) and (world.cylinders[:, 2] == 0.5).all()
        assert world.bounds == (-4.01, -1.69, 5.02, 3.51)
        assert -3.6 <= world.start[0] <= -2.7 and -1.35 <= world.start[1] <= 3.2
        assert 4.5 <= world.goal[0] <= 4.8 and -1.35 <= world.goal[1] <= 3.2


def test_the_maze_has_the_authors_obstacles_and_ranges():
    in_first, in_second = 0, 0
    for seed in range(40):
        world = make_world(PaperMaze(), seed, 0.2)
        assert (len(world.polygons), len(world.cylinders), len(world.spheres)) == (19, 1, 1)
        sides = [np.hypot(*(polygon - np.roll(polygon, 1, axis=0)).T) for polygon in world.polygons]
        assert sum(np.isclose(side.min(), 0.15) for side in sides) == 18  # walls; the last is a box
        assert np.isclose(world.polygons[0].mean(axis=0), (-0.447079, 2.4458)).all()
        assert -3.53 <= world.start[0] <= -1.76 and 0.372 <= world.start[1] <= 1.0
        x, y = world.goal
        first, second = 3.9 <= x <= 4.78 and -1.37 <= y <= 2.0, 1.13 <= x <= 4.78 and -1.37 <= y <= -0.9
        assert first or second
        in_first, in_second = in_first + (first and not second), in_second + (second and not first)
    assert in_first and in_second


@pytest.mark.parametrize(
    ("method", "seed"),
    [
        ("star", 0),
        *(pytest.param("star", seed, marks=pytest.mark.slow) for seed in range(1, 10)),
    ],
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
