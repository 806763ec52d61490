"""What a certificate is, and the ones that are asked about every command."""

from collections.abc import Iterable
from typing import NamedTuple, Protocol

import numpy as np

from drake_starnav.control.braking_certificate import StarCertificate
from drake_starnav.control.footprint_certificate import FootprintCertificate
from drake_starnav.control.inputs import TrackedObstacles
from drake_starnav.control.motion import Actuation, Motion
from drake_starnav.control.moving_certificate import MovingCertificate
from drake_starnav.control.point_certificate import PointCertificate
from drake_starnav.regions.safe_region import CertifiedRegion


class Certificate(Protocol):
    """Decides about one motion. The shield sends a command only if every certificate accepts what follows from it.

    A motion ends with the robot at rest. If no later one is accepted, the robot follows its last one to the end: what
    holds of all motions that a certificate accepts holds at all times.
    """

    def accepts(self, motion: Motion) -> bool:
        """Whether the robot may move like this."""


class AnyOf(NamedTuple):
    """Accepts what one of some certificates accepts.

    Attributes:
        certificates: asked in this order.
    """

    certificates: tuple[Certificate, ...]

    def accepts(self, motion: Motion) -> bool:
        """Whether one of the certificates accepts the motion."""
        return any(certificate.accepts(motion) for certificate in self.certificates)


def accepted(motion: Motion, certificates: Iterable[Certificate]) -> bool:
    """Whether the wheels grip on a motion and all certificates accept it."""
    if not motion.grips:
        return False
    for certificate in certificates:  # noqa: SIM110 - all() of a generator costs more than some certificates
        if not certificate.accepts(motion):
            return False
    return True


def standard_certificates(
    star: CertifiedRegion,
    margin: float,
    actuation: Actuation,
    position: np.ndarray,
    tracked: TrackedObstacles | None = None,
) -> tuple[Certificate, ...]:
    """The certificates for what the last scans show.

    In a static world a disc stays inside the star, and polygons keep clear of all surfaces; that the discs which cover
    them stay inside the star is enough, and decided faster. Among moving obstacles a disc must be able to leave it,
    past what stood between it and the place of the last scan; the lidars allowed there see nearly all around.

    Args:
        star: what the last scans certify.
        margin: kept to static obstacles, m.
        actuation: what commands do.
        position: of the robot, shape (2,), W, m.
        tracked: the moving obstacles; None in a static world.
    """
    inside, footprint = StarCertificate(star), actuation.footprint
    if footprint.is_disc and tracked is None:
        return (inside,)
    if footprint.is_disc:
        beside: Certificate = PointCertificate(star, margin, footprint.radius)
    else:
        beside = FootprintCertificate(star, margin, footprint)
    kept = (AnyOf((inside, beside)),)
    return kept if tracked is None else (*kept, MovingCertificate.near(tracked, position, actuation))
