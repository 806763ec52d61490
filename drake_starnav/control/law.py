"""The interface of a control law: what it is given each period, and what it commands."""

from collections.abc import Callable
from typing import NamedTuple

import numpy as np

from drake_starnav.control.parameters import ControllerParameters
from drake_starnav.planning.guidance import Guidance
from drake_starnav.regions.safe_region import SafetyStar
from drake_starnav.robot import RobotParameters
from drake_starnav.tracking.kalman_tracks import Tracks
from drake_starnav.tracking.parameters import DynamicObstacleParameters


class ControlInput(NamedTuple):
    """What a control law is given each period.

    Attributes:
        pose: (x, y, yaw) of the robot in W, m and rad.
        twist: (v, omega) commanded last, m/s and rad/s.
        errors: (v, heading) errors of the last command.
        guidance: where to go.
        star: what the last scans certify.
    """

    pose: np.ndarray
    twist: np.ndarray
    errors: np.ndarray
    guidance: Guidance
    star: SafetyStar


NO_ERRORS = np.zeros(2)
NO_ERRORS.flags.writeable = False


class Command(NamedTuple):
    """What a control law decides in one period.

    Attributes:
        twist: (v, omega) to be reached by the end of the period, within the limits, m/s and rad/s.
        guiding_vector: unit vector, shape (2,), W; zero when there is nowhere to go.
        certified: whether some motion passed the certificate.
        errors: (v, heading) errors, for a law with derivative terms.
    """

    twist: np.ndarray
    guiding_vector: np.ndarray
    certified: bool
    errors: np.ndarray = NO_ERRORS


class TrackedObstacles(NamedTuple):
    """The dynamic obstacles as of the last scan.

    Attributes:
        tracks: of the last scan.
        age: time since that scan, s.
        parameters: what is declared about dynamic obstacles.
    """

    tracks: Tracks
    age: float
    parameters: DynamicObstacleParameters


Law = Callable[[ControlInput, ControllerParameters, RobotParameters], Command]
"""One period of a controller as a pure function, as `path_following.control_step`."""
