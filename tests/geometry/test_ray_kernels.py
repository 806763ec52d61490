"""One fan of beams against one shape, with crossings computed by hand."""

import math

import numpy as np
import pytest

from drake_starnav.geometry.ray_kernels import CIRCLE, CONIC, SEGMENT, cast_rows
from drake_starnav.geometry.raycast import COLUMNS, Fan

FAN = Fan.regular(-math.pi, math.pi / 180.0, 360)


def cast(row: list[float], x: float = 0.0, y: float = 0.0, yaw: float = 0.0) -> np.ndarray:
    rows = np.zeros((1, COLUMNS))
    rows[0, : len(row)] = row
    ranges = np.full(360, np.inf)
    cast_rows(rows, (x, y, math.cos(yaw), math.sin(yaw)), FAN, ranges, 10.0)
    return ranges


def test_a_circle_is_hit_at_its_near_side_within_its_angle() -> None:
    ranges = cast([3.0, 0.0, 1.0, CIRCLE])
    assert ranges[180] == pytest.approx(2.0)
    half = math.degrees(math.asin(1.0 / 3.0))
    assert np.isfinite(ranges).sum() == 2 * math.floor(half) + 1


def test_from_inside_a_circle_its_far_side_is_hit() -> None:
    np.testing.assert_allclose(cast([0.0, 0.0, 2.0, CIRCLE]), 2.0)
    assert cast([0.5, 0.0, 2.0, CIRCLE])[180] == pytest.approx(2.5)


def test_a_segment_is_hit_along_its_line() -> None:
    ranges = cast([2.0, 0.0, 1.0, SEGMENT, 2.0, -1.0, 2.0, 1.0])
    seen = np.flatnonzero(np.isfinite(ranges))
    bearing = FAN.angle_min + FAN.increment * seen
    np.testing.assert_allclose(ranges[seen], 2.0 / np.cos(bearing))
    assert np.abs(bearing).max() <= math.atan2(1.0, 2.0)


def test_an_ellipse_is_hit_at_its_axes() -> None:
    a, b = 1.0, 0.5
    ellipse = [3.0, 0.0, a, CONIC, 1 / a**2, 0.0, 1 / b**2, 0.0, 0.0, -1.0, 0.0, 0.0, -1.0, 1.0]
    assert cast(ellipse)[180] == pytest.approx(3.0 - a)
    assert cast(ellipse, x=3.0, y=-2.0)[270] == pytest.approx(2.0 - b)


def test_a_clip_opens_a_conic() -> None:
    circle = [3.0, 0.0, 1.0, CONIC, 1.0, 0.0, 1.0, 0.0, 0.0, -1.0, 1.0, 0.0, 0.0, 2.0]  # the half beyond x = 3
    assert cast(circle)[180] == pytest.approx(4.0)


def test_a_turned_sensor_sees_the_same_at_other_bearings() -> None:
    np.testing.assert_allclose(cast([3.0, 0.0, 1.0, CIRCLE], yaw=0.5 * math.pi)[90], 2.0)


def test_nearer_ranges_stay() -> None:
    rows = np.zeros((1, COLUMNS))
    rows[0, :4] = 3.0, 0.0, 1.0, CIRCLE
    ranges = np.full(360, 1.0)
    cast_rows(rows, (0.0, 0.0, 1.0, 0.0), FAN, ranges, 10.0)
    assert (ranges == 1.0).all()
