"""Guidance -> (v, omega)."""

import drake_starnav.utils.compilation  # noqa: F401  (shows what is compiled)
from drake_starnav.control.certificates import Certificate
from drake_starnav.control.inputs import ControllerInputs, Proposal
from drake_starnav.control.motion import BrakingMotion, Motion
from drake_starnav.control.parameters import ControllerParameters
from drake_starnav.control.path_following import followed, guiding_vector
from drake_starnav.control.zones import KeepOut, SpeedZone

__all__ = [
    "BrakingMotion",
    "Certificate",
    "ControllerInputs",
    "ControllerParameters",
    "KeepOut",
    "Motion",
    "Proposal",
    "SpeedZone",
    "followed",
    "guiding_vector",
]
