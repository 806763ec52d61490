"""A planar world to drive through: its obstacles, the start and the goal."""

import math
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
from drake_starnav.worlds.outlines import make_rectangle

ROBOT_HEIGHT = 0.13
"""Height of the shipped robots' hulls, m."""

SMALLEST, FARTHEST = 1e-3, 1e6
"""Least radius, and greatest distance from the origin, m; beyond them floating-point precision does not suffice."""

MOST_SHAPES = 3000
"""Most cylinders: more take Drake minutes and gigabytes to register, as it notes of each pair if it may collide."""

OPEN_BORDER = 2.0
"""How much of an open plane around the obstacles, start and goal counts as the world's extent, m."""


def check_numbers(value: Any, name: str, entries: tuple[str, ...]) -> tuple[float, ...]:
    """The numbers of a list or an array; a `StarnavError` unless it has as many finite ones as there are `entries`."""
    if not isinstance(value, (list, tuple, np.ndarray)):
        raise StarnavError(f"{name} is {shown(value)}; allowed: a list")
    number_list = [x.item() if isinstance(x, np.generic) else x for x in value]
    if len(number_list) != len(entries) or not all(is_number(x) and abs(x) <= FARTHEST for x in number_list):
        allowed_text = f"finite [{', '.join(entries)}], each at most {FARTHEST:g}"
        raise StarnavError(f"{name} is {shown(number_list)}; allowed: {allowed_text}")
    for entry, number in zip(entries, number_list, strict=True):
        if entry == "yaw" and abs(number) > 2.0 * math.pi:
            raise StarnavError(
                f"{name} is {shown(number_list)}: a yaw of {number:g} rad is more than a turn; allowed: -6.28 <= yaw "
                f"<= 6.28 rad, e.g. {math.radians(number):.4g} for {number:g} degrees"
            )
    return tuple(map(float, number_list))


def check_keys(entry: Any, place: str, keys: Sequence[str]) -> None:
    """Raise `StarnavError` unless an entry of a file is a mapping with all of the keys."""
    missing = [key for key in keys if not isinstance(entry, dict) or key not in entry]
    if missing:
        raise StarnavError(f"{place} has no {', '.join(missing)}; allowed: a mapping with {', '.join(keys)}")


def _read_rows(value: Any, name: str, entries: tuple[str, ...]) -> np.ndarray:
    """A read-only array (n, m) of rows with as many numbers as entries, or a `StarnavError`."""
    rows = value.tolist() if isinstance(value, np.ndarray) and value.dtype != float else value
    if not isinstance(rows, (list, tuple, np.ndarray)):
        raise StarnavError(f"{name} is {shown(rows)}; allowed: a list")
    is_table = isinstance(rows, np.ndarray) and rows.ndim == 2 and rows.shape[1] == len(entries)
    if not is_table or not (np.abs(rows) <= FARTHEST).all():  # one by one they take a hundred times as long
        rows = [check_numbers(row, f"{name}[{k}]", entries) for k, row in enumerate(rows)]
    array = np.array(rows, dtype=float).reshape(-1, len(entries))
    array.flags.writeable = False
    return array


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
        bounds: (x_min, y_min, x_max, y_max) with walls along it, or None, or none, for an open plane.
        timeout: s, the time a trial in this world may take by default.
        model: whose bodies are the obstacles; cylinders and polygons are then their footprints, of no height.
        optimal_time: s, by which a benchmark scores trials in this world, or None if it is no benchmark's.
        height: of the robot, m: what is above it does not matter.
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
    height: float = ROBOT_HEIGHT

    def __post_init__(self) -> None:
        place, circle, corner = f"world {self.name}: ", ("x", "y", "radius"), ("x", "y")
        single_entries = {"start": (*corner, "yaw"), "goal": corner, "bounds": ("x_min", "y_min", "x_max", "y_max")}
        if self.bounds is None or not len(self.bounds):
            object.__setattr__(self, "bounds", None)
            del single_entries["bounds"]
        for name, entries in single_entries.items():
            object.__setattr__(self, name, check_numbers(getattr(self, name), place + name, entries))
        polygons = (_read_rows(polygon, f"{place}polygons[{k}]", corner) for k, polygon in enumerate(self.polygons))
        object.__setattr__(self, "polygons", tuple(polygons))
        for name in ("cylinders", "spheres"):
            rows = _read_rows(getattr(self, name), place + name, circle)
            object.__setattr__(self, name, rows)
            for n in np.flatnonzero(rows[:, 2] < SMALLEST):
                self._refuse(f"{name}[{n}] is {rows[n].tolist()}", f"a positive radius of at least {SMALLEST:g} m")
        for k, polygon in enumerate(self.polygons):
            if len(polygon) < 3:
                self._refuse(f"polygons[{k}] is {shown(polygon.tolist())}", "at least 3 finite corners")
        if self.bounds is not None and not (self.bounds[0] < self.bounds[2] and self.bounds[1] < self.bounds[3]):
            self._refuse(f"bounds is {list(self.bounds)}", "x_min < x_max and y_min < y_max")

    def _refuse(self, what: str, allowed: str) -> None:
        raise StarnavError(f"world {self.name}: {what}; allowed: {allowed}")

    @cached_property
    def discs(self) -> np.ndarray:
        """What cylinders and spheres bar to the robot, shape (n + m, 3): x, y, radius.

        A sphere blocks what it fills below the robot's height; above that it may bulge over the robot.
        """
        sphere_sections = self.spheres.copy()
        above = np.maximum(sphere_sections[:, 2] - self.height, 0.0)  # from the robot's top up to the sphere's equator
        sphere_sections[:, 2] = np.sqrt(sphere_sections[:, 2] ** 2 - above**2)
        return np.vstack((self.cylinders, sphere_sections))

    @cached_property
    def tree(self) -> shapely.STRtree:
        """The polygons, to be searched by place."""
        return shapely.STRtree([shapely.Polygon(polygon) for polygon in self.polygons])

    @cached_property
    def segments(self) -> np.ndarray:
        """Edges of all polygons and of the bounds, shape (s, 4): x1, y1, x2, y2."""
        edge_loops = [*self.polygons, *([] if self.bounds is None else [make_rectangle(*self.bounds)])]
        return np.vstack([np.zeros((0, 4)), *(np.hstack((loop, np.roll(loop, -1, axis=0))) for loop in edge_loops)])

    @cached_property
    def extent(self) -> tuple[float, float, float, float]:
        """A box around everything that matters: (x_min, y_min, x_max, y_max)."""
        if self.bounds is not None:
            return self.bounds
        centers, radii = self.discs[:, :2], self.discs[:, 2:]
        end_points = np.array([self.start[:2], self.goal])
        mover_places = self.moving_obstacles.way_points[:, 1:]
        all_places = np.vstack((end_points, centers - radii, centers + radii, *self.polygons, mover_places))
        (x0, y0), (x1, y1) = all_places.min(axis=0) - OPEN_BORDER, all_places.max(axis=0) + OPEN_BORDER
        return float(x0), float(y0), float(x1), float(y1)
