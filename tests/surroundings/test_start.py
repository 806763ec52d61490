"""The disc in which a robot begins."""

import math

import numpy as np
import pytest

from drake_starnav.geometry.footprint import disc, footprint
from drake_starnav.surroundings.chords import BINS, Chords
from drake_starnav.surroundings.start import Start, start_radius

HERE = (0.0, 0.0, 0.0)


def test_it_holds_what_a_robot_covers_that_turns_and_drives_up_to_its_lidar_s_plane() -> None:
    box = footprint(((0.4, -0.25), (0.4, 0.25), (-0.4, 0.25), (-0.4, -0.25)))
    for body, beside in ((disc(0.25), 0.25), (box, 0.25)):
        for offset in (0.0, 0.1, 0.4):
            free = start_radius(body, 0.02, offset)
            corners = np.array([(x, y) for x in (0.0, offset) for y in (beside + 0.02, -beside - 0.02)])
            assert free >= max(np.hypot(*corners.T).max(), body.radius + 0.02)
            assert free < max(np.hypot(*corners.T).max() + 0.02, body.radius + 0.02 + 1e-9)


def test_it_is_a_look_that_ends_at_what_is_seen() -> None:
    wall = np.array(((0.2, -0.1, 0.2, 0.1), (-0.1, 0.25, 0.1, 0.25)))
    seen = Chords(wall, np.array((True, False)), np.ones(2, bool), np.zeros(2))  # the second hides without being one
    start = Start.of(0.3).cut(HERE, seen)
    assert start.free[0] == pytest.approx(0.2) and start.free[BINS // 4] == 0.3 == start.free.max()
    beams = start.beams
    assert np.array_equal(beams.distances, start.free) and not (beams.kinds & 1).any()
    assert beams.seam < math.inf and beams.increment == pytest.approx(2.0 * math.pi / BINS)
