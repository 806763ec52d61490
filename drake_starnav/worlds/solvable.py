"""Draws worlds until the robot can solve one."""

import math
from collections.abc import Callable
from typing import Any

import numpy as np

from drake_starnav.errors import StarnavError
from drake_starnav.parameters import check_parameters
from drake_starnav.worlds.clearance import clearance
from drake_starnav.worlds.shortest_path import shortest_path
from drake_starnav.worlds.world import World

SPARE = 0.05  # m, every generated world is solvable by a robot this much larger
_TRIES = 500


def first_solvable(
    kind: Any, draw: Callable[[np.random.Generator], World], rng: np.random.Generator, robot_radius: float
) -> World:
    """The first world drawn whose goal the robot can reach with `SPARE` to all sides.

    Args:
        kind: the generator's parameters, checked before the first draw.
        draw: draws one world.
        rng: source of chance.
        robot_radius: m.

    Raises:
        StarnavError: a parameter is out of its limits, or no solvable world was found.
    """
    name = type(kind).__name__
    check_parameters(kind, name)
    check_robot_radius(robot_radius)
    size = robot_radius + SPARE
    for _ in range(_TRIES):
        world = draw(rng)
        ends = np.array([world.start[:2], world.goal])
        if (clearance(world, ends) >= size).all() and shortest_path(world, size) is not None:
            return world
    raise StarnavError(
        f"{name}: none of {_TRIES} worlds was solvable for robot_radius {robot_radius:g} m; "
        "allowed: a robot that fits through the passages (take a smaller robot, fewer obstacles or wider passages)"
    )


def check_robot_radius(robot_radius: float) -> None:
    """Raise `StarnavError` unless the radius is a positive length."""
    if not (math.isfinite(robot_radius) and robot_radius > 0.0):
        raise StarnavError(f"robot_radius is {robot_radius}; allowed: 0 < x m")


def random_yaw(rng: np.random.Generator) -> float:
    """Any heading, rad, in [-pi, pi)."""
    return float(rng.uniform(-math.pi, math.pi))
