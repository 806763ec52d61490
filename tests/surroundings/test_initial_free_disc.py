"""The disc in which a robot begins."""

import math

import numpy as np
import pytest

from drake_starnav.surroundings.chords import BINS, Chords
from drake_starnav.surroundings.view_history import InitialFreeDisc

HERE = (0.0, 0.0, 0.0)


def test_it_is_a_view_that_ends_at_what_is_seen() -> None:
    wall = np.array(((0.2, -0.1, 0.2, 0.1), (-0.1, 0.25, 0.1, 0.25)))
    seen = Chords(wall, np.array((True, False)), np.ones(2, bool), np.zeros(2))  # the second hides without being one
    disc = InitialFreeDisc.of_radius(0.3).cut_by(seen, HERE)
    ranges = disc.visible_ranges
    assert ranges[0] == pytest.approx(0.2) and ranges[BINS // 4] == 0.3 == ranges.max()
    beams = disc.beams
    assert np.array_equal(beams.distances, ranges) and not (beams.kinds & 1).any()
    assert beams.seam < math.inf and beams.increment == pytest.approx(2.0 * math.pi / BINS)
