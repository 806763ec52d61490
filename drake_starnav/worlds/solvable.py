"""Worlds that the robot can solve: drawn until it can, or checked."""

import math

import numpy as np

from drake_starnav.errors import StarnavError
from drake_starnav.worlds.clearance import clearance, nearest_obstacle
from drake_starnav.worlds.shortest_path import shortest_path
from drake_starnav.worlds.world import World

SPARE = 0.05  # m, every generated world is solvable by a robot this much larger
_TRIES = 500


class Drawn:
    """A world that is drawn at random until the robot can solve it; a subclass holds its sizes and draws one."""

    def draw(self, rng: np.random.Generator) -> World:
        """Any world."""
        raise NotImplementedError

    def make(self, rng: np.random.Generator, robot_radius: float) -> World:
        """The first world drawn whose goal the robot can reach with `SPARE` to all sides.

        Raises:
            StarnavError: no solvable world was found.
        """
        size = robot_radius + SPARE
        for _ in range(_TRIES):
            world = self.draw(rng)
            ends = np.array([world.start[:2], world.goal])
            if (clearance(world, ends) >= size).all() and shortest_path(world, size) is not None:
                return world
        raise StarnavError(
            f"{type(self).__name__}: none of {_TRIES} worlds was solvable for robot_radius {robot_radius:g} m; "
            "allowed: a robot that fits through the passages (take a smaller robot, fewer obstacles or wider passages)"
        )


def random_yaw(rng: np.random.Generator) -> float:
    """Any heading, rad, in [-pi, pi)."""
    return float(rng.uniform(-math.pi, math.pi))


def check_free_ends(world: World, robot_radius: float, place: str) -> None:
    """Raise `StarnavError` if the robot (radius in m) touches an obstacle at one of the ends, which `place` has."""
    check_free(world, world.start[:2], robot_radius, f"{place}.start")
    check_free(world, world.goal, robot_radius, f"{place}.goal")


def check_free(world: World, point: tuple[float, float], robot_radius: float, name: str) -> None:
    """Raise `StarnavError` if the robot touches an obstacle at a point (x, y), W, m, of that name."""
    obstacle, distance = nearest_obstacle(world, point)
    if distance <= robot_radius:
        raise StarnavError(
            f"{name} is [{point[0]:g}, {point[1]:g}], {distance:g} m from {obstacle}; "
            f"allowed: more than robot_radius {robot_radius:g} m from every obstacle"
        )


def check_reachable(world: World, robot_radius: float, place: str) -> None:
    """Raise `StarnavError` if there is no way for the robot; arguments as of `check_free_ends`."""
    if shortest_path(world, robot_radius) is None:
        raise StarnavError(
            f"{place}.goal [{world.goal[0]:g}, {world.goal[1]:g}] is out of reach from the start "
            f"[{world.start[0]:g}, {world.start[1]:g}] for robot_radius {robot_radius:g} m; "
            "allowed: a goal to which the robot has a way"
        )
