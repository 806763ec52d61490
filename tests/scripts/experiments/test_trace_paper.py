"""What holds a robot that is stuck is found from its inputs, and counted by scenario and outcome."""

import numpy as np
import pytest

from drake_starnav.baselines.paper import constants
from drake_starnav.control.inputs import ControllerInputs
from drake_starnav.planning.guidance import Guidance
from drake_starnav.surroundings.safe_region import CertifiedRegion
from scripts.experiments import trace_paper
from tests.helpers.scans import RADIUS, smooth_region


@pytest.mark.parametrize(
    ("hit", "expected"),
    [
        ((1.0, 0.5 * RADIUS), "midpoint"),
        ((0.0, RADIUS + constants.RHO), "blend"),
        ((0.0, RADIUS + 10.0 * constants.RHO), "other"),
    ],
)
def test_the_cause_is_what_the_nearest_hit_does(hit, expected) -> None:
    star = CertifiedRegion.none()
    object.__setattr__(star, "near_hits", np.array([hit]))
    inputs = ControllerInputs(np.zeros(3), np.zeros(2), Guidance.along([(1.0, 0.0)]), star)
    assert trace_paper.cause(inputs, RADIUS) == expected


def test_at_the_boundary_the_modulation_holds_the_robot() -> None:
    region = smooth_region(np.random.default_rng(1), np.zeros(2))
    theta = 0.3
    ray = np.array((np.cos(theta), np.sin(theta)))
    pose = np.append(0.999 * float(region.phi(theta)) * ray, 0.0)
    guidance = Guidance.along([pose[:2] + ray], [region])
    inputs = ControllerInputs(pose, np.zeros(2), guidance, CertifiedRegion.none())
    assert trace_paper.cause(inputs, RADIUS) == "modulation"


def test_trials_are_counted_by_scenario_and_outcome() -> None:
    results = [("maze", "reached", []), ("maze", "timeout", ["blend", "blend"]), ("maze", "timeout", ["other"])]
    rows = [[cell.strip() for cell in row.split("|")[1:-1]] for row in trace_paper.table(results).splitlines()[2:]]
    assert rows == [["maze", "reached", "1", *["0.0"] * 4], ["maze", "timeout", "2", "0.0", "1.0", "0.0", "0.5"]]
