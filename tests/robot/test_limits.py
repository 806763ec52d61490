"""Angles and limits."""

import math

import pytest
from hypothesis import given
from hypothesis import strategies as st

from drake_starnav.robot.limits import limited, wrapped_angle


@pytest.mark.parametrize(("value", "kept"), [(0.3, 0.3), (-0.3, -0.3), (2.0, 1.0), (-2.0, -1.0)])
def test_a_value_is_cut_off_in_size(value, kept):
    assert limited(value, 1.0) == kept


@pytest.mark.parametrize("turns", [-2, 0, 3])
def test_angles_are_wrapped_to_one_turn(turns):
    for angle in (-math.pi, -1.0, 0.0, 3.0):
        assert wrapped_angle(angle + turns * 2.0 * math.pi) == pytest.approx(angle)


@given(st.floats(-50.0, 50.0))
def test_a_wrapped_angle_is_the_same_direction(angle: float) -> None:
    wrapped = wrapped_angle(angle)
    assert -math.pi <= wrapped < math.pi + 1e-12
    assert math.cos(wrapped - angle) == pytest.approx(1.0)
