"""The whole navigation loop as one Drake diagram."""

from drake_starnav.navigation.diagram import make_diagram
from drake_starnav.navigation.parts import Navigation, Parts
from drake_starnav.navigation.robot import Robot
from drake_starnav.navigation.wiring import add_navigation

__all__ = ["Navigation", "Parts", "Robot", "add_navigation", "make_diagram"]
