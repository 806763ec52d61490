"""Certificates for rules of a place: areas that the robot must stay out of, and areas in which it must be slow."""

from dataclasses import dataclass
from functools import cached_property
from typing import Any

import numpy as np

from drake_starnav.errors import StarnavError, shown
from drake_starnav.geometry.polyline import measure_signed_distance
from drake_starnav.geometry.se2 import place_points
from drake_starnav.parameters import is_number
from drake_starnav.robot.motion import Motion


class _Zone:
    """A polygon on the floor."""

    polygon: Any

    @cached_property
    def corners(self) -> np.ndarray:
        """The polygon's corners, shape (n, 2), W, m."""
        return np.array(self.polygon)


@dataclass(frozen=True)
class KeepOut(_Zone):
    """Accepts motions on which the robot, as the discs that cover its footprint, stays out of a polygon.

    A robot that begins nearer may move, but not nearer to the polygon.

    Attributes:
        polygon: corners, shape (n, 2), n >= 3, W, m; simple, in either order.
        margin: kept beyond those discs, m: half the distance between two samples, and the base's error.
        name: of the place, in messages.

    Raises:
        StarnavError: the polygon has another shape or is not finite, or the margin is negative.
    """

    polygon: Any
    margin: float = 0.02
    name: str = ""

    def __post_init__(self) -> None:
        _keep_corners(self)
        if not (is_number(self.margin) and self.margin >= 0.0):
            raise StarnavError(f"KeepOut.margin is {shown(self.margin)}; allowed: 0 m or more")

    def accepts(self, motion: Motion) -> bool:
        """Return whether the robot keeps its distance, or the one that it has."""
        cover_radius, cover = motion.footprint.cover_radius, motion.footprint.cover
        distance = (
            measure_signed_distance(self.corners, place_points(motion.pose, cover)).reshape(-1, len(cover)).min(axis=1)
        )
        return bool(distance.min() >= min(cover_radius + self.margin, distance[0]) - 1e-9)


@dataclass(frozen=True)
class SpeedZone(_Zone):
    """Accepts motions on which the robot is no faster than a limit while its centre is in a polygon.

    A robot that is too fast already brakes.

    Attributes:
        polygon: corners, shape (n, 2), n >= 3, W, m; simple, in either order.
        max_speed: m/s.
        name: of the place, in messages.

    Raises:
        StarnavError: the polygon has another shape or is not finite, or the speed is not above 0.
    """

    polygon: Any
    max_speed: float
    name: str = ""

    def __post_init__(self) -> None:
        _keep_corners(self)
        if not (is_number(self.max_speed) and self.max_speed > 0.0):
            raise StarnavError(f"SpeedZone.max_speed is {shown(self.max_speed)}; allowed: more than 0 m/s")

    def accepts(self, motion: Motion) -> bool:
        """Return whether the robot is slow wherever the zone says so."""
        fast = np.abs(motion.twist[:, 0]) > self.max_speed + 1e-9
        if not fast.any():
            return True
        fast[1:] |= fast[:-1]  # also where it has become slow: the step to it was driven too fast
        return bool((measure_signed_distance(self.corners, motion.position[fast]) > 0.0).all())


def _keep_corners(zone: KeepOut | SpeedZone) -> None:
    """Replace the polygon of a zone by a tuple of (x, y), or raise a `StarnavError`."""
    kind, polygon = type(zone).__name__, zone.polygon
    rows = polygon.tolist() if isinstance(polygon, np.ndarray) else polygon
    if not isinstance(rows, (list, tuple)) or len(rows) < 3:
        raise StarnavError(f"{kind}.polygon is {shown(rows)}; allowed: three or more [x, y], W, m")
    for k, row in enumerate(rows):
        if not isinstance(row, (list, tuple, np.ndarray)) or len(row) != 2 or not all(map(is_number, row)):
            raise StarnavError(f"{kind}.polygon[{k}] is {shown(row)}; allowed: finite [x, y], W, m")
    object.__setattr__(zone, "polygon", tuple((float(x), float(y)) for x, y in rows))
    if not isinstance(zone.name, str):
        raise StarnavError(f"{kind}.name is {shown(zone.name)}; allowed: a text")


ZONE_KINDS: dict[str, type] = {kind.__name__: kind for kind in (KeepOut, SpeedZone)}
"""Kinds of zones by the tag that a scenario has."""
