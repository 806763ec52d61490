"""Angles and limits."""

import math

import pytest
from hypothesis import given
from hypothesis import strategies as st

from drake_starnav.robot.limits import wrap_angle


@given(st.floats(-50.0, 50.0))
def test_a_wrapped_angle_is_the_same_direction(angle: float) -> None:
    wrapped = wrap_angle(angle)
    assert -math.pi <= wrapped < math.pi + 1e-12
    assert math.cos(wrapped - angle) == pytest.approx(1.0)
