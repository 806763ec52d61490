"""Each control law takes the same inputs."""

import numpy as np
import pytest

from drake_starnav.baselines.sampling_mpc import predictive_twist
from drake_starnav.control import ControllerInputs, Proposal, followed
from drake_starnav.planning.guidance import Guidance
from drake_starnav.regions.margins import Margins
from drake_starnav.regions.safe_region import CertifiedRegion
from drake_starnav.robot import RobotParameters
from tests.helpers.motions import actuation
from tests.helpers.scans import MARGINS

ROBOT = RobotParameters()


def predicted(inputs: ControllerInputs, margins: Margins, robot: RobotParameters) -> Proposal:
    return predictive_twist(inputs, (), actuation(robot), margins, robot)


@pytest.mark.parametrize("law", [followed, predicted])
def test_without_guidance_or_scans_each_law_stands_and_leaves_its_input_alone(law) -> None:
    arrays = np.zeros(3), np.zeros(2)
    proposal = law(ControllerInputs(*arrays, Guidance.none(), CertifiedRegion.none()), MARGINS, ROBOT)
    assert not proposal.twist.any() and not proposal.guiding_vector.any()
    assert not any(array.any() for array in arrays)
