"""Places that are closed to the robot: where ways failed, and what rules close, as walls that no lidar sees."""

import dataclasses
from collections.abc import Mapping
from dataclasses import field
from functools import cached_property

import numpy as np

from drake_starnav.geometry.polyline import around
from drake_starnav.surroundings.star_region import StarRegion, clear_region
from drake_starnav.utils.snapshot import snapshot

CLOSED = 0.8
"""Radius of a closure where a way failed, in radii of the robot."""
SPACING = 0.2
"""Between the places of a wall, in radii of the robot: it does not fit between two of them."""


@snapshot
class Closures:
    """Places that are closed to the robot. Immutable.

    Attributes:
        failed: shape (k, 2), where ways failed, W, m: within CLOSED of one, nothing is free, until all are tried again.
        walls: by their cause, places of shape (k, 2), W, m, which stay closed: the robot keeps off them as off hits.
    """

    failed: np.ndarray = field(default_factory=lambda: np.zeros((0, 2)))
    walls: Mapping[str, np.ndarray] = field(default_factory=dict)

    @cached_property
    def solid(self) -> np.ndarray:
        """The places of all walls, shape (k, 2), W, m."""
        return np.vstack((np.zeros((0, 2)), *self.walls.values()))

    def walled(self, polygon: np.ndarray, distance: float, cause: str, robot_radius: float) -> "Closures":
        """These closures, and the wall around a polygon (n, 2), W, at a distance, for a robot of a cover radius, m."""
        places = around(polygon, distance, SPACING * robot_radius)
        before = self.walls.get(cause, places[:0])
        return dataclasses.replace(self, walls={**self.walls, cause: np.vstack((before, places))})

    def cause_near(self, places: np.ndarray, reach: float) -> str:
        """The cause of a wall that is no farther than `reach` from places (n, 2), W, m; empty: there is none."""
        return next((c for c, wall in self.walls.items() if np.hypot(*(wall[:, None] - places).T).min() <= reach), "")

    def open_part(self, region: StarRegion) -> StarRegion:
        """The part of a region that no closure covers; a robot that is on a wall already may leave."""
        if self.walls:
            room = region.radius + region.margin
            away = np.hypot(*(self.solid - region.center).T)
            region = clear_region(region, self.solid[(away > region.radius) & (away < region.reach + room)], room)
        return clear_region(region, self.failed, CLOSED * region.radius)


NOTHING_CLOSED = Closures()
