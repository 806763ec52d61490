"""A world written down obstacle by obstacle."""

import dataclasses
import math
from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np

from drake_starnav.errors import StarnavError
from drake_starnav.parameters import check_parameters, parameter
from drake_starnav.worlds.clearance import nearest_obstacle
from drake_starnav.worlds.convex_parts import convex_parts
from drake_starnav.worlds.solvable import check_robot_radius
from drake_starnav.worlds.world import World


def _listing(default: list, help: str) -> Any:
    return dataclasses.field(default_factory=lambda: list(default), metadata={"help": help})


@dataclass(frozen=True)
class Obstacles:
    """Obstacles, start and goal as given. The goal may be out of reach, but start and goal must be free."""

    cylinders: list[list[float]] = _listing([], "one [x, y, radius] each, m")
    polygons: list[list[list[float]]] = _listing([], "one list of corners [x, y] each, m; simple, of any orientation")
    bounds: list[float] = _listing([], "[x_min, y_min, x_max, y_max] of the walls around, m; empty for an open plane")
    start: list[float] = _listing([0.0, 0.0, 0.0], "[x, y, yaw] of the robot, m and rad")
    goal: list[float] = _listing([5.0, 0.0], "[x, y], m")
    timeout: float = parameter(180.0, "time a trial may take", unit="s", above=0.0)

    def make(self, rng: np.random.Generator, robot_radius: float) -> World:
        """The world as given; nothing in it is random.

        Args:
            rng: not used.
            robot_radius: m.

        Raises:
            StarnavError: a list has the wrong length or a value that is not a finite number, a polygon is not
                simple, or the robot touches an obstacle at the start or the goal.
        """
        for k, cylinder in enumerate(_checked_list(self.cylinders, "cylinders")):
            _check_numbers(cylinder, f"cylinders[{k}]", ("x", "y", "radius"))
        for k, polygon in enumerate(_checked_list(self.polygons, "polygons")):
            for n, corner in enumerate(_checked_list(polygon, f"polygons[{k}]")):
                _check_numbers(corner, f"polygons[{k}][{n}]", ("x", "y"))
            try:
                convex_parts(np.array(polygon, dtype=float).reshape(-1, 2))
            except StarnavError as error:
                raise StarnavError(f"Obstacles.polygons[{k}]: {error}") from None
        if len(_checked_list(self.bounds, "bounds")):
            _check_numbers(self.bounds, "bounds", ("x_min", "y_min", "x_max", "y_max"))
        _check_numbers(self.start, "start", ("x", "y", "yaw"))
        _check_numbers(self.goal, "goal", ("x", "y"))
        check_parameters(self, "Obstacles")
        check_robot_radius(robot_radius)
        x, y, yaw = self.start
        goal_x, goal_y = self.goal
        world = World(
            name="obstacles",
            start=(x, y, yaw),
            goal=(goal_x, goal_y),
            cylinders=np.array(self.cylinders),
            polygons=tuple(np.array(polygon) for polygon in self.polygons),
            bounds=(self.bounds[0], self.bounds[1], self.bounds[2], self.bounds[3]) if len(self.bounds) else None,
            timeout=self.timeout,
        )
        for name, point in (("start", world.start[:2]), ("goal", world.goal)):
            obstacle, distance = nearest_obstacle(world, point)
            if distance <= robot_radius:
                raise StarnavError(
                    f"Obstacles.{name} is [{point[0]:g}, {point[1]:g}], {distance:g} m from {obstacle}; "
                    f"allowed: more than robot_radius {robot_radius:g} m from every obstacle"
                )
        return world


def _checked_list(value: Any, name: str) -> Sequence:
    if not isinstance(value, (list, tuple)):
        raise StarnavError(f"Obstacles.{name} is {value!r}; allowed: a list")
    return value


def _check_numbers(value: Any, name: str, entries: tuple[str, ...]) -> None:
    numbers = _checked_list(value, name)
    good = all(isinstance(x, (int, float)) and not isinstance(x, bool) and math.isfinite(x) for x in numbers)
    if len(numbers) != len(entries) or not good:
        raise StarnavError(f"Obstacles.{name} is {list(numbers)}; allowed: finite [{', '.join(entries)}]")
