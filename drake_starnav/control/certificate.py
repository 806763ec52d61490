"""What a controller guarantees."""

import numpy as np

from drake_starnav.utils.snapshot import snapshot


@snapshot
class Certificate:
    """What the controller guarantees about the robot's motion. Immutable.

    Attributes:
        certified: whether the last command passed the braking certificate; if not, it brakes.
        path: shape (n, 3), (x, y, yaw) in W of the robot braking fully from now on, m and rad.
    """

    certified: bool
    path: np.ndarray

    @staticmethod
    def none() -> "Certificate":
        """Before the first command, and of who guarantees nothing."""
        return Certificate(False, np.zeros((1, 3)))
