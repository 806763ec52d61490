"""The sweep is exact, and the certificate sound where it is asked in few scenes."""

import math

import numpy as np
import pytest
import shapely

from drake_starnav.geometry.footprint import covered
from scripts.experiments.footprint_soundness import SHAPES, least_distance, scenario_of, tried


@pytest.mark.parametrize("robot", SHAPES)
def test_few_commands_lead_to_no_contact_and_are_accepted_where_they_are_safe(robot: str) -> None:
    outcomes = [outcome for seed in range(4) for outcome in tried(scenario_of(robot), seed, 30)]
    accepted = [outcome for outcome in outcomes if outcome.accepts]
    assert len(accepted) > 20
    assert min(outcome.least for outcome in accepted) > 0.0
    assert np.mean([outcome.accepts for outcome in outcomes if outcome.safe and outcome.exact] or [True]) > 0.9


@pytest.mark.parametrize("robot", SHAPES)
def test_the_least_distance_is_that_of_the_shapes(robot: str) -> None:
    rng, shape = np.random.default_rng(3), scenario_of(robot).robot.shape
    for _ in range(40):
        pose = np.array((*rng.uniform(-1.0, 1.0, 2), rng.uniform(-math.pi, math.pi)))
        segments, discs = (
            rng.uniform(-1.5, 1.5, (2, 4)),
            np.array(((*rng.uniform(-1.5, 1.5, 2), rng.uniform(0.02, 0.3)),)),
        )
        body = covered(shape, pose)
        exact = min(
            *(shapely.distance(body, shapely.LineString(each.reshape(2, 2))) for each in segments),
            max(shapely.distance(body, shapely.Point(*discs[0, :2])) - discs[0, 2], 0.0),
        )
        assert least_distance(pose[None], shape.parts, shape.radius, segments, discs) == pytest.approx(exact, abs=2e-3)
