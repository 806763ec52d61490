"""A full circle is told from a sector in one place, however drivers write it."""

import math

import numpy as np
import pytest

from drake_starnav.lidar.field_of_view import SEAM, TURN, FieldOfView

HALF_DEGREE = math.radians(0.5)


def as_single(first: float, last: float, beams: int) -> tuple[float, float, int]:
    """First bearing and step of a turn with both ends, computed in single precision."""
    return float(np.float32(first)), float((np.float32(last) - np.float32(first)) / np.float32(beams - 1)), beams


FULL = {
    "evenly divided": (-math.pi, TURN / 360, 360),
    "both ends": (-math.pi, TURN / 360, 361),
    "both ends in single precision": as_single(-math.pi, math.pi, 1440),
    "both ends from 0 in single precision": as_single(0.0, TURN, 455),
    "0 to 6.28": (0.0, 6.28 / 359, 360),
    "0 to 6.28319": (0.0, 6.28319 / 359, 360),
    "to half a degree": (0.0, (TURN - HALF_DEGREE) / 359, 360),
    "to half a degree with many beams": (0.0, (TURN - HALF_DEGREE) / 3599, 3600),
    "half a degree of beams is missing": (1.0, (TURN - HALF_DEGREE) / 360, 360),
    "coarse": (0.0, (TURN - HALF_DEGREE) / 36, 36),
    "more than a turn by rounding": (0.0, TURN / 719.9, 721),
}
"""angle_min, angle_increment and number of beams."""


@pytest.mark.parametrize("view", FULL.values(), ids=FULL)
def test_a_full_circle_is_one_however_it_is_written(view: tuple[float, float, int]) -> None:
    field = FieldOfView(*view)
    assert field.full_circle
    assert 0.0 <= field.seam <= field.angle_increment + SEAM
    assert field.seam + field.span == pytest.approx(TURN, abs=0.01)
    assert field.widest_gap == max(field.seam, field.angle_increment)


@pytest.mark.parametrize("missing", [math.radians(1.0), 0.1, 1.0, math.pi])
@pytest.mark.parametrize("beams", [36, 360, 1440])
def test_what_lacks_a_degree_is_a_sector(beams: int, missing: float) -> None:
    step = (TURN - missing) / beams
    field = FieldOfView(-math.pi, step, beams)
    assert not field.full_circle and field.seam == math.inf and field.widest_gap == step


def test_the_seam_of_an_evenly_divided_turn_is_a_step() -> None:
    for beams in range(36, 1500, 7):
        step = TURN / beams
        assert FieldOfView(-math.pi, step, beams).seam == step
