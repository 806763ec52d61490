"""Places that are closed to the robot: where ways failed, and what rules close, as walls that no lidar sees."""

import dataclasses
from collections.abc import Mapping
from dataclasses import field
from functools import cached_property

import numpy as np

from drake_starnav.geometry.polyline import around
from drake_starnav.surroundings.star_region import StarRegion, clear_region
from drake_starnav.utils.snapshot import snapshot

CLOSURE_RADIUS = 0.8
"""Radius of a closure where a way failed, in radii of the robot."""
SPACING = 0.2
"""Between the places of a wall, in radii of the robot: it does not fit between two of them."""


@snapshot
class ClosedPlaces:
    """Places that are closed to the robot. Immutable.

    Attributes:
        failed_places: shape (k, 2), where ways failed, W, m: nothing is free within
            CLOSURE_RADIUS of one, until all are tried again.
        keep_out_points: by their cause, places of shape (k, 2), W, m, which stay closed: the robot keeps off them as
            off hits.
    """

    failed_places: np.ndarray = field(default_factory=lambda: np.zeros((0, 2)))
    keep_out_points: Mapping[str, np.ndarray] = field(default_factory=dict)

    @cached_property
    def all_keep_outs(self) -> np.ndarray:
        """The places of all walls, shape (k, 2), W, m."""
        return np.vstack((np.zeros((0, 2)), *self.keep_out_points.values()))

    def add_keep_out(self, polygon: np.ndarray, distance: float, cause: str, cover_radius: float) -> "ClosedPlaces":
        """Add the wall around a polygon (n, 2), W, at a distance, for a robot of a cover radius, m."""
        places = around(polygon, distance, SPACING * cover_radius)
        known_points = self.keep_out_points.get(cause, places[:0])
        return dataclasses.replace(
            self, keep_out_points={**self.keep_out_points, cause: np.vstack((known_points, places))}
        )

    def find_cause_near(self, places: np.ndarray, reach: float) -> str:
        """Return the cause of a wall that is no farther than `reach` from places (n, 2), W, m; empty: there is none."""
        return next(
            (c for c, wall in self.keep_out_points.items() if np.hypot(*(wall[:, None] - places).T).min() <= reach), ""
        )

    def open_part(self, region: StarRegion) -> StarRegion:
        """Return the part of a region that no closure covers; a robot that is on a wall already may leave."""
        if self.keep_out_points:
            room = region.radius + region.margin
            wall_distances = np.hypot(*(self.all_keep_outs - region.center).T)
            region = clear_region(
                region,
                self.all_keep_outs[(wall_distances > region.radius) & (wall_distances < region.reach + room)],
                room,
            )
        return clear_region(region, self.failed_places, CLOSURE_RADIUS * region.radius)


NOTHING_CLOSED = ClosedPlaces()
