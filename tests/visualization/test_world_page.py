"""The page of a world."""

import numpy as np

from drake_starnav.robot import RobotParameters
from drake_starnav.visualization.world_page import write_world_page
from drake_starnav.worlds import Crowd, make_world


def test_a_page_is_written(tmp_path) -> None:
    world = make_world(Crowd(moving_obstacles=(3, 3)), 0, 0.25)
    path = np.array([world.start[:2], world.goal])
    write_world_page(world, RobotParameters(), path, "crowd", tmp_path / "x.html")
    assert "<title>crowd</title>" in (tmp_path / "x.html").read_text(encoding="utf-8")
