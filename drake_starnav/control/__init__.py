"""Guidance -> (v, omega)."""

from drake_starnav.control.inputs import ControllerInputs, Proposal
from drake_starnav.control.parameters import ControllerParameters
from drake_starnav.control.path_following import follow_guidance, guiding_vector

__all__ = ["ControllerInputs", "ControllerParameters", "Proposal", "follow_guidance", "guiding_vector"]
