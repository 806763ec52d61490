"""The disc in which a robot begins."""

import math

import numpy as np
import pytest

from drake_starnav.surroundings.chords import BINS, Chords
from drake_starnav.surroundings.start import Start

HERE = (0.0, 0.0, 0.0)


def test_it_is_a_look_that_ends_at_what_is_seen() -> None:
    wall = np.array(((0.2, -0.1, 0.2, 0.1), (-0.1, 0.25, 0.1, 0.25)))
    seen = Chords(wall, np.array((True, False)), np.ones(2, bool), np.zeros(2))  # the second hides without being one
    start = Start.of(0.3).cut(HERE, seen)
    assert start.free[0] == pytest.approx(0.2) and start.free[BINS // 4] == 0.3 == start.free.max()
    beams = start.beams
    assert np.array_equal(beams.distances, start.free) and not (beams.kinds & 1).any()
    assert beams.seam < math.inf and beams.increment == pytest.approx(2.0 * math.pi / BINS)
