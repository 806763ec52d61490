"""The page of a world."""

import numpy as np

from drake_starnav.loading import parse_scenario
from drake_starnav.visualization.world_page import write_world_page
from drake_starnav.worlds import Crowd, make_world

ZONES = """
world: !Room {}
zones:
  - !KeepOut {polygon: [[2, -1], [4, -1], [4, 1], [2, 1]]}
  - !KeepOut {polygon: [[5, -1], [6, -1], [6, 1], [5, 1]]}
"""


def test_a_page_is_written_with_the_zones_that_there_are(tmp_path) -> None:
    world = make_world(Crowd(moving_obstacles=(3, 3)), 0, 0.25)
    path = np.array([world.start[:2], world.goal])
    for text, zoned in (("world: !Room {}", False), (ZONES, True)):
        write_world_page(world, parse_scenario(text, name="crowd"), path, "crowd", tmp_path / "x.html")
        page = (tmp_path / "x.html").read_text(encoding="utf-8")
        assert "<title>crowd</title>" in page and ("area to stay out of" in page) == zoned
        assert "area to be slow in" not in page
