"""Our own worlds of the DynaBARN benchmark's kind: the same from the same seed, of its sizes and speeds."""

import json

import numpy as np
import pytest

from drake_starnav.utils.resources import model_path
from drake_starnav.worlds import DynaBarn, clearance, make_world
from drake_starnav.worlds.moving_obstacles import moving_obstacle_clearance
from scripts.maintenance.make_dynabarn_worlds import GOAL, START, file_text


def test_the_shipped_file_is_what_its_script_writes() -> None:
    shipped, few = json.loads(model_path("worlds", "dynabarn_like.json").read_text()), json.loads(file_text(2, seed=0))
    assert shipped["meta"]["source"] == "scripts/maintenance/make_dynabarn_worlds.py --worlds 12 --seed 0"
    assert few["worlds"] == shipped["worlds"][:2]
    assert few["trajectories"].items() <= shipped["trajectories"].items()


@pytest.mark.parametrize("number", range(12))
def test_the_start_is_never_run_over_and_speeds_are_the_benchmarks(number: int) -> None:
    world = make_world(DynaBarn(id=number), 3, 0.25)
    assert (world.start, world.goal) == (START, GOAL)
    assert 5 <= len(world.moving_obstacles) <= 19
    assert 0.5 <= world.moving_obstacles.max_speed <= 2.0
    times = np.arange(0.0, 100.0, 0.1)
    assert moving_obstacle_clearance(world.moving_obstacles, np.tile(START, (len(times), 1)), times).min() > 0.45
    assert clearance(world, np.array([world.goal]))[0] > 0.7
