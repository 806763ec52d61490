"""Where a camera shows a point."""

import math

import numpy as np

from drake_starnav.visualization.camera import FIELD_OF_VIEW, PANEL_WIDTH, SCENE


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
