"""Hits become clusters, and clusters discs."""

import dataclasses
import math

import numpy as np
import pytest

from drake_starnav.lidar.laser_scan import DYNAMIC, STATIC, LaserScan
from drake_starnav.moving.clusters import estimate_discs, find_clusters, fit_center, fit_radius
from tests.helpers.scans import cast
from tests.helpers.scenes import hall

LARGEST = 0.6
"""Radius of the largest obstacle that moves, m."""


def seen(*discs: tuple[float, float, float]) -> tuple[LaserScan, np.ndarray, np.ndarray]:
    """A scan of discs in a hall, what moves in it, and its points."""
    scan = cast(hall(*discs))
    points = scan.points_at(scan.distances, np.ones(len(scan.ranges), bool), np.zeros(3))
    near = np.min([np.hypot(*(points - (x, y)).T) - radius for x, y, radius in discs], axis=0) < 1e-6
    return scan, np.where(near, DYNAMIC, STATIC), points


def moving_clusters(scan: LaserScan, motion: np.ndarray) -> list[np.ndarray]:
    return parts(scan, motion != STATIC, np.zeros(len(motion), bool), LARGEST)


def parts(scan: LaserScan, doubtful: np.ndarray, may_start: np.ndarray, largest: float) -> list[np.ndarray]:
    """The beams of each cluster."""
    found = find_clusters(scan, doubtful, may_start, largest).tolist()
    return [(first + np.arange(count)) % len(doubtful) for first, count in found]


def shown(scan: LaserScan, run: np.ndarray, points: np.ndarray) -> tuple[float, float, float, bool]:
    """The disc that a cluster shows from the origin."""
    runs = np.array(((run[0], len(run)),))
    (center,), (radius,), _, (is_whole,) = estimate_discs(scan.beams, runs, points, np.zeros(2), LARGEST)
    return *center, radius, is_whole


@pytest.mark.parametrize("bearing", np.linspace(-math.pi, math.pi, 7))
def test_a_disc_is_one_cluster_wherever_the_scan_begins(bearing: float) -> None:
    disc = (2.0 * math.cos(bearing), 2.0 * math.sin(bearing), 0.3)
    scan, motion, points = seen(disc)
    (run,) = moving_clusters(scan, motion)
    assert set(run) == set(np.flatnonzero(motion == DYNAMIC))
    x, y, radius, whole = shown(scan, run, points)
    assert whole
    np.testing.assert_allclose((x, y, radius), disc, atol=0.03)


def test_discs_that_touch_are_parted_and_one_behind_another_is_half_hidden() -> None:
    scan, motion, points = seen((2.0, -0.28, 0.3), (2.0, 0.3, 0.3))
    assert len(moving_clusters(scan, motion)) == 2
    scan, motion, points = seen((1.5, 0.0, 0.3), (2.5, 0.5, 0.3))
    whole = [shown(scan, run, points)[3] for run in moving_clusters(scan, motion)]
    assert sorted(whole) == [False, True]


def test_what_is_too_wide_or_a_single_beam_is_no_cluster() -> None:
    scan, motion, _ = seen((2.5, 0.0, 0.9))
    assert moving_clusters(scan, motion) == []
    lonely = np.where(np.arange(len(motion)) == 100, DYNAMIC, STATIC)
    assert moving_clusters(scan, lonely) == []


def test_what_stands_and_may_start_is_a_cluster_but_parts_from_what_moves_if_both_are_too_wide() -> None:
    person, column = (2.0, -0.3, 0.25), (2.0, 0.33, 0.35)
    scan, motion, points = seen(person, column)
    small, moves = motion != STATIC, np.hypot(*(points - person[:2]).T) < 0.25 + 1e-6
    both = parts(scan, moves, small, LARGEST)
    assert {frozenset(run) for run in both} == {
        frozenset(np.flatnonzero(moves)),
        frozenset(np.flatnonzero(small & ~moves)),
    }
    narrow = parts(scan, moves, small & ~moves, 0.3)
    assert [set(run) for run in narrow] == [set(np.flatnonzero(moves))]


def test_the_centre_is_found_from_a_part_of_the_rim() -> None:
    angle = np.linspace(2.0, 3.0, 8)
    rim = np.array((1.0, 2.0)) + 0.4 * np.column_stack((np.cos(angle), np.sin(angle)))
    np.testing.assert_allclose(fit_center(rim, np.array((1.1, 1.95)), 0.4), (1.0, 2.0), atol=0.02)


def test_the_radius_is_found_from_a_part_of_the_rim_and_kept_where_that_is_too_short() -> None:
    rim = np.array((1.0, 2.0)) + 0.4 * np.column_stack((np.cos(a := np.linspace(2.0, 3.5, 20)), np.sin(a)))
    start = np.array((1.05, 1.95))
    assert fit_radius(rim, start, 0.3, 0.01) == pytest.approx(0.4, abs=0.02)
    assert fit_radius(rim[:2], start, 0.3, 0.2) == pytest.approx(0.3, abs=0.06)


def test_a_disc_with_sides_out_of_range_is_not_whole() -> None:
    scan, motion, points = seen((2.0, 2.0, 0.3))
    clipped = dataclasses.replace(scan, range_max=2.7, ranges=np.where(scan.ranges < 2.7, scan.ranges, np.inf))
    for lidar, expected in ((scan, True), (clipped, False)):
        (run,) = moving_clusters(lidar, motion)
        assert shown(lidar, run, points)[3] == expected
