"""Scans -> dynamic obstacles."""

from drake_starnav.tracking.kalman_tracks import Tracks
from drake_starnav.tracking.parameters import DynamicObstacleParameters

__all__ = [
    "DynamicObstacleParameters",
    "Tracks",
]

import drake_starnav.utils.compilation  # noqa: F401  (shows what is compiled)
