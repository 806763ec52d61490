"""The panel of a recording's page."""

import numpy as np
import pytest

from drake_starnav.station.world_geometry import OBSTACLE_HEIGHT
from drake_starnav.visualization.meshes import Layer
from drake_starnav.visualization.page import VIEWS, Cameras, Caption, add_panel
from tests.helpers.browser import PAGE as SIZE
from tests.helpers.camera import PANEL_WIDTH, SCENE, camera_pose, projected

PAGE = "<html><title>Drake MeshCat</title><body>scene</body></html>"


def test_texts_are_escaped_and_the_legend_is_ordered_by_height() -> None:
    layers = {
        "low": Layer("low & wide", (0.0, 0.0, 0.0), "area", 0.1),
        "high": Layer("high", (1.0, 0.0, 0.0), "line", 0.2),
        "silent": Layer("", (0.0, 0.0, 1.0), "line", 0.3),
    }
    caption = Caption("<room>", ("seed 0",), layers)
    text = add_panel(PAGE, caption, Cameras((0.0, 0.0, 4.0, 3.0), "top", "/drake/robot", (1.0, 2.0)))
    assert [layer.label for layer in caption.legend.values()] == ["high", "low & wide"]
    assert "<h1>&lt;room&gt;</h1>" in text and "<title>&lt;room&gt; · seed 0</title>" in text
    assert text.index(">high<") < text.index(">low &amp; wide<")
    assert text.endswith("</body></html>")


def test_a_caption_says_what_is_shown() -> None:
    caption = Caption("room", shown=frozenset({"trail", "roadmap/nodes"}))
    shown = [
        name for name in ("trail/0003", "roadmap/nodes", "roadmap/edges/0001", "scan", "robot") if caption.shows(name)
    ]
    assert shown == ["trail/0003", "roadmap/nodes", "robot"]
    assert all(Caption("room").shows(name) for name in ("trail", "scan"))


@pytest.mark.parametrize("view", VIEWS)
@pytest.mark.parametrize("extent", [(-1.0, -2.5, 7.0, 2.5), (0.0, 0.0, 5.0, 30.0), (-4.0, -4.0, 4.0, 4.0)])
def test_the_camera_sees_all_of_the_extent_beside_the_panel(extent, view):
    position, target = camera_pose(extent, view)
    x0, y0, x1, y1 = extent
    corners = np.array([(x0, y0, 0.0), (x0, y1, 0.0), (x1, y0, 0.0), (x1, y1, 0.0)])
    columns, rows = np.array([projected(corner, position, target) for corner in corners]).T
    assert columns.min() > PANEL_WIDTH - 5.0 and columns.max() < SIZE[0] + 5.0
    assert rows.min() > 0.0 and rows.max() < SCENE[1]


def test_walls_are_seen_up_to_their_tops_however_small_the_room():
    x0, y0, x1, y1 = extent = (0.0, 0.0, 4.0, 3.0)
    position, target = camera_pose(extent)
    tops = np.array([(x, y, OBSTACLE_HEIGHT) for x in (x0, x1) for y in (y0, y1)])
    columns, rows = np.array([projected(top, position, target) for top in tops]).T
    assert columns.min() > PANEL_WIDTH and columns.max() < SIZE[0]
    assert rows.min() > 0.0 and rows.max() < SCENE[1]
