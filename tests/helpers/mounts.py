"""Lidars anywhere on a robot, and what they measure of a world, by plain NumPy."""

import dataclasses
import math
from typing import NamedTuple

import numpy as np

from drake_starnav.geometry.se2 import compose_poses
from drake_starnav.lidar.laser_scan import LaserScan
from drake_starnav.lidar.mounts import ON_AXIS, Mount
from drake_starnav.worlds.world import World
from tests.helpers.scans import ORIGIN, cast


class Lidar(NamedTuple):
    """A lidar on a robot: its mount, its field of view about S's x axis, rad, and its beams."""

    mount: Mount
    span: float = 2.0 * math.pi
    beams: int = 360


CENTRED = (Lidar(ON_AXIS),)
AHEAD = (Lidar(Mount(0.2, 0.0, 0.0, False)),)
BEHIND = (Lidar(Mount(-0.2, 0.0, 2.5, False)),)
UPSIDE_DOWN = (Lidar(Mount(0.1, 0.05, 0.5, True)),)
CORNERS = (
    Lidar(Mount(0.16, -0.16, -0.25 * math.pi, False), 1.5 * math.pi, 271),
    Lidar(Mount(-0.16, 0.16, 0.75 * math.pi, True), 1.5 * math.pi, 271),
)
FRONT_AND_REAR = (Lidar(Mount(0.2, 0.0, 0.0, False), math.radians(220.0), 441), Lidar(Mount(-0.2, 0.0, math.pi, True)))
LIDARS = {
    "ahead": AHEAD,
    "behind": BEHIND,
    "upside down": UPSIDE_DOWN,
    "corners": CORNERS,
    "front and rear": FRONT_AND_REAR,
}
"""Whose views meet all around a robot of 0.25 m."""


def mounts(lidars: tuple[Lidar, ...]) -> tuple[Mount, ...]:
    """Of the lidars."""
    return tuple(lidar.mount for lidar in lidars)


def looks(
    world: World, lidars: tuple[Lidar, ...], pose: np.ndarray = ORIGIN, range_max: float = 5.0
) -> list[LaserScan]:
    """The scan of each lidar in its own frame S, from a robot at a pose."""
    return [_look(world, lidar, pose, range_max) for lidar in lidars]


def _look(world: World, lidar: Lidar, pose: np.ndarray, range_max: float) -> LaserScan:
    (x, y, yaw, upside_down, *_), span, beams = lidar
    full = span > 6.28
    step = span / beams if full else span / (beams - 1)
    first = -math.pi if full else -0.5 * span
    if upside_down:  # clockwise in the robot's frame
        first = -first - (beams - 1) * step
    place = compose_poses(pose, (x, y, yaw))
    scan = cast(world, place, beams=beams, range_max=range_max, angle_min=first, angle_increment=step)
    if not upside_down:
        return scan
    return dataclasses.replace(scan, ranges=scan.ranges[::-1], angle_min=-scan.angle_max)
