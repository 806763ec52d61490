"""What a planar lidar sees of all that stands in a world, without a simulator: for figures, benchmarks and examples."""

import math

import numpy as np

from drake_starnav.geometry.polyline import resample_polyline
from drake_starnav.lidar.laser_scan import LaserScan
from drake_starnav.lidar.raycast import Fan, Shapes, cast_groups, make_circle_rows, make_segment_rows
from drake_starnav.lidar.sensor_model import LidarParameters, measure
from drake_starnav.worlds.world import World

STEP = 0.1
"""The width is measured this often along a path, m."""
BEAMS = 180
"""Half of them give the directions in which it is measured: one for each 2 degrees."""
FARTHEST = 20.0
"""What is farther away does not narrow anything, m."""


def visible_shapes(world: World) -> Shapes:
    """The world as the ray caster takes it."""
    return Shapes.of([np.vstack((make_circle_rows(world.discs), make_segment_rows(world.segments)))])


def scan_from(shapes: Shapes, pose: np.ndarray, lidar: LidarParameters, seed: int = 0, index: int = 0) -> LaserScan:
    """The scan that a lidar at a pose (x, y, yaw) in W takes of shapes as from `visible_shapes`, with its noise.

    The seed and the index of the scan, which gives it its time, determine the noise.
    """
    view = lidar.field_of_view
    fan = Fan.regular(*view)
    distances = np.full(lidar.beams, np.inf)
    cast_groups(tuple(shapes), np.array([pose]), tuple(fan), distances, lidar.range_max)
    ranges = measure(distances, lidar, seed, index)
    range_limits = lidar.range_min, lidar.range_max
    return LaserScan(index / lidar.rate, *view[:2], *range_limits, ranges, lost_beams=lidar.dropout > 0.0)


def find_tightest_gap(world: World, path: np.ndarray) -> float:
    """The least width of the free space along a path (n, 2), m, W, outside of all obstacles: of all straight lines
    through its points, the shortest between two obstacles, m; infinite where nothing stands on both sides.

    Source: the characteristic dimension of D. Perille et al., Benchmarking metric ground navigation, 2020.
    """
    shapes, fan, least_width = visible_shapes(world), Fan.regular(-math.pi, 2.0 * math.pi / BEAMS, BEAMS), math.inf
    for x, y in resample_polyline(path, STEP):
        ranges = np.full(BEAMS, np.inf)
        cast_groups(tuple(shapes), np.array([(x, y, 0.0)]), tuple(fan), ranges, FARTHEST)
        ranges[ranges >= FARTHEST] = np.inf
        least_width = min(least_width, float((ranges[: BEAMS // 2] + ranges[BEAMS // 2 :]).min()))
    return least_width
