"""The paper's frontier points lie between clusters of hits."""

import math

import numpy as np
import pytest

from drake_starnav.baselines.paper import constants
from drake_starnav.baselines.paper.frontiers import WIDE_SHARE, frontier_points
from drake_starnav.baselines.paper.perception import fit_scan, sight_range
from drake_starnav.lidar.laser_scan import LaserScan
from drake_starnav.surroundings.star_region import fit_region
from drake_starnav.worlds import World
from tests.helpers.scans import RADIUS, cast

BEARING = np.deg2rad(np.arange(-180, 180))


def full_scan(ranges: np.ndarray) -> LaserScan:
    return LaserScan(0.0, -math.pi, 2.0 * math.pi / 360, 0.0, 5.0, ranges)


def found(scan: LaserScan, pose: np.ndarray) -> np.ndarray:
    """The frontier points of a scan in its own region."""
    region = fit_region(sight_range(scan, scan.distances, RADIUS), pose[:2], pose[2] + scan.angle_min, fit_scan)
    return frontier_points(region, scan, pose)


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
    reach = min(constants.RANGE, 5.0)
    np.testing.assert_allclose(found(scan, np.zeros(3)), [(-WIDE_SHARE * reach, 0.0)], atol=1e-9)


def test_walls_that_surround_the_robot_show_their_doorways():
    block = np.array([(-2.0, 1.0), (1.0, 1.0), (1.0, 3.0), (-2.0, 3.0)])
    scan = cast(World("corner", (0, 0, 0), (2, 2), polygons=(block,), bounds=(-2.0, -1.0, 3.0, 3.0)))
    (point,) = found(scan, np.zeros(3))
    assert 1.0 < point[0] < 3.0 and 1.0 < point[1] < 3.0  # behind the corner at (1, 1), along the ray past it
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
