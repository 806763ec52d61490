"""Scans -> dynamic obstacles."""

from drake_starnav.tracking.kalman_tracks import Tracks
from drake_starnav.tracking.parameters import MoverParameters

__all__ = [
    "MoverParameters",
    "Tracks",
]
