"""Obstacles that move: seeing, tracking and avoiding them."""

from drake_starnav.movers.parameters import MoverParameters
from drake_starnav.movers.tracks import Tracks

__all__ = ["MoverParameters", "Tracks"]
