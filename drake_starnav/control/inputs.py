"""What a controller is given."""

from typing import NamedTuple

import numpy as np

from drake_starnav.planning.guidance import Guidance
from drake_starnav.regions.safe_region import CertifiedRegion
from drake_starnav.tracking.kalman_tracks import Tracks
from drake_starnav.tracking.parameters import DynamicObstacleParameters


class ControllerInputs(NamedTuple):
    """What a controller is given.

    Attributes:
        pose: (x, y, yaw) of the robot in W, m and rad.
        twist: (v, omega) commanded last, m/s and rad/s.
        guidance: where to go.
        star: what the last scans certify.
    """

    pose: np.ndarray
    twist: np.ndarray
    guidance: Guidance
    star: CertifiedRegion


class Proposal(NamedTuple):
    """What a controller proposes; the shield decides what is driven of it.

    Attributes:
        twist: desired (v, omega), m/s and rad/s.
        guiding_vector: unit vector that it follows, shape (2,), W; zero when there is nowhere to go.
    """

    twist: np.ndarray
    guiding_vector: np.ndarray


class TrackedObstacles(NamedTuple):
    """The moving obstacles as of the last scan.

    Attributes:
        tracks: of the last scan.
        age: time since that scan, s.
        parameters: what is declared about moving obstacles.
    """

    tracks: Tracks
    age: float
    parameters: DynamicObstacleParameters
