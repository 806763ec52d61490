"""The paper's frontier points lie between clusters of hits."""

import math

import numpy as np
import pytest

from drake_starnav.lidar.laser_scan import LaserScan
from drake_starnav.paper import choices
from drake_starnav.paper.frontier_points import (
    SidePoints,
    compute_mean_bearing,
    compute_midpoint_bearing,
    identify_frontier_points,
)
from drake_starnav.paper.star_region import make_traversable_region
from drake_starnav.worlds import World
from tests.helpers.scans import RADIUS, cast

BEARING = np.deg2rad(np.arange(-180, 180))


def full_scan(ranges: np.ndarray) -> LaserScan:
    return LaserScan(0.0, -math.pi, 2.0 * math.pi / 360, 0.0, 5.0, ranges)


def found(scan: LaserScan, pose: np.ndarray) -> np.ndarray:
    """The frontier points of a scan in its own region."""
    return identify_frontier_points(make_traversable_region(scan, pose, RADIUS), scan, pose)


@pytest.mark.parametrize("turn", np.deg2rad([0, 1, 30, 60, 89, 150]))
@pytest.mark.parametrize("yaw", [0.0, 1.3, -2.9])
def test_frontier_points_lie_between_clusters_wherever_the_seam_is(turn, yaw):
    arcs = np.abs((BEARING - turn + math.pi / 2) % math.pi - math.pi / 2) <= math.pi / 6 + 1e-9
    scan, pose = full_scan(np.where(arcs, 1.0, np.inf)), np.array((2.0, -1.0, yaw))
    points = found(scan, pose)
    angle = yaw + turn + math.pi / 2 * np.array((1.0, -1.0))
    ray = np.column_stack((np.cos(angle), np.sin(angle)))
    assert len(points) == 2
    order = np.argsort((points - pose[:2]) @ ray[0])[::-1]
    np.testing.assert_allclose(points[order], pose[:2] + 0.5 * ray, atol=1e-9)


def test_a_wide_opening_is_entered_along_its_bisector():
    scan = full_scan(np.where(np.abs(BEARING) <= math.pi / 6 + 1e-9, 1.0, np.inf))
    reach = min(choices.RANGE, 5.0)
    np.testing.assert_allclose(found(scan, np.zeros(3)), [(-choices.WIDE_SHARE * reach, 0.0)], atol=1e-9)


def test_walls_that_surround_the_robot_show_their_doorways():
    block = np.array([(-2.0, 1.0), (1.0, 1.0), (1.0, 3.0), (-2.0, 3.0)])
    scan = cast(World("corner", (0, 0, 0), (2, 2), polygons=(block,), bounds=(-2.0, -1.0, 3.0, 3.0)))
    (point,) = found(scan, np.zeros(3))
    assert (point > 0.9).all() and (point < 3.0).all()  # at the corner at (1, 1) or behind it, along the ray past it
    assert point[0] == pytest.approx(point[1], abs=0.1)


@pytest.mark.parametrize("ranges", [np.full(360, 1.0), np.full(360, np.inf)], ids=["ring", "nothing"])
def test_closed_rings_and_empty_scans_have_no_frontier_points(ranges):
    assert len(found(full_scan(ranges), np.zeros(3))) == 0


def test_a_lone_hit_is_an_outlier():
    ranges = np.full(360, 1.0)
    ranges[40:140], ranges[90] = np.inf, 3.0
    with_it, without = (
        found(full_scan(ranges), np.zeros(3)),
        found(full_scan(np.where(ranges == 3.0, np.inf, ranges)), np.zeros(3)),
    )
    np.testing.assert_allclose(with_it, without, atol=0.1)
    assert len(without) == 1


def test_the_mean_of_two_bearings_is_that_of_the_midpoint_only_where_both_sides_are_as_far():
    for last, first, ranges in ((0.2, 1.0, (2.0, 2.0)), (3.0, 3.4, (1.0, 1.0)), (0.2, 1.0, (1.0, 3.0))):
        ends = [r * np.array((math.cos(a), math.sin(a))) for r, a in zip(ranges, (last, first), strict=True)]
        sides = SidePoints(np.array([last]), np.array([first]), 0.5 * sum(ends)[None])
        difference = math.remainder(compute_mean_bearing(sides)[0] - compute_midpoint_bearing(sides)[0], 2.0 * math.pi)
        assert (abs(difference) < 1e-9) == (ranges[0] == ranges[1])
