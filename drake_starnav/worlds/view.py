"""What a planar lidar sees of all that stands in a world, without a simulator: for figures, benchmarks and examples."""

from collections.abc import Iterable, Iterator
from dataclasses import dataclass

import numpy as np

from drake_starnav.errors import StarnavError
from drake_starnav.geometry.raycast import Fan, ShapeBins, cast_grid, circle_rows, segment_rows
from drake_starnav.lidar.laser_scan import LaserScan
from drake_starnav.lidar.sensor_model import LidarParameters, measure
from drake_starnav.worlds.clearance import clearance
from drake_starnav.worlds.world import World

_CELL = 1.0  # m, of the ray caster's grid: about the size of an obstacle
_TRIES = 10_000  # a world in which so many random places are blocked counts as full


@dataclass(frozen=True)
class View:
    """One scan and where it was taken.

    Attributes:
        world: the obstacles.
        pose: (x, y, yaw) of the sensor in W, m and rad.
        scan: in the sensor frame S.
    """

    world: World
    pose: np.ndarray
    scan: LaserScan


def visible_shapes(world: World) -> ShapeBins:
    """The world as the ray caster takes it."""
    return ShapeBins.grid(np.vstack((circle_rows(world.discs), segment_rows(world.segments))), _CELL)


def scan_from(shapes: ShapeBins, pose: np.ndarray, lidar: LidarParameters, seed: int = 0, index: int = 0) -> LaserScan:
    """The scan that a lidar takes, with its noise.

    Args:
        shapes: as from `visible_shapes`.
        pose: (x, y, yaw) of the sensor in W, m and rad.
        lidar: the sensor.
        seed: of the noise.
        index: number of the scan, which gives it its time and its own noise.
    """
    view = lidar.field_of_view
    fan = Fan.regular(*view)
    distances = np.full(lidar.beams, np.inf)
    cast_grid(shapes, pose, fan, distances, lidar.range_max)
    ranges = measure(distances, lidar, seed, index)
    return LaserScan(index / lidar.rate, view.angle_min, view.angle_increment, lidar.range_min, lidar.range_max, ranges)


def random_free_pose(world: World, rng: np.random.Generator, robot_radius: float) -> np.ndarray:
    """A random pose (x, y, yaw) in W, m and rad, at which a disc of `robot_radius` (m) touches nothing.

    Raises:
        StarnavError: the world is too full.
    """
    x0, y0, x1, y1 = world.extent
    for _ in range(_TRIES):
        pose = rng.uniform((x0, y0, -np.pi), (x1, y1, np.pi))
        if clearance(world, pose[None, :2])[0] > robot_radius:
            return pose
    raise StarnavError(
        f"world {world.name}: no free place for a robot of radius {robot_radius:g} m among {_TRIES} random ones; "
        "allowed: a world with room for the robot"
    )


def random_views(worlds: Iterable[World], lidar: LidarParameters, robot_radius: float, seed: int) -> Iterator[View]:
    """One scan of each world from a random free pose; view k depends on world k, `seed` and k alone.

    Args:
        worlds: to look at.
        lidar: the sensor.
        robot_radius: clearance of the poses, m.
        seed: of poses and noise.
    """
    for k, world in enumerate(worlds):
        pose = random_free_pose(world, np.random.default_rng([seed, k]), robot_radius)
        yield View(world, pose, scan_from(visible_shapes(world), pose, lidar, seed, k))
