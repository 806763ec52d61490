"""What a certificate is, and the ones that are asked about every command."""

from collections.abc import Iterable
from typing import Protocol

import numpy as np

from drake_starnav.robot.motion import Actuation, Motion
from drake_starnav.safety.clear import Clear
from drake_starnav.safety.moving_certificate import MovingCertificate
from drake_starnav.surroundings.surroundings import Surroundings
from drake_starnav.tracking.tracker import TrackedObstacles


class Certificate(Protocol):
    """Decides about one motion. The shield sends a command only if every certificate accepts what follows from it.

    A motion ends with the robot at rest. If no later one is accepted, the robot follows its last one to the end: what
    holds of all motions that a certificate accepts holds at all times.
    """

    def accepts(self, motion: Motion) -> bool:
        """Return whether the robot may move like this."""


def all_accept(motion: Motion, certificates: Iterable[Certificate]) -> bool:
    """Return whether the wheels grip on a motion and all certificates accept it."""
    if not motion.grips:
        return False
    for certificate in certificates:  # noqa: SIM110 - all() of a generator costs more than some certificates
        if not certificate.accepts(motion):
            return False
    return True


def make_standard_certificates(
    surroundings: Surroundings,
    margin: float,
    actuation: Actuation,
    position: np.ndarray,
    tracked: TrackedObstacles | None = None,
) -> tuple[Certificate, ...]:
    """Return the certificates for what the last scans show.

    Args:
        surroundings: what is known of the space around the robot.
        margin: kept to static obstacles, m.
        actuation: what commands do.
        position: of the robot, shape (2,), W, m.
        tracked: the moving obstacles; None in a static world.
    """
    clear = Clear(surroundings, margin, actuation.footprint)
    return (clear,) if tracked is None else (clear, MovingCertificate.near(tracked, position, actuation))
