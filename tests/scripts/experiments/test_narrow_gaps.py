"""The worlds in which robots that are no discs are measured: gaps too narrow to turn in, and pockets."""

import numpy as np
import pytest

from drake_starnav.scenario.scenario_file import parse_scenario
from drake_starnav.worlds.clearance import body_clearance
from scripts.experiments.giving_up import has_way
from scripts.experiments.narrow_gaps import (
    DEAD_ENDS,
    FREE_START,
    SIZES,
    TREES,
    WALLS,
    dead_end_world,
    gap_world,
    report,
    robot,
)


@pytest.mark.parametrize("name", SIZES)
@pytest.mark.parametrize("kind", [WALLS, TREES, DEAD_ENDS])
def test_the_robot_starts_free_and_does_not_fit_turned(kind, name):
    shape = parse_scenario(f"world: !Forest {{}}\nrobot: {robot(name)}", name=name).robot.shape
    world = dead_end_world(name, 0) if kind == DEAD_ENDS else gap_world(kind, name, 0)
    assert body_clearance(world, np.array((world.start,)), shape)[0] > FREE_START
    assert not has_way(world, shape.radius)


def test_the_report_names_what_failed():
    record = {"kind": WALLS, "robot": "jackal", "seed": 3, "outcome": "reached", "time_s": 5.0, "min_clearance_m": 0.02}
    text = report([record, {**record, "seed": 4, "outcome": "timeout", "time_s": 120.0}])
    assert "1 of 2 reached, 0 contacts" in text and "jackal 4: timeout" in text
