"""Where to go next -> (v, omega)."""

from drake_starnav.control.parameters import ControllerParameters
from drake_starnav.control.path_following import Command, control_step, guiding_vector

__all__ = [
    "Command",
    "ControllerParameters",
    "control_step",
    "guiding_vector",
]
