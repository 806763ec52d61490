"""The camera presets show what they are meant to show."""

import numpy as np
import pytest

from drake_starnav.station.world_geometry import OBSTACLE_HEIGHT
from drake_starnav.visualization.camera import PAGE, VIEWS
from tests.helpers.camera import PANEL_WIDTH, SCENE, camera_pose, projected


@pytest.mark.parametrize("view", VIEWS)
@pytest.mark.parametrize("extent", [(-1.0, -2.5, 7.0, 2.5), (0.0, 0.0, 5.0, 30.0), (-4.0, -4.0, 4.0, 4.0)])
def test_the_camera_sees_all_of_the_extent_beside_the_panel(extent, view):
    position, target = camera_pose(extent, view)
    x0, y0, x1, y1 = extent
    corners = np.array([(x0, y0, 0.0), (x0, y1, 0.0), (x1, y0, 0.0), (x1, y1, 0.0)])
    columns, rows = np.array([projected(corner, position, target) for corner in corners]).T
    assert columns.min() > PANEL_WIDTH - 5.0 and columns.max() < PAGE[0] + 5.0
    assert rows.min() > 0.0 and rows.max() < SCENE[1]


def test_walls_are_seen_up_to_their_tops_however_small_the_room():
    x0, y0, x1, y1 = extent = (0.0, 0.0, 4.0, 3.0)
    position, target = camera_pose(extent)
    tops = np.array([(x, y, OBSTACLE_HEIGHT) for x in (x0, x1) for y in (y0, y1)])
    columns, rows = np.array([projected(top, position, target) for top in tops]).T
    assert columns.min() > PANEL_WIDTH and columns.max() < PAGE[0]
    assert rows.min() > 0.0 and rows.max() < SCENE[1]
