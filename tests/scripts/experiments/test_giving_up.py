"""The worlds of the experiment on giving up, and its report."""

import pytest

from drake_starnav.worlds.shortest_path import shortest_path
from scripts.experiments.giving_up import CLOSED, LEAST, RADIUS, SOLVABLE, closed_world, has_way, report, solvable_world


@pytest.mark.parametrize("kind", CLOSED)
def test_the_robot_does_not_fit_into_a_closed_world(kind: str) -> None:
    world = closed_world(kind, 3)
    assert shortest_path(world, RADIUS) is None and shortest_path(world, 0.5 * RADIUS) is not None


@pytest.mark.parametrize("kind", SOLVABLE)
def test_the_robot_hardly_fits_into_a_solvable_world(kind: str) -> None:
    world = solvable_world(kind, 3)
    assert has_way(world, LEAST) and not has_way(world, RADIUS + 0.04)


def test_a_report_names_what_is_wrong_and_what_is_late() -> None:
    record = {"kind": "poles", "seed": 1, "closed": True, "outcome": "unreachable", "time_s": 20.0, "seen_s": 10.0}
    record |= {"nodes": 30, "area_m2": 60.0}
    late = {**record, "seed": 2, "time_s": 40.0}
    wrong = {**record, "kind": "channel", "seed": 3, "closed": False}
    text = report([record, late, wrong])
    assert "closed: 2 of 2 given up, 1 of them late" in text and "solvable: 1, 1 unreachable" in text
    assert "poles 2: late" in text and "channel 3: unreachable" in text and "poles 1" not in text
