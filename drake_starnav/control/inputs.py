"""What a controller is given, and what it proposes."""

from collections.abc import Callable
from typing import NamedTuple

import numpy as np

from drake_starnav.planning.guidance import Guidance
from drake_starnav.robot import RobotParameters
from drake_starnav.surroundings.surroundings import Surroundings


class ControllerInputs(NamedTuple):
    """What a controller is given.

    Attributes:
        pose: (x, y, yaw) of the robot in W, m and rad.
        twist: commanded last, as the base's twists are; see `robot.base`.
        guidance: where to go.
        surroundings: what is known of the space around the robot.
    """

    pose: np.ndarray
    twist: np.ndarray
    guidance: Guidance
    surroundings: Surroundings


class Proposal(NamedTuple):
    """What a controller proposes; the shield decides how much of it is driven.

    Attributes:
        twist: desired, as the base's twists are.
        guiding_vector: unit vector that it follows, shape (2,), W; zero when there is nowhere to go.
    """

    twist: np.ndarray
    guiding_vector: np.ndarray


Propose = Callable[[ControllerInputs, RobotParameters], Proposal]
"""A controller as a pure function, as `control.follow_guidance`."""
