"""Where a camera shows a point."""

import math

import numpy as np
from matplotlib import rc_context
from PIL import Image

from drake_starnav.visualization.page import Extent
from drake_starnav.visualization.plot import TEXT_SIZE, draw_moment_figure
from drake_starnav.visualization.timeline import RecordedRun
from drake_starnav.visualization.world_figure import render_figure
from tests.helpers.browser import PAGE

FIELD_OF_VIEW, SPARE, TALL, TILTS = 20.0, 1.04, 0.5, {"top": 0.05, "follow": 35.0, "oblique": 50.0}
"""As in page.js."""
PANEL_WIDTH, BAR_HEIGHT = 225.0, 40.0
"""Of the panel on the page's left and of the bar at its bottom, as in page.css, pixels; the scene has the rest."""
SCENE = (PAGE[0] - PANEL_WIDTH, PAGE[1] - BAR_HEIGHT)
"""Width and height of the scene, pixels."""


def camera_pose(extent: Extent, view: str = "top") -> tuple[np.ndarray, np.ndarray]:
    """Position and target of a camera for which a box of the floor fills the scene of a page of the size `PAGE`.

    As the page's script does, for any size.

    Args:
        extent: the box, (x_min, y_min, x_max, y_max), W, m; its longer side lies across.
        view: `top`, straight down, `oblique` or `follow`, from the side.

    Returns:
        position and target, each of shape (3,), W, m.
    """
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


def projected(point, position, target):
    """Column and row of the page where a camera that stands at `position` and looks at `target` shows a point."""
    ahead = (target - position) / np.linalg.norm(target - position)
    right = np.cross(ahead, [0.0, 0.0, 1.0])
    right /= np.linalg.norm(right)
    scale = 0.5 * SCENE[1] / math.tan(math.radians(0.5 * FIELD_OF_VIEW))
    column, row = (
        scale * ((point - position) @ axis) / ((point - position) @ ahead) for axis in (right, np.cross(right, ahead))
    )
    return np.array([PANEL_WIDTH + 0.5 * SCENE[0] + column, 0.5 * SCENE[1] - row])


def plotted(film: RecordedRun, place: np.ndarray, picture: Image.Image) -> tuple[int, int]:
    """Row and column at which a picture of a whole film by `draw_moment` shows a place (2,) of the floor, W, m."""
    with rc_context({"font.size": TEXT_SIZE}):
        figure = draw_moment_figure(film, 0.0, title=film.caption.heading)
        render_figure(figure, dpi=round(picture.width / figure.get_figwidth()))
    share = figure.transFigure.inverted().transform(figure.axes[0].transData.transform(place))
    return round((1.0 - share[1]) * picture.height), round(share[0] * picture.width)
