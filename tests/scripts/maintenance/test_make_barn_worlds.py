"""Our own worlds of the BARN benchmark's kind: the same from the same seed, and passable."""

import json

import numpy as np
import pytest

from drake_starnav.utils.resources import model_path
from drake_starnav.worlds import Barn, clearance, make_world, shortest_path
from scripts.maintenance.make_barn_worlds import file_text

RADIUS = 0.334


def test_the_shipped_file_is_what_its_script_writes() -> None:
    shipped = model_path("worlds", "barn_like.json").read_text(encoding="utf-8")
    content = json.loads(shipped)
    assert (
        content["meta"]["source"]
        == f"scripts/maintenance/make_barn_worlds.py --worlds {len(content['worlds'])} --seed 0"
    )
    few = json.loads(file_text(3, seed=0))["worlds"]
    assert few == content["worlds"][:3]


@pytest.mark.parametrize("number", range(4))
def test_passable_with_five_centimetres_to_spare(number: int) -> None:
    world = make_world(Barn(id=number), 0, RADIUS)
    assert shortest_path(world, RADIUS + 0.05) is not None
    assert clearance(world, np.array([world.start[:2], world.goal])).min() > 1.0
    length, path = shortest_path(world, RADIUS)
    assert world.optimal_time == pytest.approx(length / 2.0, abs=1e-3)
    assert -4.5 < path[:, 0].min() <= path[:, 0].max() < 0.0, "between the walls"
