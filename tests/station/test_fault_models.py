"""Declared faults: what they do to a pose and to the wheels."""

import math

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from drake_starnav.geometry.se2 import composed, now_in
from drake_starnav.station.fault_models import drifted, jumped, wheel_shares
from tests.helpers.scans import seeds

poses = st.tuples(st.floats(-9.0, 9.0), st.floats(-9.0, 9.0), st.floats(-3.1, 3.1)).map(np.array)


@given(seeds, poses, st.floats(0.0, 0.3), st.floats(0.0, 0.5), st.floats(-0.5, 0.5))
def test_drift_is_the_declared_share_of_distance_and_angle(seed, before, drift, way, turn):
    now = composed(before, (way, 0.0, turn))
    error = now_in(now, drifted(before, before, now, drift, seed))
    assert math.hypot(*error[:2]) == pytest.approx(drift * way, abs=1e-9)
    assert abs(error[2]) == pytest.approx(drift * abs(turn), abs=1e-9)


@given(seeds, st.floats(0.0, 2.0), st.integers(0, 1000))
def test_jumps_have_the_declared_size(seed, jump, index):
    assert np.hypot(*jumped(jump, seed, index)) == pytest.approx(jump)
    assert np.array_equal(jumped(jump, seed, index), jumped(jump, seed, index))


@given(seeds, st.floats(0.0, 0.5), st.integers(0, 1000))
def test_wheels_keep_at_least_what_is_not_declared_lost(seed, slip, index):
    shares = wheel_shares(slip, seed, index)
    assert ((1.0 - slip <= shares) & (shares <= 1.0)).all()
