"""What a certificate is, and what it takes that all accept a motion."""

from collections.abc import Iterable
from typing import Protocol

from drake_starnav.robot.motion import Motion


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
