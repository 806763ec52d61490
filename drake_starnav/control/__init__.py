"""Guidance -> (v, omega)."""

import drake_starnav.utils.compilation  # noqa: F401  (shows what is compiled)
from drake_starnav.control.law import Command, ControlInput, Law
from drake_starnav.control.parameters import ControllerParameters
from drake_starnav.control.path_following import control_step, guiding_vector

__all__ = [
    "Command",
    "ControlInput",
    "ControllerParameters",
    "Law",
    "control_step",
    "guiding_vector",
]
