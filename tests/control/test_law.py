"""Each control law keeps the one interface."""

import numpy as np
import pytest

from drake_starnav.baselines.sampling_mpc import predictive_step
from drake_starnav.control import ControllerParameters, control_step
from drake_starnav.control.law import Command, ControlInput, Law
from drake_starnav.planning.guidance import Guidance
from drake_starnav.regions.safe_region import SafetyStar
from drake_starnav.robot import RobotParameters


@pytest.mark.parametrize("law", [control_step, predictive_step])
def test_without_guidance_or_scans_each_law_stands_and_leaves_its_input_alone(law: Law) -> None:
    arrays = np.zeros(3), np.zeros(2), np.zeros(2)
    command = law(ControlInput(*arrays, Guidance.none(), SafetyStar.none()), ControllerParameters(), RobotParameters())
    assert isinstance(command, Command)
    assert not command.twist.any() and not command.guiding_vector.any()
    assert not any(array.any() for array in arrays)
