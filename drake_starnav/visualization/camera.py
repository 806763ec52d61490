"""Camera presets of a recording."""

import math

import numpy as np

from drake_starnav.errors import StarnavError, shown
from drake_starnav.worlds.world import World

FIELD_OF_VIEW = 20.0
"""Of the camera, deg; narrow, so that tall obstacles seen from above hide little."""
PAGE = (1100.0, 800.0)
"""Width and height of the page for which the camera presets are made, pixels."""
PANEL_WIDTH = 225.0
"""Width that the camera presets leave free on the left for caption and legend, pixels."""
CONTROLS_WIDTH = 265.0
"""Width of Meshcat's own panel on the right, with a margin, pixels."""
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


def camera_pose(extent: Extent, view: str = "top", panel: str = "left") -> tuple[np.ndarray, np.ndarray]:
    """Position and target of a camera for which a box of the floor fills the page beside the panel.

    Args:
        extent: the box, (x_min, y_min, x_max, y_max), W, m; its longer side lies across.
        view: `top`, straight down, `oblique` or `follow`, from the side.
        panel: `left`, a recording's, or `right`, Meshcat's own.

    Returns:
        position and target, each of shape (3,), W, m.

    Raises:
        StarnavError: unknown view.
    """
    check_view(view)
    size = np.array([extent[2] - extent[0], extent[3] - extent[1]])
    middle = np.array([0.5 * (extent[0] + extent[2]), 0.5 * (extent[1] + extent[3])])
    across, up = np.array([1.0, 0.0]), np.array([0.0, 1.0])
    if size[1] > size[0]:
        across, up, size = up, -across, size[::-1]
    side, panel_width = {"left": (-0.5, PANEL_WIDTH), "right": (0.5, CONTROLS_WIDTH)}[panel]
    share = 1.0 - panel_width / PAGE[0]
    tilt = math.radians(TILTS[view])
    half_angle = math.tan(math.radians(0.5 * FIELD_OF_VIEW))
    # The page shows `high` metres from its lower to its upper rim at the target; more, as the near rim looks wider.
    high = (
        1.04 * max(math.cos(tilt) * size[1], size[0] / share * PAGE[1] / PAGE[0])
        + half_angle * math.sin(tilt) * size[1]
    )
    middle = middle + side * (1.0 - share) * high * PAGE[0] / PAGE[1] * across
    distance = 0.5 * high / half_angle
    position = np.append(middle - distance * math.sin(tilt) * up, distance * math.cos(tilt))
    return position, np.append(middle, 0.0)


def floor_to_page(extent: Extent) -> tuple[np.ndarray, np.ndarray]:
    """The map from floor to page in the view `top` of a box of the floor: pixels = matrix @ (x, y) + offset.

    Args:
        extent: the box, as for `camera_pose`.

    Returns:
        matrix of shape (2, 2), pixels per m, and offset of shape (2,), pixels; from the page's upper left corner.
    """
    position, target = camera_pose(extent)
    scale = 0.5 * PAGE[1] / math.tan(math.radians(0.5 * FIELD_OF_VIEW)) / float(np.linalg.norm(position - target))
    up = (target - position)[:2] / np.hypot(*(target - position)[:2])  # by as much as the camera is off the vertical
    matrix = scale * np.array([(up[1], -up[0]), (-up[0], -up[1])])
    return matrix, 0.5 * np.array(PAGE) - matrix @ target[:2]


def camera_presets(world: World) -> dict[str, tuple[np.ndarray, np.ndarray]]:
    """View -> `camera_pose` at the start of a run in a world."""
    boxes = {view: around_robot(np.array(world.start)) if view == "follow" else world.extent for view in VIEWS}
    return {view: camera_pose(box, view) for view, box in boxes.items()}


def check_view(view: str) -> None:
    """Raise `StarnavError` for an unknown view."""
    if view not in VIEWS:
        raise StarnavError(f"camera view is {shown(view)}; allowed: one of {', '.join(VIEWS)}")
