"""What a planar lidar sees of all that stands in a world, without a simulator: for figures, benchmarks and examples."""

import numpy as np

from drake_starnav.geometry.raycast import Fan, ShapeBins, cast_grid, circle_rows, segment_rows
from drake_starnav.lidar.laser_scan import LaserScan
from drake_starnav.lidar.sensor_model import LidarParameters, measure
from drake_starnav.worlds.world import World

_CELL = 1.0  # m, of the ray caster's grid: about the size of an obstacle


def visible_shapes(world: World) -> ShapeBins:
    """The world as the ray caster takes it."""
    return ShapeBins.grid(np.vstack((circle_rows(world.discs), segment_rows(world.segments))), _CELL)


def scan_from(shapes: ShapeBins, pose: np.ndarray, lidar: LidarParameters, seed: int = 0, index: int = 0) -> LaserScan:
    """The scan that a lidar at a pose (x, y, yaw) in W takes of shapes as from `visible_shapes`, with its noise.

    The seed and the index of the scan, which gives it its time, determine the noise.
    """
    view = lidar.field_of_view
    fan = Fan.regular(*view)
    distances = np.full(lidar.beams, np.inf)
    cast_grid(shapes, pose, fan, distances, lidar.range_max)
    ranges = measure(distances, lidar, seed, index)
    return LaserScan(index / lidar.rate, view.angle_min, view.angle_increment, lidar.range_min, lidar.range_max, ranges)
