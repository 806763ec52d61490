"""What the control law is given."""

import numpy as np

from drake_starnav.control import ControllerInputs, follow_guidance
from drake_starnav.planning.guidance import Guidance
from drake_starnav.robot import RobotParameters
from drake_starnav.surroundings.surroundings import Surroundings

ROBOT = RobotParameters()


def test_without_guidance_or_scans_the_law_stands_and_leaves_its_input_alone() -> None:
    arrays = np.zeros(3), np.zeros(2)
    proposal = follow_guidance(ControllerInputs(*arrays, Guidance.none(), Surroundings.unknown()), ROBOT)
    assert not proposal.twist.any() and not proposal.guiding_vector.any()
    assert not any(array.any() for array in arrays)
