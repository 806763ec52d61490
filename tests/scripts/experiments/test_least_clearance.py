"""No contact is missed along many poses."""

import numpy as np
from hypothesis import given, settings

from drake_starnav.geometry.footprint import disc, footprint
from drake_starnav.worlds.clearance import body_clearance
from drake_starnav.worlds.world import World
from scripts.experiments.least_clearance import least_clearance
from tests.helpers.scans import seeds


@settings(max_examples=50)
@given(seeds)
def test_the_least_clearance_is_that_of_all_poses(seed: int) -> None:
    rng = np.random.default_rng(seed)
    posts = np.array([(*rng.uniform(-2.0, 2.0, 2), 0.1) for _ in range(5)])
    world = World("posts", (0, 0, 0), (0, 0), cylinders=posts, bounds=(-3.0, -3.0, 3.0, 3.0))
    shape = disc(0.2) if rng.random() < 0.5 else footprint(((-0.3, -0.1), (0.3, -0.1), (0.3, 0.1), (-0.3, 0.1)))
    poses = np.cumsum(0.01 * rng.standard_normal((200, 3)) + 0.02 * rng.uniform(-1.0, 1.0, 3), axis=0)
    clear = body_clearance(world, poses, shape)
    if clear.min() < 0.1:  # else the clearance of polygons is that of discs around them
        least, at = least_clearance(world, poses, shape, np.inf)
        assert least == clear.min() == clear[at]
    assert least_clearance(world, poses, shape, clear.min()) == (clear.min(), -1)
