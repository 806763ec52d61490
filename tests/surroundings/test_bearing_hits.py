"""Hits on a bearing grid: each in its sample, the nearest of several, with half the chord to its neighbour."""

import dataclasses
import math

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from drake_starnav.lidar.laser_scan import DYNAMIC, STATIC, LaserScan
from drake_starnav.surroundings.bearing_hits import (
    convert_beams_to_bearings,
    convert_points_to_bearings,
    measure_half_chords,
)
from tests.helpers.scans import cast, scattered, seeds


def circle(n: int, radius: float, **changes) -> LaserScan:
    """A scan from the middle of a round room, in n beams."""
    scan = LaserScan(0.0, -math.pi, 2.0 * math.pi / n, 0.0, 5.0, np.full(n, radius), lost_beams=True)
    return dataclasses.replace(scan, **changes)


def on_grid(scan: LaserScan, samples: int) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Distance, half gap and offset."""
    return convert_beams_to_bearings(
        scan.distances, measure_half_chords(scan.distances, scan.beams), scan.beams, samples
    )


@given(st.integers(1, 3), st.booleans())
def test_the_chord_spans_beams_without_information_but_not_missing_returns(count: int, moving: bool) -> None:
    ranges, motion = np.full(360, 1.0), np.full(360, STATIC)
    if moving:
        motion[100 : 100 + count] = DYNAMIC
    else:
        ranges[100 : 100 + count] = np.nan
    scan = circle(360, 1.0, ranges=ranges, motion=motion)
    gaps = measure_half_chords(np.ones(360), scan.beams)
    assert gaps[[99, 100 + count]] == pytest.approx(math.sin((count + 1) * math.pi / 360))
    assert not gaps[100 : 100 + count].any()
    open_gap = circle(360, 1.0, ranges=np.where(np.isnan(ranges) | (motion == DYNAMIC), np.inf, ranges))
    assert measure_half_chords(open_gap.distances, open_gap.beams)[[99, 100 + count]] == pytest.approx(
        math.sin(math.pi / 360)
    )


@pytest.mark.parametrize("seam", [0.0, 0.3, 1.5])
def test_the_chord_across_the_seam_is_as_wide_as_the_seam(seam: float) -> None:
    step = 2.0 * math.pi / (359.0 + seam)
    scan = circle(360, 1.0, angle_increment=step)
    gaps = measure_half_chords(scan.distances, scan.beams)
    assert gaps[1:-1] == pytest.approx(math.sin(0.5 * step))
    assert gaps[[0, -1]] == pytest.approx(math.sin(0.5 * max(seam, 1.0) * step))


def test_the_ends_of_a_partial_view_are_no_neighbours() -> None:
    n = 359
    scan = LaserScan(0.0, 0.0, 2.0 * math.pi / 360, 0.0, 5.0, np.where(np.arange(n) % (n - 1) == 0, 1.0, np.inf))
    assert not measure_half_chords(scan.distances, scan.beams).any()


def test_beams_fall_into_samples_exactly_on_a_full_circle_and_with_an_offset_else() -> None:
    distance, _, offset = on_grid(circle(360, 2.0), 720)
    assert np.isfinite(distance[::2]).all() and np.isinf(distance[1::2]).all()
    assert not offset.any()
    partial = LaserScan(0.0, 0.0, 0.013, 0.0, 5.0, np.full(100, 2.0))
    _, _, offset = on_grid(partial, 720)
    assert 0.0 < offset.max() <= math.pi / 720 + 1e-12


def test_moving_obstacles_and_missing_returns_are_no_hits() -> None:
    ranges, motion = np.full(360, 2.0), np.full(360, STATIC)
    ranges[10], motion[20] = np.inf, DYNAMIC
    distance, _, _ = on_grid(circle(360, 2.0, ranges=ranges, motion=motion), 360)
    assert np.flatnonzero(np.isinf(distance)).tolist() == [10, 20]


@given(seeds, st.floats(-3.0, 3.0), st.floats(0.5, 3.0))
def test_points_and_scans_give_the_same_hits(seed: int, yaw: float, reach: float) -> None:
    """A scan's hits as points, seen from where it was taken, are its hits within reach."""
    scan = cast(scattered(np.random.default_rng(seed)))
    pose = np.array((0.3, -0.2, yaw))
    gaps = measure_half_chords(scan.distances, scan.beams)[scan.hits]
    found, gap, offset = convert_points_to_bearings(
        scan.points(pose), gaps, *pose[:2], yaw + scan.angle_min, reach, 720
    )
    distance, expected_gap, _ = on_grid(scan, 720)
    near = distance < reach - 1e-9
    np.testing.assert_allclose(found[near], distance[near])
    np.testing.assert_allclose(gap[near], expected_gap[near])
    assert np.isinf(found[distance > reach + 1e-9]).all()
    assert offset.max() < 1e-9


def test_the_nearest_point_of_a_sample_counts_with_the_largest_gap_and_offset() -> None:
    points = np.array(((1.0, 0.0), (2.0, 0.002), (9.0, 0.0)))
    distance, gap, offset = convert_points_to_bearings(points, np.array((0.01, 0.03, 0.5)), 0.0, 0.0, 0.0, 3.0, 360)
    assert distance[0] == 1.0 and gap[0] == 0.03
    assert offset[0] == pytest.approx(0.001, rel=1e-3)
    assert np.isinf(distance[1:]).all()
