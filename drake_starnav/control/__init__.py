"""Guidance -> (v, omega)."""

from drake_starnav.control.inputs import ControllerInputs, Proposal
from drake_starnav.control.parameters import ControllerParameters
from drake_starnav.control.path_following import followed, guiding_vector

__all__ = [
    "ControllerInputs",
    "ControllerParameters",
    "Proposal",
    "followed",
    "guiding_vector",
]
