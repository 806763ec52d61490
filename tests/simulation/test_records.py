"""The record and the recording of a run, be it of one robot or of several."""

import dataclasses

import numpy as np
import pytest

from drake_starnav import parse_scenario, run_trial
from drake_starnav.geometry.trajectory import Motion
from drake_starnav.simulation.records import make_robots_record, record_comparison
from drake_starnav.simulation.robots import RobotTrial
from drake_starnav.simulation.trial import make_trial_record

WORLD = "world: !Obstacles {bounds: [-1, -2, 5, 2], goal: [4, 0]}\nsimulation: {timeout: 0.2}\n"


@pytest.mark.parametrize(
    ("ends", "decides"),
    [
        ([("reached", 5.0), ("reached", 9.0)], 1),
        ([("timeout", 20.0), ("reached", 9.0)], 0),
        ([("timeout", 20.0), ("collision", 9.0), ("blocked", 20.0)], 1),
        ([("interrupted", 3.0), ("reached", 2.0)], 0),
    ],
)
def test_who_arrives_last_or_not_at_all_decides(ends: list[tuple[str, float]], decides: int) -> None:
    one = run_trial(parse_scenario(WORLD, name="one"))
    still = Motion(np.zeros(1), np.zeros((1, 3)))
    trials = [
        RobotTrial(f"r{k}", dataclasses.replace(one, outcome=outcome, time_s=time), 1.0 - 0.1 * k, still)
        for k, (outcome, time) in enumerate(ends)
    ]
    record = make_robots_record(trials)
    assert (record["outcome"], record["time_s"]) == ends[decides]
    assert record["min_gap_m"] == trials[-1].min_gap_m
    assert record.keys() - {"robots", "min_gap_m"} == make_trial_record(one).keys()


POST = "world: !Obstacles {bounds: [-1, -2, 5, 2], cylinders: [[1.5, 0.1, 0.3]], goal: [3.5, 0.0]}\n"
METHODS = ("star", "star_paper")


def test_each_of_the_compared_methods_is_recorded_where_it_drove(tmp_path) -> None:
    scenarios = {method: parse_scenario(POST, name="post", method=method) for method in METHODS}
    recorded = record_comparison(scenarios, 0, tmp_path / "two.html")
    labels = [layer.label for layer in recorded.caption.legend.values() if ": reached in" in layer.label]
    for method, motion, label in zip(METHODS, recorded.motions, labels, strict=True):
        trial = run_trial(scenarios[method], method=method)
        assert label.startswith(f"{method}: ")
        assert motion.poses[-1, :2] == pytest.approx(trial.path[-1], abs=0.02)
    first, second = (motion.at(4.0)[:2] for motion in recorded.motions)
    assert np.hypot(*(first - second)) > 0.3
