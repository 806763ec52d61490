"""Draws worlds until the robot can solve one."""

import math

import numpy as np

from drake_starnav.errors import StarnavError
from drake_starnav.worlds.clearance import clearance
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
