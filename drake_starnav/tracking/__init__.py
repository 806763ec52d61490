"""Scans -> dynamic obstacles."""

from drake_starnav.tracking.kalman_tracks import Tracks
from drake_starnav.tracking.parameters import DynamicObstacleParameters

__all__ = [
    "DynamicObstacleParameters",
    "Tracks",
]
