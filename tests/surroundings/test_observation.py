"""A scan with its region is the same thing in another frame."""

import numpy as np

from drake_starnav.geometry.se2 import compose_poses
from drake_starnav.surroundings.observation import Observation
from drake_starnav.surroundings.star_region import make_scan_region
from drake_starnav.worlds.world import World
from tests.helpers.scans import MARGINS, RADIUS, cast

POSE, FRAME = np.array((0.3, -0.2, 0.4)), np.array((1.0, 2.0, -0.7))
WORLD = World("posts", (0.0, 0.0, 0.0), (1.0, 0.0), cylinders=[(1.5, 0.0, 0.3), (0.0, -1.2, 0.2)])


def test_in_another_frame_it_is_as_if_it_had_been_taken_there() -> None:
    scan = cast(WORLD, POSE)
    moved = Observation(make_scan_region(scan, POSE, RADIUS, MARGINS), scan, POSE).transformed(FRAME)
    there = np.array(compose_poses(FRAME, POSE))
    np.testing.assert_allclose(moved.pose, there)
    assert moved.scan is scan
    region = make_scan_region(scan, there, RADIUS, MARGINS)
    np.testing.assert_allclose(moved.region.outline(60), region.outline(60), atol=1e-9)
