"""Camera presets of a recording, which the page's script takes."""

import numpy as np

from drake_starnav.errors import StarnavError, shown

PAGE = (1100.0, 800.0)
"""Width and height of a page of the size for which pictures are taken, pixels."""
VIEWS = ("top", "follow", "oblique")
"""Names of the presets; page.js says how each looks down."""
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
