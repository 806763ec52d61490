"""Camera presets of a recording, which the page's script takes."""

import numpy as np

from drake_starnav.errors import StarnavError, shown

FIELD_OF_VIEW = 20.0
"""Of the camera, deg; narrow, so that tall obstacles seen from above hide little."""
PAGE = (1100.0, 800.0)
"""Width and height of a page of the size for which pictures are taken, pixels."""
PANEL_WIDTH, BAR_HEIGHT = 225.0, 40.0
"""Width of the panel on the page's left and height of the bar at its bottom, pixels; the scene has the rest."""
SCALE_WIDTH = 120.0
"""Greatest width of the scale bar, pixels."""
SPARE = 1.04
"""The camera presets show this much more than their box."""
TALL = 0.5
"""The tops of obstacles of this height are seen as well, m."""
TILTS = {"top": 0.05, "follow": 35.0, "oblique": 50.0}
"""Angle of each preset's line of sight from straight down, deg; at 0 the direction "up" would be undefined."""
VIEWS = tuple(TILTS)
FOLLOWED = (9.0, 7.0)
"""Size of the box around the robot that the preset `follow` shows, m."""

Extent = tuple[float, float, float, float]


def around_robot(position: np.ndarray) -> Extent:
    """The box of the floor that `follow` shows: (x_min, y_min, x_max, y_max), W, m."""
    x, y, (width, depth) = *np.asarray(position, dtype=float)[:2], FOLLOWED
    return float(x - 0.5 * width), float(y - 0.5 * depth), float(x + 0.5 * width), float(y + 0.5 * depth)


def check_view(view: str) -> None:
    """Raise `StarnavError` for an unknown view."""
    if view not in VIEWS:
        raise StarnavError(f"camera view is {shown(view)}; allowed: one of {', '.join(VIEWS)}")
