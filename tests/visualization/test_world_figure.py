"""Pictures of worlds show what moves and its way."""

import numpy as np
from PIL import Image

from drake_starnav.loading import parse_scenario
from drake_starnav.visualization.world_figure import write_png
from drake_starnav.worlds import Crowd, make_world

WORLD = make_world(Crowd(moving_obstacles=(3, 3)), 0, 0.25)


def test_zones_are_drawn_in_their_colours(tmp_path) -> None:
    zone = "zones: [!KeepOut {polygon: [[-3, -3], [3, -3], [3, 3], [-3, 3]]}]"
    pictures = []
    for text in ("world: !Room {}", f"world: !Room {{}}\n{zone}"):
        write_png(WORLD, parse_scenario(text, name="crowd"), None, "crowd", tmp_path / "x.png")
        pictures.append(np.asarray(Image.open(tmp_path / "x.png").convert("RGB"), int))
    reddish = [np.count_nonzero(each[..., 0] - each[..., 2] > 40) for each in pictures]
    assert reddish[1] > reddish[0] + 0.01 * pictures[1].shape[0] * pictures[1].shape[1]
