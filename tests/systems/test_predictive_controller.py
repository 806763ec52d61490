"""Predictive control through a context: within the limits, the same way each time, and never into the unseen."""

import numpy as np
import pytest
from pydrake.common.value import Value

from drake_starnav.control import ControllerParameters
from drake_starnav.planning.guidance import Guidance
from drake_starnav.regions.safe_region import CertifiedRegion
from drake_starnav.regions.star_region import united
from drake_starnav.robot import RobotParameters
from drake_starnav.systems.predictive_controller import PredictiveController
from drake_starnav.systems.twist_shield import TwistShield
from tests.helpers.controlling import Controlling
from tests.helpers.scans import MARGINS, smooth_region

ROBOT, PARAMETERS = RobotParameters(), ControllerParameters()
PERIOD = 1.0 / PARAMETERS.rate
WIDE = CertifiedRegion(np.zeros(2), 0.0, np.full(720, 5.0), np.zeros((0, 2)))
REGIONS = united([smooth_region(np.random.default_rng(0), np.zeros(2), mean=8.0)])
AHEAD = Guidance(np.array([[3.0, 0.5]]), False, REGIONS)


def twists(star: CertifiedRegion = WIDE, twist: tuple[float, float] = (0.0, 0.0), count: int = 60) -> np.ndarray:
    """The commands of some periods with fixed inputs."""
    inputs = {"guidance": Value(AHEAD), "certified_region": Value(star), "state": [0.0, 0.0, 0.0, *twist]}
    systems = PredictiveController(ROBOT, PARAMETERS, MARGINS), TwistShield(ROBOT, PARAMETERS, MARGINS)
    controlling = Controlling(*systems, inputs, twist)
    return np.array([twist, *(controlling.update() for _ in range(count))])


def test_it_drives_within_the_limits_and_the_same_way_each_time() -> None:
    driven = twists()
    steps = np.abs(np.diff(driven, axis=0))
    assert steps[:, 0].max() <= ROBOT.max_acceleration * PERIOD + 1e-12
    assert steps[:, 1].max() <= ROBOT.max_yaw_acceleration * PERIOD + 1e-12
    assert driven[-1, 0] > 0.5
    np.testing.assert_array_equal(twists(), driven)


def test_without_a_certified_region_it_brakes_as_hard_as_it_may() -> None:
    braked = twists(CertifiedRegion.none(), twist=(0.5, 0.4), count=40)
    assert braked[1] == pytest.approx((0.5 - PERIOD * ROBOT.max_acceleration, 0.4 - PERIOD * 4.0))
    assert braked[-1, 0] == 0.0
