"""Pictures of worlds show what moves and its way."""

import numpy as np
from matplotlib.colors import to_rgb
from PIL import Image

from drake_starnav.loading import parse_scenario
from drake_starnav.visualization.meshes import MOVING_OBSTACLES
from drake_starnav.visualization.world_figure import world_axes, write_png
from drake_starnav.worlds import Crowd, make_world

WORLD = make_world(Crowd(moving_obstacles=(3, 3)), 0, 0.25)


def test_moving_obstacles_are_drawn_at_first_with_their_paths() -> None:
    _, axis = world_axes(WORLD, "crowd")
    discs = [patch for patch in axis.patches if to_rgb(patch.get_facecolor()) == MOVING_OBSTACLES.color]
    assert [(*disc.center, disc.radius) for disc in discs] == [
        (*path[0, 1:], radius)
        for path, radius in zip(WORLD.moving_obstacles.paths, WORLD.moving_obstacles.radii, strict=True)
    ]
    for line, path in zip(axis.lines, WORLD.moving_obstacles.paths, strict=True):
        assert np.array_equal(np.transpose(line.get_data()), path[:, 1:])


def test_zones_are_drawn_in_their_colours(tmp_path) -> None:
    zone = "zones: [!KeepOut {polygon: [[-3, -3], [3, -3], [3, 3], [-3, 3]]}]"
    pictures = []
    for text in ("world: !Room {}", f"world: !Room {{}}\n{zone}"):
        write_png(WORLD, parse_scenario(text, name="crowd"), None, "crowd", tmp_path / "x.png")
        pictures.append(np.asarray(Image.open(tmp_path / "x.png").convert("RGB"), int))
    reddish = [np.count_nonzero(each[..., 0] - each[..., 2] > 40) for each in pictures]
    assert reddish[1] > reddish[0] + 0.01 * pictures[1].shape[0] * pictures[1].shape[1]
