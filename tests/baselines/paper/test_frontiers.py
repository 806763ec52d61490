"""The paper's frontiers lie between clusters of hits."""

import math

import numpy as np
import pytest

from drake_starnav.baselines.paper.frontiers import cluster_frontiers
from drake_starnav.lidar.laser_scan import LaserScan
from drake_starnav.planning.frontiers import PROBE_DISTANCE
from drake_starnav.planning.parameters import PlannerParameters
from drake_starnav.regions.star_region import StarRegion, scan_region
from tests.helpers.scans import RADIUS


def perceived(scan: LaserScan, pose: np.ndarray) -> StarRegion:
    return scan_region(scan, pose, RADIUS, PlannerParameters())


def two_arcs(yaw_of_seam: float) -> LaserScan:
    """A full circle that starts at -pi and sees 1 m far on two arcs of 60 degrees, opposite each other."""
    bearing = np.deg2rad(np.arange(-180, 180))
    turned = (np.abs((bearing - yaw_of_seam + math.pi / 2) % math.pi - math.pi / 2)) <= math.pi / 6 + 1e-9
    return LaserScan(0.0, -math.pi, 2.0 * math.pi / 360, 0.0, 5.0, np.where(turned, 1.0, np.inf))


@pytest.mark.parametrize("turn", np.deg2rad([0, 1, 30, 60, 89, 150]))
@pytest.mark.parametrize("yaw", [0.0, 1.3, -2.9])
def test_cluster_frontiers_lie_between_clusters_wherever_the_seam_is(turn, yaw):
    scan, pose = two_arcs(turn), np.array((2.0, -1.0, yaw))
    region = perceived(scan, pose)
    found = cluster_frontiers(region, scan, pose, 3)
    angle = yaw + turn + math.pi / 2 * np.array((1.0, -1.0))
    ray = np.column_stack((np.cos(angle), np.sin(angle)))
    assert found.owner.tolist() == [3, 3]
    order = np.argsort((found.stand - pose[:2]) @ ray[0])[::-1]
    np.testing.assert_allclose(found.stand[order], pose[:2] + 0.5 * ray, atol=1e-9)
    np.testing.assert_allclose(found.probe[order], pose[:2] + (0.5 + PROBE_DISTANCE) * ray, atol=1e-9)


def test_a_wide_opening_is_entered_along_its_bisector():
    bearing = np.deg2rad(np.arange(-180, 180))
    ranges = np.where(np.abs(bearing) <= math.pi / 6 + 1e-9, 1.0, np.inf)
    scan, pose = LaserScan(0.0, -math.pi, 2.0 * math.pi / 360, 0.0, 5.0, ranges), np.zeros(3)
    found = cluster_frontiers(perceived(scan, pose), scan, pose, 0)
    np.testing.assert_allclose(found.stand, [(-3.0, 0.0)], atol=1e-9)


@pytest.mark.parametrize(
    "ranges",
    [
        np.full(360, 1.0),
        np.full(360, np.inf),
    ],
)
def test_closed_rings_and_empty_scans_have_no_cluster_frontiers(ranges):
    scan, pose = LaserScan(0.0, -math.pi, 2.0 * math.pi / 360, 0.0, 5.0, ranges), np.zeros(3)
    region = perceived(scan, pose)
    assert len(cluster_frontiers(region, scan, pose, 0)) == 0
