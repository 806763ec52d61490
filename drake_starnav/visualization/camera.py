"""Camera presets of a recording."""

import math

import numpy as np

from drake_starnav.errors import StarnavError, shown

FIELD_OF_VIEW = 20.0
"""Of the camera, deg; narrow, so that tall obstacles seen from above hide little."""
PAGE = (1100.0, 800.0)
"""Width and height of a page of the size for which pictures are taken, pixels."""
PANEL_WIDTH, BAR_HEIGHT = 225.0, 40.0
"""Width of the panel on the page's left and height of the bar at its bottom, pixels; the scene has the rest."""
SCENE = (PAGE[0] - PANEL_WIDTH, PAGE[1] - BAR_HEIGHT)
"""Width and height of the scene, pixels."""
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


def camera_pose(extent: Extent, view: str = "top") -> tuple[np.ndarray, np.ndarray]:
    """Position and target of a camera for which a box of the floor fills the scene of a page of the size `PAGE`.

    The page's script does the same for any size.

    Args:
        extent: the box, (x_min, y_min, x_max, y_max), W, m; its longer side lies across.
        view: `top`, straight down, `oblique` or `follow`, from the side.

    Returns:
        position and target, each of shape (3,), W, m.

    Raises:
        StarnavError: unknown view.
    """
    check_view(view)
    size = np.array([extent[2] - extent[0], extent[3] - extent[1]])
    middle = np.array([0.5 * (extent[0] + extent[2]), 0.5 * (extent[1] + extent[3])])
    up = np.array([0.0, 1.0])
    if size[1] > size[0]:
        up, size = np.array([-1.0, 0.0]), size[::-1]
    tilt = math.radians(TILTS[view])
    half_angle = math.tan(math.radians(0.5 * FIELD_OF_VIEW))
    # The scene shows `high` metres from its lower to its upper rim at the target; more, as the near rim looks wider.
    high = SPARE * max(math.cos(tilt) * size[1], size[0] * SCENE[1] / SCENE[0])
    distance = 0.5 * high / half_angle + 0.5 * math.sin(tilt) * size[1] + TALL
    position = np.append(middle - distance * math.sin(tilt) * up, distance * math.cos(tilt))
    return position, np.append(middle, 0.0)


def check_view(view: str) -> None:
    """Raise `StarnavError` for an unknown view."""
    if view not in VIEWS:
        raise StarnavError(f"camera view is {shown(view)}; allowed: one of {', '.join(VIEWS)}")
