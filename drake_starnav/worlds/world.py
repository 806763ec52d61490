"""A planar world to drive through: its obstacles, the start and the goal."""

from collections.abc import Sequence
from dataclasses import dataclass, field
from functools import cached_property
from typing import Any

import numpy as np
import shapely

from drake_starnav.errors import StarnavError, shown
from drake_starnav.parameters import is_number
from drake_starnav.utils.snapshot import snapshot
from drake_starnav.worlds.moving_obstacles import MovingObstacles
from drake_starnav.worlds.outlines import rectangle

ROBOT_HEIGHT = 0.13
"""Height of the robots' hulls and of their lidar's plane: obstacles above it do not matter, m."""

SMALLEST, FARTHEST = 1e-3, 1e6
"""Least radius, and greatest distance from the origin, m; beyond them floating-point precision does not suffice."""

MOST_SHAPES = 3000
"""Of cylinders: more take Drake minutes and gigabytes to register, as it notes of each pair whether it may collide."""

OPEN_BORDER = 2.0
"""How much of an open plane around the obstacles, start and goal counts as the world's extent, m."""


def _rows(value: object, names: tuple[str, ...], place: str) -> np.ndarray:
    """A read-only array with a column for each name, or a `StarnavError`."""
    try:
        array = np.array(value, dtype=float)
    except (TypeError, ValueError):
        raise StarnavError(f"{place} is {shown(value)}; allowed: numbers, rows of ({', '.join(names)})") from None
    if array.size == 0:
        array = np.zeros((0, len(names)))
    if array.ndim != 2 or array.shape[1] != len(names):
        raise StarnavError(f"{place} has shape {array.shape}; allowed: (n, {len(names)}), rows of ({', '.join(names)})")
    array.flags.writeable = False
    return array


def _numbers(value: object, names: tuple[str, ...], place: str) -> tuple[float, ...]:
    """As many numbers as names, or a `StarnavError`."""
    try:
        numbers = tuple(float(x) for x in value)  # type: ignore[attr-defined]
    except (TypeError, ValueError):
        numbers = ()
    if len(numbers) != len(names):
        raise StarnavError(f"{place} is {shown(value)}; allowed: ({', '.join(names)})")
    return numbers


@dataclass(frozen=True)
class ModelFile:
    """A file of Drake's model formats whose bodies stand in a world.

    Attributes:
        path: of the file; empty for `text`.
        weld: whether bodies without a joint are welded where they stand.
        moving: whether it has collision geometry that moves; known once its footprints are.
        text: model directives, as in a .dmd.yaml file.
        surfaces: footprints of those fixed meshes with which the plant has no contact, each of shape (k, 2), m.
    """

    path: str
    weld: bool = True
    moving: bool = False
    text: str = ""
    surfaces: tuple[np.ndarray, ...] = ()


@snapshot
class World:
    """Obstacles stand on the floor z = 0 and are taller than the robot; frame W, metres, radians.

    Attributes:
        name: what the world is called in reports.
        start: (x, y, yaw) of the robot.
        goal: (x, y).
        cylinders: shape (n, 3): x, y, radius.
        spheres: shape (m, 3): x, y, radius; each rests on the floor.
        polygons: simple polygons, each of shape (k, 2), the footprints of prisms.
        bounds: (x_min, y_min, x_max, y_max) with walls along it, or None for an open plane.
        timeout: s, the time a trial in this world may take by default.
        model: whose bodies are the obstacles; cylinders and polygons are then their footprints, of no height.
        optimal_time: s, by which a benchmark scores trials in this world, or None if it is no benchmark's.
        moving_obstacles: moving obstacles; clearances and shortest paths of the world are among the static ones.
    """

    name: str
    start: tuple[float, float, float]
    goal: tuple[float, float]
    cylinders: np.ndarray = field(default_factory=lambda: np.zeros((0, 3)))
    spheres: np.ndarray = field(default_factory=lambda: np.zeros((0, 3)))
    polygons: tuple[np.ndarray, ...] = ()
    bounds: tuple[float, float, float, float] | None = None
    timeout: float = 180.0
    model: ModelFile | None = None
    optimal_time: float | None = None
    moving_obstacles: MovingObstacles = field(default_factory=MovingObstacles)

    def __post_init__(self) -> None:
        place = f"world {self.name}: "
        for name in ("cylinders", "spheres"):
            object.__setattr__(self, name, _rows(getattr(self, name), ("x", "y", "radius"), place + name))
        polygons = (_rows(polygon, ("x", "y"), f"{place}polygons[{k}]") for k, polygon in enumerate(self.polygons))
        object.__setattr__(self, "polygons", tuple(polygons))
        for name, names in (("start", ("x", "y", "yaw")), ("goal", ("x", "y"))):
            object.__setattr__(self, name, _numbers(getattr(self, name), names, place + name))
        if self.bounds is not None:
            corners = ("x_min", "y_min", "x_max", "y_max")
            object.__setattr__(self, "bounds", _numbers(self.bounds, corners, f"{place}bounds"))
        self._check()

    def _check(self) -> None:
        for name, value in (("start", self.start), ("goal", self.goal), ("bounds", self.bounds or ())):
            if not all(abs(x) <= FARTHEST for x in value):
                self._refuse(f"{name} is {list(value)}", f"finite numbers up to {FARTHEST:g}")
        for name in ("cylinders", "spheres"):
            for k, (x, y, radius) in enumerate(getattr(self, name)):
                if not (abs(x) <= FARTHEST and abs(y) <= FARTHEST and SMALLEST <= radius <= FARTHEST):
                    allowed = f"finite x, y up to {FARTHEST:g} m and a positive radius of at least {SMALLEST:g} m"
                    self._refuse(f"{name}[{k}] is [{x:g}, {y:g}, {radius:g}]", allowed)
        for k, polygon in enumerate(self.polygons):
            if len(polygon) < 3 or not (np.abs(polygon) <= FARTHEST).all():
                allowed = f"at least 3 finite corners up to {FARTHEST:g} m"
                self._refuse(f"polygons[{k}] is {shown(polygon.tolist())}", allowed)
        if self.bounds is not None and not (self.bounds[0] < self.bounds[2] and self.bounds[1] < self.bounds[3]):
            self._refuse(f"bounds is {list(self.bounds)}", "x_min < x_max and y_min < y_max")

    def _refuse(self, what: str, allowed: str) -> None:
        raise StarnavError(f"world {self.name}: {what}; allowed: {allowed}")

    @cached_property
    def discs(self) -> np.ndarray:
        """What cylinders and spheres bar to the robot, shape (n + m, 3): x, y, radius.

        A sphere blocks what it fills below the robot's height; above that it may bulge over the robot.
        """
        sections = self.spheres.copy()
        above = np.maximum(sections[:, 2] - ROBOT_HEIGHT, 0.0)  # from the robot's top up to the sphere's equator
        sections[:, 2] = np.sqrt(sections[:, 2] ** 2 - above**2)
        return np.vstack((self.cylinders, sections))

    @cached_property
    def tree(self) -> shapely.STRtree:
        """The polygons, to be searched by place."""
        return shapely.STRtree([shapely.Polygon(polygon) for polygon in self.polygons])

    @cached_property
    def segments(self) -> np.ndarray:
        """Edges of all polygons and of the bounds, shape (s, 4): x1, y1, x2, y2."""
        loops = [*self.polygons, *([] if self.bounds is None else [rectangle(*self.bounds)])]
        return np.vstack([np.zeros((0, 4)), *(np.hstack((loop, np.roll(loop, -1, axis=0))) for loop in loops)])

    @cached_property
    def extent(self) -> tuple[float, float, float, float]:
        """A box around everything that matters: (x_min, y_min, x_max, y_max)."""
        if self.bounds is not None:
            return self.bounds
        centers, radii = self.discs[:, :2], self.discs[:, 2:]
        ends = np.array([self.start[:2], self.goal])
        ways = self.moving_obstacles.way_points[:, 1:]
        places = np.vstack((ends, centers - radii, centers + radii, *self.polygons, ways))
        (x0, y0), (x1, y1) = places.min(axis=0) - OPEN_BORDER, places.max(axis=0) + OPEN_BORDER
        return float(x0), float(y0), float(x1), float(y1)


def check_list(value: Any, name: str) -> Sequence:
    """The value, or a `StarnavError` that names it if it is no list."""
    if not isinstance(value, (list, tuple)):
        raise StarnavError(f"{name} is {shown(value)}; allowed: a list")
    return value


def check_ends(start: Any, goal: Any, prefix: str) -> tuple[tuple[float, float, float], tuple[float, float]]:
    """Start (x, y, yaw) and goal (x, y), or a `StarnavError` that names the wrong one after a prefix."""
    x, y, yaw = check_numbers(start, f"{prefix}start", ("x", "y", "yaw"))
    goal_x, goal_y = check_numbers(goal, f"{prefix}goal", ("x", "y"))
    return (x, y, yaw), (goal_x, goal_y)


def check_numbers(value: Any, name: str, entries: tuple[str, ...], *, or_empty: bool = False) -> Sequence:
    """The value, or a `StarnavError` if it is no list of as many finite numbers as there are `entries`."""
    numbers = check_list(value, name)
    if or_empty and not numbers:
        return numbers
    if len(numbers) != len(entries) or not all(map(is_number, numbers)):
        empty = ", or an empty list" if or_empty else ""
        raise StarnavError(f"{name} is {shown(list(numbers))}; allowed: finite [{', '.join(entries)}]{empty}")
    return numbers
